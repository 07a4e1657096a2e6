(* The checker, and why it is right. *)
From Coq Require Import ZArith List Bool FMapPositive Lia.
From Proved Require Import Task.
Import ListNotations.
Open Scope Z_scope.

(* ---------- the argument ---------- *)
Record table := Table { pattern : list key; entries : M.t (option Z) }.
Record label := Label { at_state : state; paid : Z }.
Record argument := Argument { potentials : list table; needs : list (key * table); labels : M.t label; count : positive }.

(* ---------- enumeration ---------- *)
Fixpoint upto (k : nat) (x : Z) : list Z := match k with O => [] | S k => x :: upto k (x + 1) end.
Definition range (n : Z) : list Z := upto (Z.to_nat n) 0.
Fixpoint combos (ns : list Z) : list choice :=
  match ns with [] => [[]] | n :: r => flat_map (fun x => map (cons x) (combos r)) (range n) end.
Definition eq_list (a b : list Z) : bool := if list_eq_dec Z.eq_dec a b then true else false.
Definition admits (o : operator) (ch : choice) : bool :=
  forallb (fun e => negb (existsb (eq_list (map (fun i => nth i ch 0) (fst e))) (snd e))) (excluded o).
Definition choices (o : operator) : list choice := filter (admits o) (combos (sizes o)).

Definition lookup (v : key) (fs : list fact) : option Z :=
  match find (fun f => Pos.eqb (fst f) v) fs with Some f => Some (snd f) | None => None end.

Section Checker.
Variable T : task.

Fixpoint matching (pat : list key) (fs : list fact) : list (list Z) :=
  match pat with
  | [] => [[]]
  | v :: r => flat_map (fun x => map (cons x) (matching r fs))
                (match lookup v fs with Some x => [x] | None => range (get (size T) v) end)
  end.

Fixpoint last_put (fs : list fact) (v : key) (x : Z) : Z :=
  match fs with [] => x | f :: r => last_put r v (if Pos.eqb (fst f) v then snd f else x) end.
Fixpoint after (pat : list key) (vals : list Z) (fs : list fact) : list Z :=
  match pat, vals with v :: p, x :: r => last_put fs v x :: after p r fs | _, _ => [] end.
Fixpoint value_in (pat : list key) (vals : list Z) (v : key) : option Z :=
  match pat, vals with w :: p, x :: r => if Pos.eqb w v then Some x else value_in p r v | _, _ => None end.
Definition truth (pat : list key) (vals : list Z) (l : literal) : option bool :=
  match value_in pat vals (fst (fst l)) with
  | Some x => Some (Bool.eqb (x =? snd (fst l)) (snd l))
  | None => None
  end.
(* Where the conditional effects may lead from some targets. *)
Fixpoint targets (pat : list key) (vals : list Z) (cs : list (list literal * list fact)) (ts : list (list Z)) :=
  match cs with
  | [] => ts
  | c :: r =>
      let tr := map (truth pat vals) (fst c) in
      if existsb (fun t => match t with Some false => true | _ => false end) tr then targets pat vals r ts
      else let new := map (fun t => after pat t (snd c)) ts in
           if forallb (fun t => match t with Some true => true | _ => false end) tr then targets pat vals r new
           else targets pat vals r (ts ++ new)
  end.
Definition all_targets (pat : list key) (o : operator) (vals : list Z) :=
  targets pat vals (conditional o) [after pat vals (effects o)].

Definition memb (v : key) (pat : list key) := existsb (Pos.eqb v) pat.
Definition touches (pat : list key) (o : operator) : bool :=
  existsb (fun f => memb (fst f) pat) (facts (pre o) ++ effects o ++ flat_map snd (conditional o)).

Definition index (pat : list key) (vals : list Z) : Z :=
  fold_left (fun r vx => r * get (size T) (fst vx) + snd vx) (combine pat vals) 0.
(* None is infinity. *)
Definition bound (t : table) (vals : list Z) : option Z :=
  match M.find (Z.to_pos (index (pattern t) vals + 1)) (entries t) with Some b => b | None => Some 0 end.
Definition at_most (a b : option Z) (step : Z) : bool :=
  match b, a with None, _ => true | Some y, Some x => x <=? y + step | Some _, None => false end.

Definition minimum (xs : list Z) : option Z :=
  fold_right (fun x m => match m with None => Some x | Some y => Some (Z.min x y) end) None xs.

(* An operator with its choices, and the least that it costs; none if it has no choice. *)
Definition prepared := (operator * (list choice * option Z))%type.
Definition prepare (o : operator) : prepared :=
  (o, (choices o, minimum (map (amount (cost o) (sizes o)) (choices o)))).

Definition pot_op (t : table) (p : prepared) : bool :=
  let '(o, (_, least)) := p in
  match least with
  | None => true
  | Some least =>
      if touches (pattern t) o then
        forallb (fun vals => forallb (fun tgt => at_most (bound t vals) (bound t tgt) least)
                               (all_targets (pattern t) o vals))
          (matching (pattern t) (facts (pre o)))
      else 0 <=? least
  end.
Definition is_basic (v : key) : bool := Z.pos v <=? basic T.
Definition check_pot (ops : list prepared) (t : table) : bool :=
  forallb is_basic (pattern t) &&
  forallb (fun vals => at_most (bound t vals) (Some 0) 0) (matching (pattern t) (facts (goal T))) &&
  forallb (pot_op t) ops.

(* How an operator uses a number: it lowers it by at least so much, and leaves at least 0 *)
Definition alone (l : linear) (n : key) : bool :=
  match factors l with [(m, f)] => Pos.eqb m n && (f =? 1) | _ => false end.
Definition lowers (n : key) (p : prepared) : option Z :=
  let '(o, (chs, _)) := p in
  match filter (fun c => Pos.eqb (fst c) n) (changes o) with
  | [] => Some 0
  | [(_, l)] =>
      if alone l n then
        match minimum (map (fun ch => - amount (rest l) (sizes o) ch) chs) with
        | None => Some 0
        | Some least =>
            if (0 <=? least) &&
               ((least =? 0) ||
                forallb (fun ch => existsb (fun c => alone c n &&
                                       (amount (rest c) (sizes o) ch <=? amount (rest l) (sizes o) ch))
                                     (comparisons (pre o))) chs)
            then Some least else None
        end
      else None
  | _ => None
  end.
Definition zero (b : option Z) : bool := match b with Some x => x =? 0 | None => false end.
Definition none (b : option Z) : bool := match b with None => true | _ => false end.
Definition need_op (t : table) (n : key) (allzero : bool) (p : prepared) : bool :=
  let o := fst p in
  if touches (pattern t) o then
    forallb (fun vals => forallb (fun tgt =>
        match lowers n p with
        | Some least => at_most (bound t vals) (bound t tgt) least
        | None => zero (bound t vals) || (none (bound t vals) && none (bound t tgt))
        end) (all_targets (pattern t) o vals)) (matching (pattern t) (facts (pre o)))
  else match lowers n p with Some _ => true | None => allzero end.
Definition check_need (ops : list prepared) (nt : key * table) : bool :=
  let '(n, t) := nt in
  memb n (numbers T) && forallb is_basic (pattern t) &&
  forallb (fun vals => match bound t vals with Some x => 0 <=? x | None => true end) (matching (pattern t) []) &&
  forallb (fun vals => match bound t vals with
      | None => false
      | Some k => (k <=? 0) || existsb (fun l => alone l n && (k <=? - amount (rest l) [] [])) (comparisons (goal T))
      end) (matching (pattern t) (facts (goal T))) &&
  (let allzero := forallb (fun vals => zero (bound t vals) || none (bound t vals)) (matching (pattern t) []) in
   forallb (need_op t n allzero) ops).

(* Of the choices those that no other makes superfluous. *)
Definition entry := (choice * (Z * list Z))%type.
Definition profile (o : operator) (ch : choice) : list Z :=
  map (fun l => amount (rest l) (sizes o) ch) (comparisons (pre o) ++ map snd (changes o)).
Fixpoint fits (mono : bool) (a b : list Z) : bool :=
  match a, b with
  | [], [] => true
  | x :: a, y :: b => (if mono then y <=? x else x =? y) && fits mono a b
  | _, _ => false
  end.
Definition as_good (mono : bool) (a b : entry) : bool := (fst (snd a) <=? fst (snd b)) && fits mono (snd (snd a)) (snd (snd b)).
Definition front (mono : bool) (o : operator) : list choice :=
  let all := map (fun ch => (ch, (amount (cost o) (sizes o) ch, profile o ch))) (choices o) in
  let some := fold_left (fun f e => if existsb (fun x => as_good mono x e) f then f
                                    else e :: filter (fun x => negb (as_good mono e x)) f) all [] in
  if forallb (fun e => existsb (fun x => as_good mono x e) some) all then map fst some else choices o.

(* Whether more of any number never hurts. *)
Definition nonneg (l : linear) : bool := forallb (fun f => 0 <=? snd f) (factors l).
Definition more_never_hurts : bool :=
  forallb (fun o => forallb nonneg (comparisons (pre o)) && forallb (fun c => nonneg (snd c)) (changes o)) (operators T)
  && forallb nonneg (comparisons (goal T))
  && forallb (forallb (fun r => match comparisons (snd r) with [] => true | _ => false end)) (layers T).

Variable A : argument.
Variable claim : option Z.
(* Says which labels may cover a state; nothing is believed of it. *)
Variable oracle : state -> list positive.

Definition numbers_fit (mono : bool) (a b : M.t Z) (ns : list key) : bool :=
  forallb (fun n => if mono then get b n <=? get a n else get a n =? get b n) ns.

Definition pot_cuts (s : state) (p : Z) (t : table) : bool :=
  match bound t (map (val s) (pattern t)), claim with
  | None, _ => true
  | Some more, Some c => c <=? p + more
  | Some _, None => false
  end.
Definition need_cuts (s : state) (nt : key * table) : bool :=
  match bound (snd nt) (map (val s) (pattern (snd nt))) with
  | None => true
  | Some k => (0 <? k) && (num s (fst nt) <? k)
  end.
Definition label_covers (mono : bool) (bs : list key) (s : state) (p : Z) (l : label) : bool :=
  (paid l <=? p) && forallb (fun v => val (at_state l) v =? val s v) bs
  && numbers_fit mono (sn (at_state l)) (sn s) (numbers T).
Definition covered (mono : bool) (bs : list key) (s : state) (p : Z) : bool :=
  existsb (pot_cuts s p) (potentials A) || existsb (need_cuts s) (needs A)
  || existsb (fun i => match M.find i (labels A) with Some l => label_covers mono bs s p l | None => false end) (oracle s).

Definition check_label (mono : bool) (bs : list key) (ops : list (operator * list choice)) (l : label) : bool :=
  let s := derive T (at_state l) in
  negb (holds (goal T) s [] [] && match claim with Some c => paid l <? c | None => true end) &&
  forallb (fun p => let o := fst p in
      if holds_facts (pre o) s then
        forallb (fun ch => if holds (pre o) s (sizes o) ch
                           then covered mono bs (apply o s ch) (paid l + amount (cost o) (sizes o) ch)
                           else true) (snd p)
      else true) ops.

Definition in_range (v : key) (x : Z) : bool := (0 <=? x) && (x <? get (size T) v).
Definition sound_fact (f : fact) : bool := is_basic (fst f) && in_range (fst f) (snd f).
Fixpoint distinct (ks : list key) : bool := match ks with [] => true | k :: r => negb (memb k r) && distinct r end.
Definition check_task : bool :=
  forallb (fun v => in_range v (val (init T) v)) (basics T) &&
  forallb (fun o => forallb sound_fact (effects o) && forallb (fun c => forallb sound_fact (snd c)) (conditional o)
                    && distinct (map fst (changes o))) (operators T) &&
  forallb (forallb (fun r => negb (is_basic (fst (fst r))))) (layers T) &&
  forallb (fun d => negb (is_basic (fst d))) (derived T).

Definition check : bool :=
  match claim, existsb (fun c => match c with [] => true | _ => false end) (clauses (goal T)) with
  | None, true => true
  | _, _ =>
      let ops := map prepare (operators T) in
      let mono := more_never_hurts in
      let bs := basics T in
      check_task &&
      forallb (check_pot ops) (potentials A) &&
      forallb (check_need ops) (needs A) &&
      covered mono bs (init T) 0 &&
      (let fronts := map (fun o => (o, front mono o)) (operators T) in
       forallb (fun il => check_label mono bs fronts (snd il)) (M.elements (labels A)))
  end.
End Checker.
