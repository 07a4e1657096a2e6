(* Checks certificates for tasks with timed initial literals, and theorem [timed_optimal]. The ground
   task has a variable for the phase, that is, the number of events so far; a variable that states
   that the last step was a wait; and a number for a lower bound on the time, its clock. They are
   added to the world as atoms and a fluent that do not occur in the problem. Every action becomes one
   instance for each passage: how many events occur before its start, up to it, before its end, and up to
   it. The clock after a step is the one that the operator of the step yields; it only has to represent
   the time at the end. *)
From Coq Require Import ZArith QArith List Bool FMapPositive Lia Lqa Setoid.
From Proved Require Import Task Check Proof Sound Derived Lifted Timed Faithful Symbolic Axioms Simulation.
Import ListNotations.
Open Scope Q_scope.

(* Need not be believed. Times of events and durations are multiples of 1/grid. *)
Record timeline := Timeline { grid : positive; phase_atoms : list atom; waited : atom; clock : atom }.
(* The numbers of events before and up to the start, and before and up to the end of an action *)
Definition passage := (nat * nat * nat * nat)%type.
Definition is_present {X} (o : option X) : bool := match o with Some _ => true | None => false end.

Section Check.
Variables (P : problem) (events : list event) (T : task) (N : names) (X : timeline).
Variables (case : nat -> list key -> passage -> case_tree) (wait_case : nat -> case_tree) (goal_case : case_tree).

Definition on_grid (q : Q) : bool := Pos.eqb (Qden (Qred (q * (Zpos (grid X) # 1)))) 1.
Definition moment : Q := 1 # grid X.
Definition phase (i : nat) : atom := nth i (phase_atoms X) (waited X).
Definition up_to (t : Q) : nat := length (filter (fun v => Qle_bool (time v) t) events).
Definition before (t : Q) : nat := length (filter (fun v => less (time v) t) events).
Definition extended : problem :=
  Problem (objects P) [] [] (add_atom (phase (up_to 0)) tt (initial_atoms P)) (add_atom (clock X) 0 (initial_values P))
    (And (Not (Atom (fst (waited X)) (map Object (snd (waited X))))) (goal_formula P)) (metric P) (per_time P) 0.

(* The added atoms and the clock do not occur in the problem. *)
Definition is_added (p : key) : bool := existsb (Pos.eqb p) (fst (waited X) :: fst (clock X) :: map fst (phase_atoms X)).
Fixpoint expression_free (e : expression) : bool :=
  match e with
  | Constant _ | Duration => true | Fluent f _ => negb (is_added f)
  | Plus a b | Minus a b | Times a b | Over a b => expression_free a && expression_free b
  end.
Fixpoint formula_free (f : formula) : bool :=
  match f with
  | Truth _ | Same _ _ => true | Atom p _ => negb (is_added p)
  | Compare _ a b => expression_free a && expression_free b
  | Not g => formula_free g | And g h => formula_free g && formula_free h | Forall _ g => formula_free g
  end.
Fixpoint effect_free (e : effect) : bool :=
  match e with
  | Nothing => true | Put _ p _ => negb (is_added p) | Change _ f _ x => negb (is_added f) && expression_free x
  | Both a b => effect_free a && effect_free b | When f a => formula_free f && effect_free a | Each _ a => effect_free a
  end.
Definition action_free (a : action) : bool :=
  formula_free (at_start a) && effect_free (start_effect a) && formula_free (over_all a) && formula_free (at_end a) &&
  effect_free (end_effect a) && match duration a with Some e => expression_free e | None => true end.

(* Ends of the range of start times of a passage with duration [d]; the flag excludes the end itself. *)
Definition time_at (i : nat) : list Q := match nth_error events i with Some v => [time v] | None => [] end.
Definition last_time (i : nat) : list Q := match i with O => [] | S j => time_at j end.
Definition lower (g : passage) (d : Q) : list (Q * bool) :=
  let '(a, b, c, e) := g in
  (0, false) :: map (fun t => (t, Nat.eqb a b)) (last_time b) ++ map (fun t => (t - d, Nat.eqb c e)) (last_time e).
Definition upper (g : passage) (d : Q) : list (Q * bool) :=
  let '(a, b, c, e) := g in
  map (fun t => (t, Nat.eqb a b)) (time_at a) ++ map (fun t => (t - d, Nat.eqb c e)) (time_at c).
Definition feasible (g : passage) (d : Q) : bool :=
  forallb (fun l : Q * bool => forallb (fun u : Q * bool =>
    if snd l || snd u then less (fst l) (fst u) else Qle_bool (fst l) (fst u)) (upper g d)) (lower g d).
Definition passages : list passage :=
  let n := length events in
  let from a := seq a (S n - a) in                   (* a to n *)
  let next a := filter (fun b => Nat.leb b n) [a; S a] in
  flat_map (fun a => flat_map (fun b => flat_map (fun c => map (fun e => (a, b, c, e)) (next c)) (from a)) (next a)) (from 0%nat).

(* Symbolic evaluation *)
Definition put_sets (s : symbolic) (v : event) : symbolic := Symbolic (sets v ++ new_truths s) (new_values s) (stale s).
Definition slice (i j : nat) : list event := skipn i (firstn j events).
Definition surely_interferes (k : knowledge) (s : symbolic) (d : result) (env : list key) (f : formula) (e : effect) (vs : list event) : bool :=
  existsb (fun l : atom * bool =>
      existsb (atom_eqb (fst l)) (atoms_read P env f ++ atoms_read_by_effect P env e) ||
      match symbolic_changes extended T N k s d env e with
      | Some ss => is_present (assoc (fst l) (atoms_set_to ss (negb (snd l)))) | None => false end)
    (flat_map sets vs).
Fixpoint symbolic_pass (k : knowledge) (s : symbolic) (d : result) (env : list key) (f : formula) (vs : list event) : option symbolic :=
  match vs with
  | [] => Some s
  | v :: r => match symbolic_truth extended T N k s d env f with
              | Some false => None | _ => symbolic_pass k (put_sets s v) d env f r end
  end.
Definition symbolic_timed_step (k : knowledge) (a : action) (env : list key) (g : passage) (d : result) (q : Q) : outcome :=
  let '(i, j, m, n) := g in
  let happens s time f e := symbolic_happening extended T N k s d time env f e in
  match duration a with
  | None => if surely_interferes k unchanged d env (at_start a) (start_effect a) (slice i j) then Never
            else happens unchanged 0 (at_start a) (start_effect a)
  | Some _ =>
      if Qeq_bool q 0 then
        let f := And (at_start a) (at_end a) in let e := Both (start_effect a) (end_effect a) in
        if surely_interferes k unchanged d env f e (slice i j) then Never else happens unchanged q f e
      else if surely_interferes k unchanged d env (at_start a) (start_effect a) (slice i j) then Never
      else match happens unchanged q (at_start a) (start_effect a) with
           | After s _ =>
               match symbolic_pass k s d env (over_all a) (slice j m) with
               | None => Never
               | Some s =>
                   if surely_interferes k s d env (at_end a) (end_effect a) (slice m n) then Never
                   else match happens s q (And (over_all a) (at_end a)) (end_effect a) with
                        | After s t => After (fold_left put_sets (slice m n) s) t | r => r end
               end
           | r => r
           end
  end.

(* The clock after an operator, and whether it represents every end in a range. *)
Definition new_clock (o : option (operator * choice)) : option form :=
  match find_atom (number_of N) (clock X), o with
  | Some n, Some (o, ch) => match List.find (fun c => Pos.eqb (fst c) n) (number_effects o) with
                            | Some c => form_of N (snd c) (slot_sizes o) ch | None => Some (fluent (clock X)) end
  | _, _ => Some (fluent (clock X))
  end.
Definition clock_ok (g : form) (starts : list (Q * bool)) (d : Q) : bool :=
  match g with
  | ([(a, q)], c) => atom_eqb a (clock X) && Qeq_bool q 1 && (Qeq_bool c d || Qeq_bool c 0)
  | ([], c) => existsb (fun l : Q * bool => Qle_bool c (fst l + d) || snd l && on_grid (fst l + d) && less c (fst l + d + moment)) starts
  | _ => false
  end.
Definition closes (k : knowledge) (s : symbolic) (t : Q) (marks : list (atom * bool)) (starts : list (Q * bool)) (d : Q)
    (o : option (operator * choice)) : bool :=
  match new_clock o with
  | None => false
  | Some g =>
      let s := Symbolic (marks ++ new_truths s) ((clock X, g) :: new_values s) (stale s) in
      clock_ok g starts d &&
      forallb (fun l => match assoc (fst l) (new_truths s) with Some true => mem (may_hold N) (fst l) | _ => true end) (new_truths s) &&
      forallb (stays_exclusive extended T N k s) (exclusive N) && forallb (stays_invariant k s) (invariants N) &&
      simulated extended T N k s t o
  end.
Definition with_operator (leaf : option (operator * choice) -> bool) (o : option (nat * choice)) : bool :=
  match o with
  | None => leaf None
  | Some (i, ch) => match nth_error (operators T) i with Some o => leaf (Some (o, ch)) | None => false end
  end.
Definition timed_leaf (a : action) (env : list key) (g : passage) (d : result) (q : Q) (k : knowledge) (o : option (nat * choice)) : bool :=
  match symbolic_timed_step k a env g d q with
  | Never => true
  | Unclear => false
  | After s t => let '(_, from, _, until) := g in
      with_operator (closes k s t [(phase until, true); (phase from, false); (waited X, false)] (lower g q) q) o
  end.
Definition wait_leaf (i : nat) (v : event) (k : knowledge) (o : option (nat * choice)) : bool :=
  with_operator (closes k (put_sets unchanged v) 0 [(phase (S i), true); (phase i, false); (waited X, true)] [(time v, false)] 0) o.

Definition start_knowledge (a : action) (env : list key) (g : passage) (d : result) (q : Q) : knowledge :=
  let k := conjuncts extended N unchanged d env (at_start a) in
  let '(_, from, _, _) := g in
  with_invariants N (Knowledge ((phase from, true) :: literals k)
    (map (fun u : Q * bool => (snd u, ([(clock X, -1 # 1)], fst u))) (upper g q) ++ bounds k)).
(* The duration of an instance in every state: none if it is undefined. *)
Definition fixed_duration (a : action) (env : list key) : option (option (result * Q)) :=
  match duration a with
  | None => Some (Some (Undefined, 0))
  | Some e => match symbolic_expression extended N unchanged Undefined env e with
              | Undefined => Some None
              | Is ([], q) => Some (Some (Is (constant q), q))
              | _ => None end
  end.
Definition timed_instance_ok (i : nat) (a : action) (env : list key) : bool :=
  match fixed_duration a env with
  | None => false
  | Some None => true
  | Some (Some (d, q)) => less q 0 || on_grid q &&
      forallb (fun g => negb (feasible g q) || tree_ok extended T N (timed_leaf a env g d q) (start_knowledge a env g d q) (case i env g)) passages
  end.
Definition timed_action_ok (i : nat) (a : action) : bool :=
  action_free a && forallb (changing N) (effect_heads (start_effect a) ++ effect_heads (end_effect a)) &&
  forallb (timed_instance_ok i a) (instances extended (fun env => static_false extended N env (at_start a)) (parameters a) []).
Definition wait_ok (i : nat) (v : event) : bool :=
  tree_ok extended T N (wait_leaf i v) (with_invariants N (Knowledge [(phase i, true)] [])) (wait_case i).
Fixpoint is_sorted (vs : list event) : bool :=
  match vs with [] => true | v :: r => forallb (fun u => less (time v) (time u)) r && is_sorted r end.
Fixpoint differ (l : list atom) : bool :=
  match l with [] => true | a :: r => negb (existsb (atom_eqb a) r) && differ r end.
Definition timed_faithful : bool :=
  match strata P with [] => true | _ => false end && Qeq_bool (per_step P) 0 &&
  faithful extended T N (fun _ _ => Decided None) goal_case &&
  is_sorted events && forallb (fun v => on_grid (time v)) events &&
  forallb (fun l : atom * bool => changing N (fst (fst l)) && negb (is_added (fst (fst l)))) (flat_map sets events) &&
  forallb (changing N) (fst (waited X) :: fst (clock X) :: map fst (phase_atoms X)) &&
  differ (waited X :: phase_atoms X) && Nat.eqb (length (phase_atoms X)) (S (length events)) &&
  forallb (fun a => negb (holds_in (initial P) a)) (waited X :: phase_atoms X) &&
  formula_free (goal_formula P) && expression_free (metric P) &&
  forallb (fun iv => wait_ok (fst iv) (snd iv)) (combine (seq 0 (length events)) events) &&
  forallb (fun ia => timed_action_ok (fst ia) (snd ia)) (combine (seq 0 (length (actions P))) (actions P)).
End Check.

(* The whole check *)
Definition check_timed (P : problem) (events : list event) (T : task) (N : names) (X : timeline)
    (case : nat -> list key -> passage -> case_tree) (wait_case : nat -> case_tree) (goal_case : case_tree)
    (A : argument) (oracle : state -> list positive) (plan : list (Q * (nat * list key))) (claim : option Q) : bool :=
  check_task T && timed_faithful P events T N X case wait_case goal_case &&
  match eval (initial P) None [] (metric P), claim with
  | _, None => check T A None oracle
  | Some first, Some m =>
      is_linear (extended P events X) N && match timed_execute P events false (initial P) 0 0 plan with
      | Some (w, spent) => match final_metric P w spent with Some m' => Qeq_bool m' m | None => false end
      | None => false
      end &&
      let cost := Qred ((m - first) * (Zpos (cost_scale N) # 1)) in
      Pos.eqb (Qden cost) 1 && check T A (Some (Qnum cost)) oracle
  | None, Some _ => false
  end.
