(* Compares a ground task with PDDL: every instance of an action is simulated by an operator that
   requires no more, has the same effects, and costs no more. Instances are evaluated symbolically;
   case trees, which need no trust, name the operators. *)
From Coq Require Import ZArith QArith List Bool FMapPositive.
From Proved Require Import Task Check Lifted.
Import ListNotations.
Open Scope Q_scope.

(* Linear forms over the fluents of the state before a step. *)
Definition form := (list (atom * Q) * Q)%type.
Fixpoint plus_term (f : atom) (q : Q) (l : list (atom * Q)) : list (atom * Q) :=
  match l with
  | [] => [(f, q)]
  | (g, y) :: r => if atom_eqb f g then (let s := Qred (y + q) in if Qeq_bool s 0 then r else (g, s) :: r) else (g, y) :: plus_term f q r
  end.
Definition plus_form (a : form) (c : Q) (b : form) : form :=
  (fold_left (fun l t => plus_term (fst t) (c * snd t) l) (fst b) (fst a), Qred (snd a + c * snd b)).
Definition constant (q : Q) : form := ([], q).
Definition fluent (f : atom) : form := ([(f, 1)], 0).
Definition default (o : option Q) : Q := match o with Some q => q | None => 0 end.
Definition ev (w : world) (f : form) : Q := fold_right (fun t s =>
  default (value_in w (fst t)) * snd t + s) (snd f) (fst f).
Inductive result := Undefined | Unknown | Is (f : form).
Definition plus_result (a : result) (c : Q) (b : result) : result :=
  match a, b with
  | Undefined, _ => Undefined | _, Undefined => Undefined
  | Is x, Is y => Is (plus_form x c y) | _, _ => Unknown
  end.

(* Relation between a task and PDDL; need not be believed. *)
Record names := Names {
  variables : M.t (list (Z * atom));               (* values of a variable, with their atoms *)
  fluents : M.t atom;                              (* fluent of each number *)
  fact_of : atom_map (key * Z); number_of : atom_map key;
  changing : key -> bool;                          (* predicates and functions that actions change *)
  may_hold : atom_map unit;                        (* atoms of changing predicates that may hold in some state *)
  derived_atoms : M.t (Z * Z * atom);              (* derived variables: value with the atom, value without it *)
  derived_of : atom_map (key * Z);
  equivalent : bool;                               (* a derived variable has its value only if the atom holds *)
  invariants : list (bool * form);                 (* forms that are > 0 if strict, else >= 0, in all states *)
  exclusive : list (list atom);                    (* groups of atoms of which at most one holds *)
  scale : positive;                                (* number = fluent times scale *)
  cost_scale : positive }.
Inductive case_tree :=
  | Decided (o : option (nat * choice))             (* simulated by an operator with a choice, or by no operator *)
  | Impossible
  | SplitAtom (a : atom) (t u : case_tree)            (* the atom holds; it does not hold *)
  | SplitForm (f : form) (t u : case_tree).           (* the form is at least 0; it is negative *)

Definition mem {X} (m : atom_map X) (a : atom) : bool := match find_atom m a with Some _ => true | None => false end.

Section Faithful.
Variables (P : problem) (T : task) (N : names).

(* Knowledge of the state before a step. *)
Record knowledge := Knowledge { literals : list (atom * bool); bounds : list (bool * form) }. (* form > 0 if strict, else >= 0 *)
Definition in_variable (k : knowledge) (v : key) : list (Z * bool) :=
  flat_map (fun l => match find_atom (fact_of N) (fst l) with
                     | Some (u, x) => if Pos.eqb u v then [(x, snd l)] else [] | None => [] end) (literals k).
Definition in_group (a : atom) (g : list atom) : bool := existsb (atom_eqb a) g.
(* Returns [true] if another atom of a group of [a] holds. *)
Definition excluded_by (k : knowledge) (a : atom) : bool :=
  existsb (fun g => in_group a g &&
    existsb (fun l => snd l && negb (atom_eqb (fst l) a) && in_group (fst l) g) (literals k)) (exclusive N).
(* The values that a variable may have. *)
Definition possible (k : knowledge) (v : key) : list Z :=
  let known := in_variable k v in
  let atoms := match M.find v (variables N) with Some vals => vals | None => [] end in
  filter (fun y => forallb (fun xb => Bool.eqb (Z.eqb y (fst xb)) (snd xb)) known &&
                   negb (existsb (fun xa => Z.eqb y (fst xa) && excluded_by k (snd xa)) atoms))
         (match List.find snd known with Some (x, _) => [x] | None => range (get (domain_size T) v) end).
(* [full p]: a derived variable has its value only if the atom, of predicate p, holds. *)
Definition known_fact (full : key -> bool) (k : knowledge) (v : key) (x : Z) : option bool :=
  match M.find v (variables N) with
  | None => match M.find v (derived_atoms N) with
            | Some (y, d, a) => match assoc a (literals k) with
                                | Some true => Some (Z.eqb x y)
                                | Some false => if full (fst a) then Some (Z.eqb x d) else None
                                | None => None end
            | None => None end
  | Some _ => let ys := possible k v in
      if forallb (Z.eqb x) ys then Some true else if forallb (fun y => negb (Z.eqb x y)) ys then Some false else None
  end.
Definition base_truth (k : knowledge) (a : atom) : option bool :=
  if negb (changing N (fst a)) then Some (holds_in (initial P) a)
  else match assoc a (literals k) with
       | Some b => Some b
       | None => if excluded_by k a || negb (mem (may_hold N) a) then Some false
                 else match find_atom (fact_of N) a with Some (v, x) => known_fact (fun _ => false) k v x | None => None end
       end.
(* A state in terms of the one before the step: atoms and fluents that have changed. If it is stale,
   derived atoms may have changed, too. *)
Record symbolic := Symbolic { new_truths : list (atom * bool); new_values : list (atom * form); stale : bool }.
Definition unchanged := Symbolic [] [] false.
Definition make_stale (s : symbolic) := Symbolic (new_truths s) (new_values s) true.
Definition is_stale (s : symbolic) (p : key) : bool := stale s && is_derived P p.
Definition symbolic_atom (k : knowledge) (s : symbolic) (a : atom) : option bool :=
  if is_stale s (fst a) then None
  else match assoc a (new_truths s) with Some b => Some b | None => base_truth k a end.
Definition symbolic_value (s : symbolic) (f : atom) : result :=
  match assoc f (new_values s) with
  | Some g => Is g
  | None => if changing N (fst f) then Is (fluent f)
            else match value_in (initial P) f with Some q => Is (constant q) | None => Undefined end
  end.
Fixpoint symbolic_expression (s : symbolic) (d : result) (env : list key) (e : expression) : result :=
  match e with
  | Constant q => Is (constant q)
  | Fluent f ts => match ground env ts with Some l => symbolic_value s (f, l) | None => Undefined end
  | Duration => d
  | Plus a b => plus_result (symbolic_expression s d env a) 1 (symbolic_expression s d env b)
  | Minus a b => plus_result (symbolic_expression s d env a) (-1 # 1) (symbolic_expression s d env b)
  | Times a b => match symbolic_expression s d env a, symbolic_expression s d env b with
                 | Undefined, _ => Undefined | _, Undefined => Undefined
                 | Is ([], x), Is y => Is (plus_form (constant 0) x y)
                 | Is x, Is ([], y) => Is (plus_form (constant 0) y x)
                 | _, _ => Unknown end
  | Over a b => match symbolic_expression s d env a, symbolic_expression s d env b with
                | Undefined, _ => Undefined | _, Undefined => Undefined
                | Is x, Is ([], y) => if Qeq_bool y 0 then Undefined else Is (plus_form (constant 0) (/ y) x)
                | _, _ => Unknown end
  end.
Definition implied (k : knowledge) (strict : bool) (f : form) : bool :=
  existsb (fun b => match plus_form f (-1 # 1) (snd b) with
                    | ([], c) => if strict && negb (fst b) then less 0 c else Qle_bool 0 c
                    | _ => false end) ((false, constant 0) :: bounds k)
  || match f with ([], c) => strict && less 0 c | _ => false end.
Definition symbolic_comparison (k : knowledge) (strict : bool) (r : result) : option bool :=
  match r with
  | Undefined => Some false
  | Unknown => None
  | Is f => if implied k strict f then Some true
            else if implied k (negb strict) (plus_form (constant 0) (-1 # 1) f) then Some false else None
  end.
(* Kleene's conjunction over a list, which ends at the first element that is false. *)
Definition all_kleene {X} (t : X -> option bool) : list X -> option bool :=
  fix all l := match l with
               | [] => Some true
               | x :: r => match t x with Some false => Some false | b => and_kleene b (all r) end
               end.
(* [Some b] means that the condition does not have the other truth value; it may be undefined. *)
Fixpoint symbolic_truth (k : knowledge) (s : symbolic) (d : result) (env : list key) (f : formula) : option bool :=
  match f with
  | Truth b => Some b
  | Atom p ts => match ground env ts with Some l => symbolic_atom k s (p, l) | None => Some false end
  | Same t u => match object_of env t, object_of env u with Some a, Some b => Some (Pos.eqb a b) | _, _ => Some false end
  | Compare strict a b => symbolic_comparison k strict (symbolic_expression s d env (Minus a b))
  | Not g => option_map negb (symbolic_truth k s d env g)
  | And g h => match symbolic_truth k s d env g with
               | Some false => Some false
               | x => and_kleene x (symbolic_truth k s d env h) end
  | Forall t g => all_kleene (fun o => symbolic_truth k s d (env ++ [o]) g) (objects P t)
  end.
Inductive symbolic_change := SFact (a : atom) (holds : bool) | SNumber (a : atom) (assigns : bool) (f : form).
Fixpoint symbolic_changes (k : knowledge) (s : symbolic) (d : result) (env : list key) (e : effect) : option (list symbolic_change) :=
  match e with
  | Nothing => Some []
  | Put b p ts => match ground env ts with Some l => Some [SFact (p, l) b] | None => None end
  | Change assigns f ts x => match ground env ts, symbolic_expression s d env x with
                             | Some l, Is g => Some [SNumber (f, l) assigns g] | _, _ => None end
  | Both a b => both (symbolic_changes k s d env a) (symbolic_changes k s d env b)
  | When f a => match symbolic_truth k s d env f with
                | Some true => symbolic_changes k s d env a | Some false => Some [] | None => None end
  | Each t a => fold_right (fun o r => both (symbolic_changes k s d (env ++ [o]) a) r) (Some []) (objects P t)
  end.
Definition symbolic_changes_of (f : atom) (cs : list symbolic_change) : list (bool * form) :=
  flat_map (fun c => match c with SNumber f' b g => if atom_eqb f f' then [(b, g)] else [] | _ => [] end) cs.
Definition symbolic_new_value (old : result) (l : list (bool * form)) : option form :=
  match l with
  | [(true, g)] => Some g
  | (false, _) :: _ => match existsb fst l, old with
                       | false, Is x => Some (fold_left (fun s c => plus_form s 1 (snd c)) l x) | _, _ => None end
  | _ => None
  end.
Fixpoint symbolic_changed_fluents (cs : list symbolic_change) : list atom :=
  match cs with [] => [] | SNumber f _ _ :: r => f :: symbolic_changed_fluents r | SFact _ _ :: r => symbolic_changed_fluents r end.
Fixpoint symbolic_updates (s : symbolic) (cs : list symbolic_change) (fs : list atom) : option (list (atom * form)) :=
  match fs with
  | [] => Some []
  | f :: r => match symbolic_new_value (symbolic_value s f) (symbolic_changes_of f cs), symbolic_updates s cs r with
              | Some g, Some l => Some ((f, g) :: l) | _, _ => None end
  end.
Definition atoms_set_to (cs : list symbolic_change) (b : bool) : list (atom * bool) :=
  flat_map (fun c => match c with SFact a b' => if Bool.eqb b b' then [(a, b)] else [] | _ => [] end) cs.
Inductive outcome := Never | Unclear | After (s : symbolic) (time : Q).
(* Returns [true] if the effect needs an undefined value, so that the action cannot be executed. *)
Fixpoint needs_undefined (k : knowledge) (s : symbolic) (d : result) (env : list key) (e : effect) : bool :=
  match e with
  | Nothing | Put _ _ _ => false
  | Change _ _ _ x => match symbolic_expression s d env x with Undefined => true | _ => false end
  | Both a b => needs_undefined k s d env a || needs_undefined k s d env b
  | When f a => match symbolic_truth k s d env f with Some true => needs_undefined k s d env a | _ => false end
  | Each t a => existsb (fun o => needs_undefined k s d (env ++ [o]) a) (objects P t)
  end.
Definition symbolic_happening (k : knowledge) (s : symbolic) (d : result) (time : Q) (env : list key) (f : formula) (e : effect) : outcome :=
  match symbolic_truth k s d env f with
  | Some false => Never
  | _ => if needs_undefined k s d env e then Never else
         match symbolic_changes k s d env e with
         | None => Unclear
         | Some cs => match symbolic_updates s cs (symbolic_changed_fluents cs) with
                      | None => Unclear
                      | Some l => After (Symbolic (atoms_set_to cs true ++ atoms_set_to cs false ++ new_truths s) (l ++ new_values s) (stale s)) time
                      end
         end
  end.
(* The part of the changes of an instantaneous action that concerns some atoms, or the numbers.
   Effects under unknown conditions are left out if they have no such part. *)
Fixpoint projected (keep : atom -> bool) (with_numbers : bool) (k : knowledge) (env : list key) (e : effect)
    : option (list symbolic_change) :=
  match e with
  | Nothing => Some []
  | Put b p ts => match ground env ts with
                  | Some l => Some (if keep (p, l) then [SFact (p, l) b] else []) | None => None end
  | Change assigns f ts x =>
      if with_numbers then match ground env ts, symbolic_expression unchanged Undefined env x with
                           | Some l, Is g => Some [SNumber (f, l) assigns g] | _, _ => None end
      else Some []
  | Both a b => both (projected keep with_numbers k env a) (projected keep with_numbers k env b)
  | When f a => match projected keep with_numbers k env a with
                | Some [] => Some []               (* whether the condition holds does not matter *)
                | r => match symbolic_truth k unchanged Undefined env f with
                       | Some true => r | Some false => Some [] | None => None end
                end
  | Each t a => fold_right (fun o r => both (projected keep with_numbers k (env ++ [o]) a) r) (Some []) (objects P t)
  end.
(* The atoms on which unknown conditions of the kept effects depend. *)
Fixpoint atoms_of (env : list key) (f : formula) : list atom :=
  match f with
  | Atom p ts => match ground env ts with Some l => [(p, l)] | None => [] end
  | Not g => atoms_of env g
  | And g h => atoms_of env g ++ atoms_of env h
  | Forall t g => flat_map (fun o => atoms_of (env ++ [o]) g) (objects P t)
  | _ => []
  end.
Fixpoint deciding_atoms (keep : atom -> bool) (k : knowledge) (env : list key) (e : effect) : list atom :=
  match e with
  | Both a b => deciding_atoms keep k env a ++ deciding_atoms keep k env b
  | When f a => match projected keep false k env a with
                | Some [] => []
                | _ => match symbolic_truth k unchanged Undefined env f with
                       | Some _ => deciding_atoms keep k env a
                       | None => atoms_of env f ++ deciding_atoms keep k env a end
                end
  | Each t a => flat_map (fun o => deciding_atoms keep k (env ++ [o]) a) (objects P t)
  | _ => []
  end.
(* The atoms that an instantaneous action may add or delete. *)
Fixpoint possible_facts (k : knowledge) (env : list key) (e : effect) : option (list (atom * bool)) :=
  match e with
  | Nothing | Change _ _ _ _ => Some []
  | Put b p ts => match ground env ts with Some l => Some [((p, l), b)] | None => None end
  | Both a b => both (possible_facts k env a) (possible_facts k env b)
  | When f a => match symbolic_truth k unchanged Undefined env f with
                | Some false => Some [] | _ => possible_facts k env a end
  | Each t a => fold_right (fun o r => both (possible_facts k (env ++ [o]) a) r) (Some []) (objects P t)
  end.
Definition symbolic_duration (a : action) (env : list key) : result :=
  match duration a with Some e => symbolic_expression unchanged Undefined env e | None => Undefined end.
Definition symbolic_step (k : knowledge) (a : action) (env : list key) : outcome :=
  match duration a, symbolic_duration a env with
  | None, _ => symbolic_happening k unchanged Undefined 0 env (at_start a) (start_effect a)
  | Some _, Undefined => Never
  | Some _, Is ([], d) =>
      if less d 0 then Never
      else if Qeq_bool d 0 then
        symbolic_happening k unchanged (Is (constant d)) d env (And (at_start a) (at_end a)) (Both (start_effect a) (end_effect a))
      else match symbolic_happening k unchanged (Is (constant d)) d env (at_start a) (start_effect a) with
           | After s _ => symbolic_happening k (make_stale s) (Is (constant d)) d env (And (over_all a) (at_end a)) (end_effect a)
           | r => r
           end
  | Some _, _ => Unclear
  end.
(* Knowledge from a condition that holds. *)
Fixpoint conjuncts (s : symbolic) (d : result) (env : list key) (f : formula) : knowledge :=
  match f with
  | And g h => let a := conjuncts s d env g in let b := conjuncts s d env h in
               Knowledge (literals a ++ literals b) (bounds a ++ bounds b)
  | Atom p ts => match ground env ts with
                 | Some l => match assoc (p, l) (new_truths s) with
                             | None => if changing N p && negb (is_stale s p) then Knowledge [((p, l), true)] [] else Knowledge [] []
                             | Some _ => Knowledge [] [] end
                 | None => Knowledge [] [] end
  | Not (Atom p ts) => match ground env ts with
                 | Some l => match assoc (p, l) (new_truths s) with
                             | None => if changing N p && negb (is_stale s p) then Knowledge [((p, l), false)] [] else Knowledge [] []
                             | Some _ => Knowledge [] [] end
                 | None => Knowledge [] [] end
  | Compare strict a b => match symbolic_expression s d env (Minus a b) with Is g => Knowledge [] [(strict, g)] | _ => Knowledge [] [] end
  | _ => Knowledge [] []
  end.
Definition with_invariants (k : knowledge) := Knowledge (literals k) (invariants N ++ bounds k).
Definition join (k l : knowledge) := Knowledge (literals k ++ literals l) (bounds k ++ bounds l).
Definition gathered (a : action) (env : list key) : knowledge :=
  match duration a, symbolic_duration a env with
  | None, _ => conjuncts unchanged Undefined env (at_start a)
  | Some _, Is ([], d) =>
      let time := Is (constant d) in
      let k := conjuncts unchanged time env (at_start a) in
      if Qeq_bool d 0 then join k (conjuncts unchanged time env (at_end a))
      else match symbolic_happening k unchanged time d env (at_start a) (start_effect a) with
           | After s _ => join k (conjuncts (make_stale s) time env (And (over_all a) (at_end a)))
           | _ => k
           end
  | _, _ => Knowledge [] []
  end.
Definition impossible (k : knowledge) : bool :=
  existsb (fun l => match base_truth (Knowledge [] (bounds k)) (fst l) with Some b => negb (Bool.eqb b (snd l)) | None => false end
                    || snd l && excluded_by k (fst l)
                    || match find_atom (fact_of N) (fst l) with
                       | Some (v, _) => match possible k v with [] => true | _ => false end
                       | None => false end) (literals k)
  || existsb (fun b : bool * form => implied k (negb (fst b)) (plus_form (constant 0) (-1 # 1) (snd b))) (bounds k).

(* Rules of derived predicates: an atom that holds has an instance whose body holds, and an atom
   that does not hold has none. *)
Fixpoint is_defined (env : list key) (f : formula) : bool :=
  match f with
  | Truth _ => true
  | Atom _ ts => match ground env ts with Some _ => true | None => false end
  | Same t u => match object_of env t, object_of env u with Some _, Some _ => true | _, _ => false end
  | Compare _ _ _ => false
  | Not g => is_defined env g
  | And g h => is_defined env g && is_defined env h
  | Forall t g => forallb (fun o => is_defined (env ++ [o]) g) (objects P t)
  end.
Definition is_rule_of (a : atom) (r : rule) : bool :=
  Pos.eqb (fst a) (head r) && Nat.eqb (length (snd a)) (length (head_types r)) &&
  forallb (fun x => existsb (Pos.eqb (fst x)) (objects P (snd x))) (combine (snd a) (head_types r)).
Definition rules_of (a : atom) : list rule := filter (is_rule_of a) (concat (strata P)).
Definition contradicts_rules (k : knowledge) : bool :=
  existsb (fun l : atom * bool =>
    let '(a, holds) := l in
    is_derived P (fst a) &&
    let body_truth r := symbolic_truth k unchanged Undefined (snd a) (body r) in
    if holds then forallb (fun r => match body_truth r with Some false => true | _ => false end) (rules_of a)
    else existsb (fun r => match body_truth r with Some true => is_defined (snd a) (body r) | _ => false end) (rules_of a))
    (literals k).
Definition contradictory (k : knowledge) : bool := impossible k || contradicts_rules k.
(* [next] accepts the knowledge of every way in which a formula is true (false, if [b] is); [after]
   adds to it what follows from an atom. *)
Definition continuation := knowledge -> bool.
Fixpoint expand (after : atom -> bool -> continuation -> continuation) (f : formula) (b : bool) (env : list key)
    (next : continuation) (k : knowledge) : bool :=
  match f with
  | Truth c => if Bool.eqb b c then next k else true
  | Atom p ts =>
      match ground env ts with
      | None => true
      | Some l => match base_truth k (p, l) with
                  | Some c => if Bool.eqb b c then next k else true
                  | None => after (p, l) b next (Knowledge (((p, l), b) :: literals k) (bounds k)) end
      end
  | Same t u => match object_of env t, object_of env u with
                | Some x, Some y => if Bool.eqb b (Pos.eqb x y) then next k else true | _, _ => true end
  | Compare _ _ _ => next (if b then join k (conjuncts unchanged Undefined env f) else k)
  | Not g => expand after g (negb b) env next k
  | And g h => if b then expand after g true env (expand after h true env next) k
               else expand after g false env next k && expand after h false env next k
  | Forall t g => if b then fold_right (fun o next => expand after g true (env ++ [o]) next) next (objects P t) k
                  else forallb (fun o => expand after g false (env ++ [o]) next k) (objects P t)
  end.
Definition is_unfolded (a : atom) : bool :=
  is_derived P (fst a) && match find_atom (derived_of N) a with None => true | Some _ => false end.
Definition is_head (p : key) (rules : list rule) : bool := existsb (fun r => Pos.eqb p (head r)) rules.
(* The last stratum with a rule of the predicate, counted from 1; 0 if there is none. *)
Fixpoint level (ls : list (list rule)) (p : key) : nat :=
  match ls with
  | [] => 0
  | rules :: later => match level later p with O => if is_head p rules then 1 else 0 | S n => S (S n) end
  end%nat.
(* A derived atom without a variable holds by one of its rules. If it does not hold, none of its rules
   applies, for atoms up to stratum [limit]. *)
Fixpoint unfold (depth limit : nat) (a : atom) (b : bool) (next : continuation) (k : knowledge) : bool :=
  match depth with
  | O => next k
  | S depth =>
      if negb (is_unfolded a) then next k
      else if b then forallb (fun r => expand (unfold depth limit) (body r) true (snd a) next k) (rules_of a)
      else if Nat.leb (level (strata P) (fst a)) limit then
        fold_right (fun r next => if is_defined (snd a) (body r)
                                  then expand (unfold depth limit) (body r) false (snd a) next else next) next (rules_of a) k
      else next k
  end.
(* The truth value of a formula that is certainly defined. Of derived atoms, only those up to stratum
   [limit] are unfolded. *)
Fixpoint definite (look : atom -> option bool) (env : list key) (f : formula) : option bool :=
  match f with
  | Truth b => Some b
  | Atom p ts => match ground env ts with Some l => look (p, l) | None => None end
  | Same t u => match object_of env t, object_of env u with Some a, Some b => Some (Pos.eqb a b) | _, _ => None end
  | Compare _ _ _ => None
  | Not g => option_map negb (definite look env g)
  | And g h => match definite look env g with
               | Some false => Some false
               | x => and_kleene x (definite look env h) end
  | Forall t g => all_kleene (fun o => definite look (env ++ [o]) g) (objects P t)
  end.
Definition is_some (b : bool) (t : option bool) : bool := match t with Some c => Bool.eqb b c | None => false end.
Fixpoint look_up (depth limit : nat) (k : knowledge) (a : atom) : option bool :=
  match base_truth k a, depth with
  | Some b, _ => Some b
  | None, O => None
  | None, S depth =>
      if is_unfolded a && Nat.leb (level (strata P) (fst a)) limit then
        let truths := map (fun r => definite (look_up depth limit k) (snd a) (body r)) (rules_of a) in
        if existsb (is_some true) truths then Some true else if forallb (is_some false) truths then Some false else None
      else None
  end.
Definition max_unfoldings := 8%nat.
(* Every occurrence of a predicate, with its polarity, is allowed. *)
Fixpoint occurrences_ok (allowed : key -> bool -> bool) (b : bool) (f : formula) : bool :=
  match f with
  | Atom p _ => allowed p b
  | Not g => occurrences_ok allowed (negb b) g
  | And g h => occurrences_ok allowed b g && occurrences_ok allowed b h
  | Forall _ g => occurrences_ok allowed b g
  | _ => true
  end.
Definition is_allowed (rules : list rule) (later : list (list rule)) (p : key) (b : bool) : bool :=
  negb (existsb (is_head p) later) && (b || negb (is_head p rules)).
Fixpoint is_stratified (strata : list (list rule)) : bool :=
  match strata with
  | [] => true
  | rules :: later => forallb (fun r => occurrences_ok (is_allowed rules later) true (body r)) rules && is_stratified later
  end.

(* Comparisons of the task as forms times the scale. *)
Definition scaled := Zpos (scale N) # 1.
Fixpoint factors_of (l : list (key * Z)) : option form :=
  match l with
  | [] => Some (constant 0)
  | (n, f) :: r => match M.find n (fluents N), factors_of r with
                   | Some a, Some g => Some (plus_form g 1 ([(a, inject_Z f)], 0)) | _, _ => None end
  end.
Definition form_of (l : linear) (szs : list Z) (ch : choice) : option form :=
  match factors_of (factors l) with
  | Some g => Some (plus_form g 1 (constant (inject_Z (amount (offset l) szs ch) / scaled)))
  | None => None
  end.
(* The form times the scale is an integer, so more than -1 is enough. *)
Definition required (k : knowledge) (f : form) : bool :=
  implied k true (plus_form f 1 (constant (/ scaled))).
Definition known_literal (full : key -> bool) (k : knowledge) (l : literal) : option bool :=
  option_map (fun b => Bool.eqb b (snd l)) (known_fact full k (fst (fst l)) (snd (fst l))).
Definition is_true (r : option bool) : bool := match r with Some b => b | None => false end.
Definition is_false (r : option bool) : bool := match r with Some b => negb b | None => false end.
Definition known_condition (full : key -> bool) (k : knowledge) (c : condition) (szs : list Z) (ch : choice) : bool :=
  forallb (fun f => is_true (known_fact full k (fst f) (snd f))) (facts c) &&
  forallb (existsb (fun l => is_true (known_literal full k l))) (clauses c) &&
  forallb (fun l => match form_of l szs ch with Some f => required k f | None => false end) (comparisons c).
Fixpoint known_effects (k : knowledge) (cs : list (list literal * list fact)) : option (list fact) :=
  match cs with
  | [] => Some []
  | c :: r => if existsb (fun l => is_false (known_literal (fun _ => equivalent N) k l)) (fst c) then known_effects k r
              else if forallb (fun l => is_true (known_literal (fun _ => equivalent N) k l)) (fst c) then option_map (app (snd c)) (known_effects k r)
              else None
  end.
Definition admitted_choice (o : operator) (ch : choice) : bool :=
  Nat.eqb (length ch) (length (slot_sizes o)) &&
  forallb (fun xn : Z * Z => Z.leb 0 (fst xn) && Z.ltb (fst xn) (snd xn)) (combine ch (slot_sizes o)) && admits o ch.
(* The value of a variable after the step agrees with its atoms, if the value before the step is
   [y]. *)
Definition value_ok (truths : list (atom * bool)) (made : list fact) (v : key) (vals : list (Z * atom)) (y : Z) : bool :=
  let z := last_put made v y in
  forallb (fun xa => Bool.eqb (match assoc (snd xa) truths with Some b => b | None => Z.eqb y (fst xa) end)
                              (Z.eqb z (fst xa))) vals.
Definition variable_ok (k : knowledge) (s : symbolic) (made : list fact) (v : key) : bool :=
  match M.find v (variables N) with
  | None => true
  | Some vals => forallb (value_ok (new_truths s) made v vals) (possible k v)
  end.
Definition is_zero (f : form) : bool := match f with ([], c) => Qeq_bool c 0 | _ => false end.
Definition number_ok (s : symbolic) (o : option (operator * choice)) (n : key) : bool :=
  match M.find n (fluents N) with
  | None => true
  | Some f =>
      let after := match assoc f (new_values s) with Some g => g | None => fluent f end in
      let made := match o with
                  | Some (o, ch) => match List.find (fun c => Pos.eqb (fst c) n) (number_effects o) with
                                    | Some c => form_of (snd c) (slot_sizes o) ch | None => Some (fluent f) end
                  | None => Some (fluent f) end in
      match made with Some g => is_zero (plus_form after (-1 # 1) g) | None => false end
  end.
Definition growth (s : symbolic) (time : Q) : option Q :=
  match plus_result (symbolic_expression s Undefined [] (metric P)) (-1 # 1) (symbolic_expression unchanged Undefined [] (metric P)) with
  | Is ([], c) => Some (c + per_time P * time + per_step P)
  | _ => None
  end.
Definition step_cost (o : option (operator * choice)) : Z :=
  match o with Some (o, ch) => amount (cost o) (slot_sizes o) ch | None => 0 end.
Definition simulated (k : knowledge) (s : symbolic) (time : Q) (o : option (operator * choice)) : bool :=
  match match o with
        | Some (o, ch) => if admitted_choice o ch && known_condition (fun _ => equivalent N) k (precondition o) (slot_sizes o) ch && distinct (map fst (number_effects o))
                          then option_map (app (effects o)) (known_effects k (conditional o)) else None
        | None => Some [] end with
  | None => false
  | Some made =>
      forallb (variable_ok k s made)
        (map fst made ++ flat_map (fun l => match find_atom (fact_of N) (fst l) with Some f => [fst f] | None => [] end) (new_truths s)) &&
      forallb (number_ok s o)
        (match o with Some (o, _) => map fst (number_effects o) | None => [] end
         ++ flat_map (fun l => match find_atom (number_of N) (fst l) with Some n => [n] | None => [] end) (new_values s)) &&
      match growth s time with
      | Some g => Qle_bool (inject_Z (step_cost o)) (g * (Zpos (cost_scale N) # 1))
      | None => false
      end
  end.
(* A form over the state after the step, as a form over the state before it. *)
Definition form_after (s : symbolic) (f : form) : form :=
  fold_right (fun t g => plus_form g (snd t) (match assoc (fst t) (new_values s) with Some h => h | None => fluent (fst t) end))
    (constant (snd f)) (fst f).
Definition stays_invariant (k : knowledge) (s : symbolic) (i : bool * form) : bool :=
  forallb (fun t => match assoc (fst t) (new_values s) with None => true | Some _ => false end) (fst (snd i))
  || implied k (fst i) (form_after s (snd i)).
(* At most one atom of a group holds after the step. *)
Definition stays_exclusive (k : knowledge) (s : symbolic) (g : list atom) : bool :=
  forallb (fun a => match assoc a (new_truths s) with
                    | Some true => forallb (fun b => atom_eqb a b || is_false (symbolic_atom k s b)) g
                    | _ => true end) g.
(* The check of an instantaneous action whose effects have unknown conditions: for each variable,
   each group and the numbers by itself, only the effects that concern it have to be known. *)
Definition with_value (k : knowledge) (vals : list (Z * atom)) (y : Z) : knowledge :=
  Knowledge (map (fun xa => (snd xa, Z.eqb y (fst xa))) vals ++ literals k) (bounds k).
Fixpoint known_effects_on (v : key) (k : knowledge) (cs : list (list literal * list fact)) : option (list fact) :=
  match cs with
  | [] => Some []
  | c :: r => if forallb (fun f => negb (Pos.eqb (fst f) v)) (snd c) then known_effects_on v k r
              else if existsb (fun l => is_false (known_literal (fun _ => equivalent N) k l)) (fst c) then known_effects_on v k r
              else if forallb (fun l => is_true (known_literal (fun _ => equivalent N) k l)) (fst c)
                   then option_map (app (snd c)) (known_effects_on v k r)
              else None
  end.
(* Splits on atoms until a check succeeds. *)
Fixpoint split_on (atoms : list atom) (check : knowledge -> bool) (k : knowledge) : bool :=
  check k || contradictory k ||
  match atoms with
  | [] => false
  | a :: r => split_on r check (Knowledge ((a, true) :: literals k) (bounds k)) &&
              split_on r check (Knowledge ((a, false) :: literals k) (bounds k))
  end.
Definition max_splits := 10%nat.
Definition truths_of (cs : list symbolic_change) := atoms_set_to cs true ++ atoms_set_to cs false.
Definition projected_variable_ok (k : knowledge) (a : action) (env : list key) (o : option (operator * choice))
    (v : key) : bool :=
  match M.find v (variables N) with
  | None => true
  | Some vals =>
      let keep := fun a => existsb (fun xa => atom_eqb a (snd xa)) vals in
      forallb (fun y =>
        let k := with_value k vals y in
        split_on (firstn max_splits (deciding_atoms keep k env (start_effect a))) (fun k =>
          match projected keep false k env (start_effect a),
                match o with
                | Some (o, _) => option_map (app (effects o)) (known_effects_on v k (conditional o))
                | None => Some [] end with
          | Some cs, Some made => value_ok (truths_of cs) made v vals y | _, _ => false end) k) (possible k v)
  end.
Definition projected_ok (k : knowledge) (a : action) (env : list key) (o : option (operator * choice)) : bool :=
  match duration a, possible_facts k env (start_effect a), projected (fun _ => false) true k env (start_effect a) with
  | None, Some touched, Some numbers =>
      forallb (fun l : atom * bool => negb (snd l) || mem (may_hold N) (fst l)) touched &&
      forallb (fun g => match projected (fun a => in_group a g) false k env (start_effect a) with
                        | Some cs => stays_exclusive k (Symbolic (truths_of cs) [] false) g | None => false end) (exclusive N) &&
      match o with
      | Some (o, ch) => admitted_choice o ch && known_condition (fun _ => equivalent N) k (precondition o) (slot_sizes o) ch
                        && distinct (map fst (number_effects o))
      | None => true end &&
      forallb (projected_variable_ok k a env o)
        (match o with Some (o, _) => map fst (effects o ++ flat_map snd (conditional o)) | None => [] end
         ++ flat_map (fun l => match find_atom (fact_of N) (fst l) with Some f => [fst f] | None => [] end) touched) &&
      match symbolic_updates unchanged numbers (symbolic_changed_fluents numbers) with
      | None => false
      | Some l =>
          let s := Symbolic [] l false in
          forallb (stays_invariant k s) (invariants N) &&
          forallb (number_ok s o)
            (match o with Some (o, _) => map fst (number_effects o) | None => [] end
             ++ flat_map (fun l => match find_atom (number_of N) (fst l) with Some n => [n] | None => [] end) l) &&
          match growth s 0 with
          | Some g => Qle_bool (inject_Z (step_cost o)) (g * (Zpos (cost_scale N) # 1))
          | None => false
          end
      end
  | _, _, _ => false
  end.
Definition leaf_ok (k : knowledge) (a : action) (env : list key) (o : option (operator * choice)) : bool :=
  match symbolic_step k a env with
  | Never => true
  | Unclear => projected_ok k a env o
  | After s time =>
      forallb (fun l => match assoc (fst l) (new_truths s) with Some true => mem (may_hold N) (fst l) | _ => true end) (new_truths s) &&
      forallb (stays_exclusive k s) (exclusive N) && forallb (stays_invariant k s) (invariants N) && simulated k s time o
  end.
Fixpoint tree_ok (leaf : knowledge -> option (nat * choice) -> bool) (k : knowledge) (t : case_tree) : bool :=
  match t with
  | Decided o => leaf k o
  | Impossible => contradictory k
  | SplitAtom a t u => tree_ok leaf (Knowledge ((a, true) :: literals k) (bounds k)) t &&
                       tree_ok leaf (Knowledge ((a, false) :: literals k) (bounds k)) u
  | SplitForm f t u => tree_ok leaf (Knowledge (literals k) ((false, f) :: bounds k)) t &&
                       tree_ok leaf (Knowledge (literals k) ((true, plus_form (constant 0) (-1 # 1) f) :: bounds k)) u
  end.
Definition instance_leaf (a : action) (env : list key) (k : knowledge) (o : option (nat * choice)) : bool :=
  match o with
  | None => leaf_ok k a env None
  | Some (i, ch) => match nth_error (operators T) i with Some o => leaf_ok k a env (Some (o, ch)) | None => false end
  end.
Definition goal_leaf (k : knowledge) (_ : option (nat * choice)) : bool :=
  match symbolic_truth k unchanged Undefined [] (goal_formula P) with Some false => true | _ => known_condition (fun _ => equivalent N) k (goal T) [] [] end.

(* Instances for which the conditions on what never changes may hold: parameters are bound one after
   another. *)
Fixpoint static_false (env : list key) (f : formula) : bool :=
  match f with
  | And g h => static_false env g || static_false env h
  | Atom p ts => negb (changing N p) && match ground env ts with Some l => negb (holds_in (initial P) (p, l)) | None => false end
  | Not (Atom p ts) => negb (changing N p) && match ground env ts with Some l => holds_in (initial P) (p, l) | None => false end
  | Same t u => match object_of env t, object_of env u with Some a, Some b => negb (Pos.eqb a b) | _, _ => false end
  | Not (Same t u) => match object_of env t, object_of env u with Some a, Some b => Pos.eqb a b | _, _ => false end
  | _ => false
  end.
Fixpoint instances (prune : list key -> bool) (types : list key) (env : list key) : list (list key) :=
  match types with
  | [] => [env]
  | t :: r => flat_map (fun o => if prune (env ++ [o]) then [] else instances prune r (env ++ [o])) (objects P t)
  end.
Definition pruned (a : action) (env : list key) : bool :=
  static_false env (at_start a) || match duration a with Some _ => static_false env (at_end a) | None => false end.
Fixpoint effect_heads (e : effect) : list key :=
  match e with
  | Nothing => [] | Put _ p _ => [p] | Change _ f _ _ => [f]
  | Both a b => effect_heads a ++ effect_heads b | When _ a => effect_heads a | Each _ a => effect_heads a
  end.
Variables (case : nat -> list key -> case_tree) (goal_case : case_tree).
Definition action_ok (i : nat) (a : action) : bool :=
  forallb (fun p => changing N p && negb (is_derived P p)) (effect_heads (start_effect a) ++ effect_heads (end_effect a)) &&
  forallb (fun env => tree_ok (instance_leaf a env) (with_invariants (gathered a env)) (case i env)) (instances (pruned a) (parameters a) []).
Definition all_entries {X} (m : atom_map X) : list (atom * X) := flat_map snd (PositiveMap.elements m).
Definition same_atom (r : option atom) (a : atom) : bool := match r with Some b => atom_eqb b a | None => false end.
(* Every derived atom that a rule yields may hold, and its derived variable follows by a rule of the
   task. *)
Definition ground_rules : M.t (list (Z * condition)) :=
  fold_right (fun r m => M.add (fst (fst r)) ((snd (fst r), snd r) :: match M.find (fst (fst r)) m with Some l => l | None => [] end) m)
    (M.empty _) (concat (layers T)).
Definition rule_leaf (full : key -> bool) (rules : M.t (list (Z * condition))) (a : atom) (k : knowledge) : bool :=
  impossible k || mem (may_hold N) a &&
  match find_atom (derived_of N) a with
  | None => true
  | Some (v, x) => match M.find v rules with
                   | Some l => existsb (fun r => Z.eqb (fst r) x && known_condition full k (snd r) [] []) l | None => false end
  end.
Definition rule_ok (stratum : nat) (rules : M.t (list (Z * condition))) (i : atom * formula) : bool :=
  match find_atom (derived_of N) (fst i), mem (may_hold N) (fst i) with
  | None, true => true
  | _, _ => expand (unfold max_unfoldings stratum) (snd i) true (snd (fst i)) 
              (rule_leaf (fun p => equivalent N && Nat.leb (level (strata P) p) stratum) rules (fst i)) (Knowledge [] [])
  end.
Fixpoint strata_ok (stratum : nat) (rules : M.t (list (Z * condition))) (ls : list (list rule)) : bool :=
  match ls with
  | [] => true
  | here :: later => forallb (rule_ok stratum rules) (rule_instances P here) && strata_ok (S stratum) rules later
  end.
(* Every rule of the task for a derived variable follows from a rule of its atom. *)
Definition ground_literals (limit : nat) (c : condition) : list (atom * bool) :=
  flat_map (fun f : fact =>
    match M.find (fst f) (variables N), M.find (fst f) (derived_atoms N) with
    | Some vals, _ => map (fun xa => (snd xa, Z.eqb (snd f) (fst xa))) vals
    | None, Some (y, _, a) =>
        if Z.eqb (snd f) y && negb (Nat.leb (level (strata P) (fst a)) limit) then [] else [(a, Z.eqb (snd f) y)]
    | None, None => [] end) (facts c).
Definition ground_rule_ok (heads : M.t Z) (r : fact * condition) : bool :=
  match M.find (fst (fst r)) (derived_atoms N) with
  | None => true
  | Some (_, _, a) =>
      forallb (fun f => match M.find (fst f) (derived_atoms N) with
                        | Some (y, _, _) => Z.eqb (snd f) y || match M.find (fst f) heads with None => true | Some _ => false end
                        | None => true end) (facts (snd r)) &&
      let limit := level (strata P) (fst a) in
      let k := Knowledge (ground_literals limit (snd r)) [] in
      existsb (fun rule => is_some true (definite (look_up max_unfoldings limit k) (snd a) (body rule))) (rules_of a)
  end.
Fixpoint ground_rules_ok (ls : list (list (fact * condition))) : bool * M.t Z :=
  match ls with
  | [] => (true, M.empty Z)
  | rules :: rest =>
      let '(ok, later) := ground_rules_ok rest in
      let heads := fold_left (fun m r => M.add (fst (fst r)) (snd (fst r)) m) rules later in
      (ok && forallb (ground_rule_ok heads) rules, heads)
  end.
Definition rules_ok : bool :=
  is_stratified (strata P) && fst (check_layers (layers T)) &&
  forallb (forallb (fun r => changing N (head r))) (strata P) &&
  forallb (fun vxa => let '(v, (x, d, a)) := vxa in is_derived P (fst a) && negb (is_basic T v) && negb (Z.eqb x d) &&
    existsb (fun f => Pos.eqb (fst f) v) (derived T) &&
    forallb (fun f => negb (Pos.eqb (fst f) v) || Z.eqb (snd f) d) (derived T) &&
    match find_atom (derived_of N) a with Some (u, y) => Pos.eqb u v && Z.eqb y x | None => false end)
    (M.elements (derived_atoms N)) &&
  forallb (forallb (fun a : atom => negb (is_derived P (fst a)))) (exclusive N) &&
  forallb (fun vl => forallb (fun xa : Z * atom => negb (is_derived P (fst (snd xa)))) (snd vl)) (M.elements (variables N)) &&
  forallb (forallb (fun r : fact * condition => match M.find (fst (fst r)) (derived_atoms N) with
                             | Some (x, _, _) => Z.eqb (snd (fst r)) x | None => true end)) (layers T) &&
  (negb (equivalent N) || fst (ground_rules_ok (layers T))) &&
  strata_ok 0 ground_rules (strata P).
Definition faithful : bool :=
  forallb (fun i : bool * form => if fst i then less 0 (ev (initial P) (snd i)) else Qle_bool 0 (ev (initial P) (snd i)))
    (invariants N) && rules_ok &&
  forallb (fun e => negb (changing N (fst (fst e))) || mem (may_hold N) (fst e)) (all_entries (initial_atoms P)) &&
  forallb (fun vl => let '(v, vals) := vl in is_basic T v &&
     forallb (fun xa => let '(x, a) := xa in Bool.eqb (holds_in (initial P) a) (Z.eqb (var_value (init T) v) x) &&
       match find_atom (fact_of N) a with Some (u, y) => Pos.eqb u v && Z.eqb y x | None => false end) vals) (M.elements (variables N)) &&
  forallb (fun e => let '(a, (v, x)) := e in
     match M.find v (variables N) with Some vals => existsb (fun xa => Z.eqb (fst xa) x && atom_eqb (snd xa) a) vals | None => false end)
     (all_entries (fact_of N)) &&
  forallb (fun nf => let '(n, f) := nf in mem_key n (numbers T) && changing N (fst f) &&
     match value_in (initial P) f with Some q => Qeq_bool (q * scaled) (inject_Z (num_value (init T) n)) | None => false end &&
     match find_atom (number_of N) f with Some m => Pos.eqb m n | None => false end) (M.elements (fluents N)) &&
  tree_ok goal_leaf (with_invariants (conjuncts unchanged Undefined [] (goal_formula P))) goal_case &&
  forallb (fun ia => action_ok (fst ia) (snd ia)) (combine (seq 0 (length (actions P))) (actions P)) &&
  forallb (fun g => forallb (fun a => negb (holds_in (initial P) a) ||
    forallb (fun b => atom_eqb a b || negb (holds_in (initial P) b)) g) g) (exclusive N).
End Faithful.

Definition is_linear (P : problem) (N : names) : bool :=
  match symbolic_expression P N unchanged Undefined [] (metric P) with Is _ => true | _ => false end.

(* The whole check: the plan, the comparison and the argument. *)
Definition check_certificate (P : problem) (T : task) (N : names) (case : nat -> list key -> case_tree) (goal_case : case_tree)
    (A : argument) (oracle : state -> list positive) (plan : list (nat * list key)) (claim : option Q) : bool :=
  check_task T && faithful P T N case goal_case &&
  match eval (initial P) None [] (metric P), claim with
  | _, None => check T A None oracle
  | Some first, Some m =>
      is_linear P N && match execute P false (initial P) 0 plan with
      | Some (w, spent) => match final_metric P w spent with Some m' => Qeq_bool m' m | None => false end
      | None => false
      end &&
      let cost := Qred ((m - first) * (Zpos (cost_scale N) # 1)) in
      Pos.eqb (Qden cost) 1 && check T A (Some (Qnum cost)) oracle
  | None, Some _ => false
  end.
