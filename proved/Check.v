(* Check of an argument that bounds the cost of every plan of a ground task from below: potentials
   [1] bound the remaining cost, needs bound the remaining consumption of a number, and labels with
   their path costs cover every reachable state that neither of them prunes.
   [1] F. Pommerening, M. Helmert, G. Röger, J. Seipp: From non-negative to general operator cost
   partitioning, AAAI 2015. *)
From Coq Require Import ZArith List Bool FMapPositive Lia.
From Proved Require Import Task.
Import ListNotations.
Open Scope Z_scope.

(* Argument *)
Record table := Table { pattern : list key; table_values : M.t (option Z) }.
Record label := Label { label_state : state; path_cost : Z }.
Record argument := Argument { potentials : list table; needs : list (key * table); labels : M.t label }.

(* Enumeration of choices *)
Fixpoint count_up (k : nat) (x : Z) : list Z := match k with O => [] | S k => x :: count_up k (x + 1) end.
Definition range (n : Z) : list Z := count_up (Z.to_nat n) 0.
Fixpoint combinations (ns : list Z) : list choice :=
  match ns with [] => [[]] | n :: r => flat_map (fun x => map (cons x) (combinations r)) (range n) end.
Definition equal_lists (a b : list Z) : bool := if list_eq_dec Z.eq_dec a b then true else false.
Definition admits (o : operator) (ch : choice) : bool :=
  forallb (fun e => negb (existsb (equal_lists (map (fun i => nth i ch 0) (fst e))) (snd e))) (excluded o).
Definition choices (o : operator) : list choice := filter (admits o) (combinations (slot_sizes o)).

Definition fact_value (v : key) (fs : list fact) : option Z :=
  match find (fun f => Pos.eqb (fst f) v) fs with Some f => Some (snd f) | None => None end.

Section Checker.
Variable T : task.

Fixpoint matching (pat : list key) (fs : list fact) : list (list Z) :=
  match pat with
  | [] => [[]]
  | v :: r => flat_map (fun x => map (cons x) (matching r fs))
                (match fact_value v fs with Some x => [x] | None => range (get (domain_size T) v) end)
  end.

Fixpoint last_put (fs : list fact) (v : key) (x : Z) : Z :=
  match fs with [] => x | f :: r => last_put r v (if Pos.eqb (fst f) v then snd f else x) end.
Fixpoint pattern_after (pat : list key) (vals : list Z) (fs : list fact) : list Z :=
  match pat, vals with v :: p, x :: r => last_put fs v x :: pattern_after p r fs | _, _ => [] end.
Fixpoint pattern_value (pat : list key) (vals : list Z) (v : key) : option Z :=
  match pat, vals with w :: p, x :: r => if Pos.eqb w v then Some x else pattern_value p r v | _, _ => None end.
Definition pattern_truth (pat : list key) (vals : list Z) (l : literal) : option bool :=
  match pattern_value pat vals (fst (fst l)) with
  | Some x => Some (Bool.eqb (x =? snd (fst l)) (snd l))
  | None => None
  end.
Definition mem_key (v : key) (pat : list key) := existsb (Pos.eqb v) pat.
Definition same_values (a b : list Z) : bool := if list_eq_dec Z.eq_dec a b then true else false.
(* Values of the pattern that conditional effects may produce. Effects on other variables are left out, and
   values are not repeated: their number is then at most that of all values of the pattern. *)
Fixpoint reached_patterns (pat : list key) (vals : list Z) (cs : list (list literal * list fact)) (ts : list (list Z)) :=
  match cs with
  | [] => ts
  | c :: r =>
      let tr := map (pattern_truth pat vals) (fst c) in
      if forallb (fun f => negb (mem_key (fst f) pat)) (snd c) then reached_patterns pat vals r ts
      else if existsb (fun t => match t with Some false => true | _ => false end) tr then reached_patterns pat vals r ts
      else let new := map (fun t => pattern_after pat t (snd c)) ts in
           if forallb (fun t => match t with Some true => true | _ => false end) tr then reached_patterns pat vals r new
           else reached_patterns pat vals r (ts ++ filter (fun t => negb (existsb (same_values t) ts)) new)
  end.
Definition successor_patterns (pat : list key) (o : operator) (vals : list Z) :=
  reached_patterns pat vals (conditional o) [pattern_after pat vals (effects o)].

Definition mentions (pat : list key) (o : operator) : bool :=
  existsb (fun f => mem_key (fst f) pat) (facts (precondition o) ++ effects o ++ flat_map snd (conditional o)).

Definition table_index (pat : list key) (vals : list Z) : Z :=
  fold_left (fun r vx => r * get (domain_size T) (fst vx) + snd vx) (combine pat vals) 0.
(* [None] is infinite. *)
Definition table_bound (t : table) (vals : list Z) : option Z :=
  match M.find (Z.to_pos (table_index (pattern t) vals + 1)) (table_values t) with Some b => b | None => Some 0 end.
Definition at_most (a b : option Z) (step : Z) : bool :=
  match b, a with None, _ => true | Some y, Some x => x <=? y + step | Some _, None => false end.

Definition minimum (xs : list Z) : option Z :=
  fold_right (fun x m => match m with None => Some x | Some y => Some (Z.min x y) end) None xs.

(* An operator with its choices and its least cost, which is [None] if there is no choice. *)
Definition prepared := (operator * (list choice * option Z))%type.
Definition prepare (o : operator) : prepared :=
  (o, (choices o, minimum (map (amount (cost o) (slot_sizes o)) (choices o)))).

Definition potential_ok_for (t : table) (p : prepared) : bool :=
  let '(o, (_, least)) := p in
  match least with
  | None => true
  | Some least =>
      if mentions (pattern t) o then
        forallb (fun vals => forallb (fun tgt => at_most (table_bound t vals) (table_bound t tgt) least)
                               (successor_patterns (pattern t) o vals))
          (matching (pattern t) (facts (precondition o)))
      else 0 <=? least
  end.
Definition is_basic (v : key) : bool := Z.pos v <=? basic_count T.
Definition check_potential (ops : list prepared) (t : table) : bool :=
  forallb is_basic (pattern t) &&
  forallb (fun vals => at_most (table_bound t vals) (Some 0) 0) (matching (pattern t) (facts (goal T))) &&
  forallb (potential_ok_for t) ops.

(* Lower bound on the consumption of a number by an operator; [None] if the operator may raise the
   number, or may leave less than 0. *)
Definition is_number (l : linear) (n : key) : bool :=
  match factors l with [(m, f)] => Pos.eqb m n && (f =? 1) | _ => false end.
Definition least_use (n : key) (p : prepared) : option Z :=
  let '(o, (chs, _)) := p in
  match filter (fun c => Pos.eqb (fst c) n) (number_effects o) with
  | [] => Some 0
  | [(_, l)] =>
      if is_number l n then
        match minimum (map (fun ch => - amount (offset l) (slot_sizes o) ch) chs) with
        | None => Some 0
        | Some least =>
            if (0 <=? least) &&
               ((least =? 0) ||
                forallb (fun ch => existsb (fun c => is_number c n &&
                                       (amount (offset c) (slot_sizes o) ch <=? amount (offset l) (slot_sizes o) ch))
                                     (comparisons (precondition o))) chs)
            then Some least else None
        end
      else None
  | _ => None
  end.
Definition is_zero_bound (b : option Z) : bool := match b with Some x => x =? 0 | None => false end.
Definition is_infinite (b : option Z) : bool := match b with None => true | _ => false end.
Definition need_ok_for (t : table) (n : key) (allzero : bool) (p : prepared) : bool :=
  let o := fst p in
  if mentions (pattern t) o then
    forallb (fun vals => forallb (fun tgt =>
        match least_use n p with
        | Some least => at_most (table_bound t vals) (table_bound t tgt) least
        | None => is_zero_bound (table_bound t vals) || (is_infinite (table_bound t vals) && is_infinite (table_bound t tgt))
        end) (successor_patterns (pattern t) o vals)) (matching (pattern t) (facts (precondition o)))
  else match least_use n p with Some _ => true | None => allzero end.
Definition check_need (ops : list prepared) (nt : key * table) : bool :=
  let '(n, t) := nt in
  mem_key n (numbers T) && forallb is_basic (pattern t) &&
  forallb (fun vals => match table_bound t vals with Some x => 0 <=? x | None => true end) (matching (pattern t) []) &&
  forallb (fun vals => match table_bound t vals with
      | None => false
      | Some k => (k <=? 0) || existsb (fun l => is_number l n && (k <=? - amount (offset l) [] [])) (comparisons (goal T))
      end) (matching (pattern t) (facts (goal T))) &&
  (let allzero := forallb (fun vals => is_zero_bound (table_bound t vals) || is_infinite (table_bound t vals)) (matching (pattern t) []) in
   forallb (need_ok_for t n allzero) ops).

(* Choices that no other choice dominates. *)
Definition choice_profile := (choice * (Z * list Z))%type.
Definition profile (o : operator) (ch : choice) : list Z :=
  map (fun l => amount (offset l) (slot_sizes o) ch) (comparisons (precondition o) ++ map snd (number_effects o)).
Fixpoint fits (mono : bool) (a b : list Z) : bool :=
  match a, b with
  | [], [] => true
  | x :: a, y :: b => (if mono then y <=? x else x =? y) && fits mono a b
  | _, _ => false
  end.
Definition dominates (mono : bool) (a b : choice_profile) : bool := (fst (snd a) <=? fst (snd b)) && fits mono (snd (snd a)) (snd (snd b)).
Definition undominated_choices (mono : bool) (o : operator) : list choice :=
  let all := map (fun ch => (ch, (amount (cost o) (slot_sizes o) ch, profile o ch))) (choices o) in
  let kept := fold_left (fun f e => if existsb (fun x => dominates mono x e) f then f
                                    else e :: filter (fun x => negb (dominates mono e x)) f) all [] in
  if forallb (fun e => existsb (fun x => dominates mono x e) kept) all then map fst kept else choices o.

(* Returns [true] if a greater value of a number never disables an operator, a rule or the goal. *)
Definition nonneg (l : linear) : bool := forallb (fun f => 0 <=? snd f) (factors l).
Definition is_monotone : bool :=
  forallb (fun o => forallb nonneg (comparisons (precondition o)) && forallb (fun c => nonneg (snd c)) (number_effects o)) (operators T)
  && forallb nonneg (comparisons (goal T))
  && forallb (forallb (fun r => match comparisons (snd r) with [] => true | _ => false end)) (layers T).

Variable A : argument.
Variable claim : option Z.
(* Candidate labels that may cover a state; need not be believed. *)
Variable oracle : state -> list positive.

Definition numbers_cover (mono : bool) (a b : M.t Z) (ns : list key) : bool :=
  forallb (fun n => if mono then get b n <=? get a n else get a n =? get b n) ns.

Definition potential_prunes (s : state) (p : Z) (t : table) : bool :=
  match table_bound t (map (var_value s) (pattern t)), claim with
  | None, _ => true
  | Some more, Some c => c <=? p + more
  | Some _, None => false
  end.
Definition need_prunes (s : state) (nt : key * table) : bool :=
  match table_bound (snd nt) (map (var_value s) (pattern (snd nt))) with
  | None => true
  | Some k => (0 <? k) && (num_value s (fst nt) <? k)
  end.
Definition label_covers (mono : bool) (bs : list key) (s : state) (p : Z) (l : label) : bool :=
  (path_cost l <=? p) && forallb (fun v => var_value (label_state l) v =? var_value s v) bs
  && numbers_cover mono (num_values (label_state l)) (num_values s) (numbers T).
Definition covered (mono : bool) (bs : list key) (s : state) (p : Z) : bool :=
  existsb (potential_prunes s p) (potentials A) || existsb (need_prunes s) (needs A)
  || existsb (fun i => match M.find i (labels A) with Some l => label_covers mono bs s p l | None => false end) (oracle s).

(* Operators with their choices, by the rarest fact of their conditions: of all operators, a state
   needs only those without facts, and those whose fact it has. The second part maps variables to maps
   from values. *)
Definition front := (operator * list choice)%type.
Definition fronts_by_fact := M.t (M.t (list front)).
Definition slot (x : Z) : positive := Z.to_pos (x + 1).   (* equal slots of different values cost time only *)
Definition row {X} (m : M.t (M.t X)) (v : key) : M.t X := match M.find v m with Some r => r | None => M.empty _ end.
Definition with_fact (m : fronts_by_fact) (f : fact) : list front :=
  match M.find (slot (snd f)) (row m (fst f)) with Some l => l | None => [] end.
Definition add_front (f : fact) (p : front) (m : fronts_by_fact) : fronts_by_fact :=
  M.add (fst f) (M.add (slot (snd f)) (p :: with_fact m f) (row m (fst f))) m.
Definition frequency (m : M.t (M.t Z)) (f : fact) : Z := get (row m (fst f)) (slot (snd f)).
Definition frequencies (fs : list fact) : M.t (M.t Z) :=
  fold_left (fun m f => M.add (fst f) (M.add (slot (snd f)) (frequency m f + 1) (row m (fst f))) m) fs (M.empty _).
Fixpoint rarest (m : M.t (M.t Z)) (fs : list fact) : option fact :=
  match fs with
  | [] => None
  | f :: r => match rarest m r with
              | Some g => if frequency m f <? frequency m g then Some f else Some g
              | None => Some f end
  end.
Fixpoint index_fronts (m : M.t (M.t Z)) (ps : list front) : list front * fronts_by_fact :=
  match ps with
  | [] => ([], M.empty _)
  | p :: r => let '(others, by_fact) := index_fronts m r in
              match rarest m (facts (precondition (fst p))) with
              | None => (p :: others, by_fact)
              | Some f => (others, add_front f p by_fact)
              end
  end.
Definition applicable (others : list front) (by_fact : list (key * M.t (list front))) (s : state) : list front :=
  others ++ flat_map (fun vm => match M.find (slot (var_value s (fst vm))) (snd vm) with Some l => l | None => [] end) by_fact.

Definition check_label (mono : bool) (bs : list key) (ops : state -> list front) (l : label) : bool :=
  let s := derive T (label_state l) in
  negb (holds (goal T) s [] [] && match claim with Some c => path_cost l <? c | None => true end) &&
  forallb (fun p => let o := fst p in
      if holds_facts (precondition o) s then
        forallb (fun ch => if holds (precondition o) s (slot_sizes o) ch
                           then covered mono bs (apply o s ch) (path_cost l + amount (cost o) (slot_sizes o) ch)
                           else true) (snd p)
      else true) (ops s).

Definition in_range (v : key) (x : Z) : bool := (0 <=? x) && (x <? get (domain_size T) v).
Definition is_well_formed (f : fact) : bool := is_basic (fst f) && in_range (fst f) (snd f).
Fixpoint distinct (ks : list key) : bool := match ks with [] => true | k :: r => negb (mem_key k r) && distinct r end.
Definition check_task : bool :=
  forallb (fun v => in_range v (var_value (init T) v)) (basics T) &&
  forallb (fun o => forallb is_well_formed (effects o) && forallb (fun c => forallb is_well_formed (snd c)) (conditional o)
                    && distinct (map fst (number_effects o))) (operators T) &&
  forallb (forallb (fun r => negb (is_basic (fst (fst r))))) (layers T) &&
  forallb (fun d => negb (is_basic (fst d))) (derived T).

Definition condition_variables (c : condition) : list key :=
  map fst (facts c) ++ map (fun l => fst (fst l)) (concat (clauses c)).
(* Rules do not depend on variables of later layers, and the rules of a variable have one value.
   Second result: the variables of the layers with their values. *)
Fixpoint check_layers (ls : list (list (fact * condition))) : bool * M.t Z :=
  match ls with
  | [] => (true, M.empty Z)
  | rules :: rest =>
      let '(ok, later) := check_layers rest in
      let heads := fold_left (fun m r => M.add (fst (fst r)) (snd (fst r)) m) rules later in
      (ok && forallb (fun r => match M.find (fst (fst r)) heads with Some x => x =? snd (fst r) | None => false end &&
                 forallb (fun v => match M.find v later with None => true | Some _ => false end)
                   (fst (fst r) :: condition_variables (snd r))) rules, heads)
  end.

Definition check : bool :=
  match claim, existsb (fun c => match c with [] => true | _ => false end) (clauses (goal T)) with
  | None, true => true
  | _, _ =>
      let ops := map prepare (operators T) in
      let mono := is_monotone in
      let bs := basics T in
      check_task &&
      forallb (check_potential ops) (potentials A) &&
      forallb (check_need ops) (needs A) &&
      covered mono bs (init T) 0 &&
      (let fronts := map (fun o => (o, undominated_choices mono o)) (operators T) in
       let index := index_fronts (frequencies (flat_map (fun o => facts (precondition o)) (operators T))) fronts in
       let by_fact := M.elements (snd index) in
       forallb (fun il => check_label mono bs (applicable (fst index) by_fact) (snd il)) (M.elements (labels A)))
  end.
End Checker.
