(* Checks a mission: the derivations of its facts, and the certificate for the problem that is filled with them.
   Theorems [mission_optimal] and [mission_front]: what [check_mission] and [check_mission_front] accept is true. *)
From Coq Require Import ZArith QArith List Bool FMapPositive Permutation.
From Proved Require Import Task Check Lifted Faithful Symbolic Axioms Optimal Lists Fronts TimelineProof Datalog Derivations Mission.
Import ListNotations.
Open Scope nat_scope.

(* A row of a fact about a PDDL symbol: individuals, and a number or nothing after them *)
Fixpoint split_row (l : list symbol) : option (list key * option Q) :=
  match l with
  | [] => Some ([], None)
  | [Literal (Numeric q)] => Some ([], Some q)
  | Name n :: l => match split_row l with Some (names, q) => Some (n :: names, q) | None => None end
  | Literal _ :: _ => None
  end.
Definition names_in (l : list symbol) : list key := flat_map (fun s => match s with Name n => [n] | _ => [] end) l.

Section Fill.
Variables (W : mission) (I : index).
Definition atom_rows (p : key) : list (list key) :=
  flat_map (fun l => match split_row l with Some (names, None) => [map (object_for W) names] | _ => [] end) (rows I p).
Definition value_rows (p : key) : list (list key * Q) :=
  flat_map (fun l => match split_row l with Some (names, Some q) => [(map (object_for W) names, q)] | _ => [] end) (rows I p).
Definition bound_atoms : list atom := flat_map (fun p => map (pair p) (atom_rows p)) (bound_symbols W).
Definition bound_values : list (atom * Q) :=
  filter (fun v => match find_atom (initial_values (files W)) (fst v) with None => true | Some _ => false end)
    (flat_map (fun p => map (fun r => ((p, fst r), snd r)) (value_rows p)) (bound_symbols W)).
Definition filled_objects (t : key) : list key :=
  objects (files W) t ++
  if member t (bound_symbols W) then flat_map (fun l => match l with [o] => [o] | _ => [] end) (atom_rows t) else [].
Definition filled_action (schema : action * option choice_of_designs) (functions : list key) : action :=
  match snd schema with None => fst schema | Some c => with_designs c functions (fst schema) end.
Definition filled_values : atom_map Q :=
  fold_left (fun m v => add_atom (fst v) (snd v) m) bound_values (initial_values (files W)).
(* The order of the functions of an action is that of the parameters for their designs. *)
Definition fill (orders : list (list key)) : problem :=
  Problem filled_objects (map (fun s => filled_action (fst s) (snd s)) (combine (schemas W) orders)) (strata (files W))
    (fold_left (fun m a => add_atom a tt m) bound_atoms (initial_atoms (files W))) filled_values
    (goal_formula (files W)) (metric (files W)) (per_time (files W)) (per_step (files W)).
Definition required_objects (c : choice_of_designs) : list key :=
  if member (requirement c) (bound_symbols W)
  then flat_map (fun l => match l with [o] => [o] | _ => [] end) (atom_rows (requirement c)) else [].
Definition order_accepted (s : (action * option choice_of_designs) * list key) : bool :=
  match snd (fst s) with
  | None => true
  | Some c => distinct (snd s) && forallb (fun f => member f (required_objects c)) (snd s) &&
              forallb (fun f => member f (snd s)) (required_objects c)
  end.
Definition exact_eqb (p q : Q) : bool := Z.eqb (Qnum p) (Qnum q) && Pos.eqb (Qden p) (Qden q).
Definition has_value (values : atom_map Q) (v : atom * Q) : bool :=
  match find_atom values (fst v) with Some q => exact_eqb q (snd v) | None => false end.
Definition mentioned : list key := flat_map (fun p => flat_map names_in (rows I p)) (bound_symbols W).
Definition named_apart : bool :=
  let names := nodup Pos.eq_dec mentioned in
  forallb (fun n => forallb (fun m => negb (Pos.eqb (object_for W n) (object_for W m)) || Pos.eqb n m) names) names.
Definition can_fill (orders : list (list key)) : bool :=
  named_apart && (let values := filled_values in forallb (has_value values) bound_values) &&
  Nat.eqb (length orders) (length (schemas W)) &&
  forallb order_accepted (combine (schemas W) orders).
End Fill.

(* The facts follow from the knowledge base, and the problem that is filled with them passes a check. *)
Definition check_filled (W : mission) (level : key -> nat) (steps : list (data * reason)) (orders : list (list key))
    (check : problem -> bool) : bool :=
  let I := index_of (map fst steps) in
  check_derivations (mission_knowledge W) level steps && can_fill W I orders && check (fill W I orders).
Definition check_mission (W : mission) (level : key -> nat) (steps : list (data * reason)) (orders : list (list key))
    (T : task) (N : names) (case : nat -> list key -> case_tree) (goal_case : case_tree)
    (A : Check.argument) (oracle : state -> list positive) (plan : list (nat * list key)) (claim : option Q) : bool :=
  check_filled W level steps orders (fun P => check_certificate P T N case goal_case A oracle plan claim).
Definition check_mission_front (W : mission) (level : key -> nat) (steps : list (data * reason)) (orders : list (list key))
    (first second : objective) (es : list evidence) (points : list point) : bool :=
  check_filled W level steps orders (fun P => check_front P first second es points).

(* The proof *)
Lemma split_row_ok : forall l names q, split_row l = Some (names, q) <->
  l = map Name names ++ match q with Some q => [Literal (Numeric q)] | None => [] end.
Proof.
  induction l as [|s l IH]; intros names q.
  - cbn. split.
    + intro H. injection H as <- <-. reflexivity.
    + destruct names, q; cbn; try discriminate. reflexivity.
  - destruct s as [n|x].
    + assert (E : split_row (Name n :: l) =
        match split_row l with Some (names, q) => Some (n :: names, q) | None => None end) by reflexivity.
      rewrite E. clear E. split.
      * destruct (split_row l) as [[names' q']|]; [|discriminate]. intro H. injection H as <- <-.
        cbn. f_equal. apply IH. reflexivity.
      * destruct names as [|n' names]; [destruct q; discriminate|]. intro H. cbn in H. injection H as <- H.
        apply IH in H. rewrite H. reflexivity.
    + split.
      * destruct x as [t|b|x]; try (destruct l; discriminate). destruct l; [|discriminate].
        cbn. intro H. injection H as <- <-. reflexivity.
      * destruct names as [|n' names]; [|discriminate]. destruct q as [q|]; [|discriminate]. cbn. intro H.
        injection H as -> ->. reflexivity.
Qed.
Lemma member_in : forall x l, member x l = true <-> In x l.
Proof.
  intros x l. unfold member. rewrite existsb_exists. split.
  - intros [y [J E]]. apply Pos.eqb_eq in E. subst y. exact J.
  - intro J. exists x. split; [exact J|apply Pos.eqb_refl].
Qed.
Lemma distinct_nodup : forall l, distinct l = true -> NoDup l.
Proof.
  induction l as [|x l IH]; intro H; constructor; cbn in H; apply andb_true_iff in H; destruct H as [N H].
  - intro J. apply member_in in J. rewrite J in N. discriminate.
  - apply IH, H.
Qed.
Lemma exact_eqb_eq : forall p q, exact_eqb p q = true -> p = q.
Proof.
  intros [n d] [m e] H. unfold exact_eqb in H. apply andb_true_iff in H. destruct H as [A B].
  apply Z.eqb_eq in A. apply Pos.eqb_eq in B. cbn in *. congruence.
Qed.
Lemma names_in_spec : forall n l, In n (names_in l) <-> In (Name n) l.
Proof.
  intros n l. unfold names_in. rewrite in_flat_map. split.
  - intros [[m|x] [J E]]; [|contradiction]. destruct E as [->|[]]. exact J.
  - intro J. exists (Name n). split; [exact J|left; reflexivity].
Qed.
Lemma mem_is : forall (m : atom_map unit) a,
  (match find_atom m a with Some _ => true | None => false end) = mem m a.
Proof. reflexivity. Qed.

Section Filled.
Variables (W : mission) (facts : list data).
Let I := index_of facts.
Let M (f : data) := In f facts.
Lemma atom_rows_in : forall p l, In p (bound_symbols W) -> In l (atom_rows W I p) <-> image W M p l [].
Proof.
  intros p l B. unfold atom_rows. rewrite in_flat_map. split.
  - intros [r [J H]]. destruct (split_row r) as [[names [q|]]|] eqn:E; [contradiction| |contradiction].
    destruct H as [<-|[]]. apply split_row_ok in E. split; [exact B|]. exists names. split; [reflexivity|]. subst r.
    apply rows_index, J.
  - intros [_ [names [<- J]]]. exists (map Name names ++ []). split; [apply rows_index, J|].
    rewrite (proj2 (split_row_ok (map Name names ++ []) names None) eq_refl). left. reflexivity.
Qed.
Lemma value_rows_in : forall p l q, In p (bound_symbols W) ->
  In (l, q) (value_rows W I p) <-> image W M p l [Literal (Numeric q)].
Proof.
  intros p l q B. unfold value_rows. rewrite in_flat_map. split.
  - intros [r [J H]]. destruct (split_row r) as [[names [q'|]]|] eqn:E; [|contradiction|contradiction].
    destruct H as [H|[]]. injection H as <- <-. apply split_row_ok in E. split; [exact B|]. exists names.
    split; [reflexivity|]. subst r. apply rows_index, J.
  - intros [_ [names [<- J]]]. exists (map Name names ++ [Literal (Numeric q)]). split; [apply rows_index, J|].
    rewrite (proj2 (split_row_ok (map Name names ++ [Literal (Numeric q)]) names (Some q)) eq_refl).
    left. reflexivity.
Qed.
Lemma image_bound : forall p l v, image W M p l v -> In p (bound_symbols W).
Proof. intros p l v [B _]. exact B. Qed.
Lemma single_rows : forall p o, In o (if member p (bound_symbols W)
    then flat_map (fun l => match l with [o] => [o] | _ => [] end) (atom_rows W I p) else []) <-> image W M p [o] [].
Proof.
  intros p o. destruct (member p (bound_symbols W)) eqn:B.
  - apply member_in in B. rewrite <- (atom_rows_in p [o] B), in_flat_map. split.
    + intros [[|x [|y r]] [J H]]; cbn in H; try contradiction. destruct H as [->|[]]. exact J.
    + intro J. exists [o]. split; [exact J|left; reflexivity].
  - split; [contradiction|]. intro H. apply image_bound in H. apply member_in in H. congruence.
Qed.
Lemma bound_atoms_in : forall p l, In (p, l) (bound_atoms W I) <-> image W M p l [].
Proof.
  intros p l. unfold bound_atoms. rewrite in_flat_map. split.
  - intros [q [B J]]. apply in_map_iff in J. destruct J as [r [E J]]. injection E as -> ->.
    apply atom_rows_in; assumption.
  - intro H. exists p. pose proof (image_bound _ _ _ H) as B. split; [exact B|]. apply in_map, atom_rows_in; assumption.
Qed.
Lemma bound_values_in : forall p l q, In ((p, l), q) (bound_values W I) <->
  value_in (initial (files W)) (p, l) = None /\ image W M p l [Literal (Numeric q)].
Proof.
  intros p l q. unfold bound_values. rewrite filter_In, in_flat_map. cbn [fst initial value_in]. split.
  - intros [[p' [B J]] E]. apply in_map_iff in J. destruct J as [[l' q'] [F J]]. cbn [fst snd] in F.
    injection F as -> -> ->. split; [destruct (find_atom _ _); [discriminate|reflexivity]|].
    apply value_rows_in; assumption.
  - intros [E H]. rewrite E. split; [|reflexivity]. exists p. pose proof (image_bound _ _ _ H) as B. split; [exact B|].
    apply in_map_iff. exists (l, q). split; [reflexivity|]. apply value_rows_in; assumption.
Qed.
Lemma fold_values : forall vs (m : atom_map Q) a q,
  find_atom (fold_left (fun m v => add_atom (fst v) (snd v) m) vs m) a = Some q -> In (a, q) vs \/ find_atom m a = Some q.
Proof.
  induction vs as [|[b x] vs IH]; intros m a q H; [right; exact H|]. cbn [fold_left fst snd] in H.
  apply IH in H. destruct H as [H|H]; [left; right; exact H|]. rewrite find_add in H.
  destruct (atom_eqb a b) eqn:E; [|right; exact H]. apply atom_eqb_eq in E. injection H as <-. subst b.
  left. left. reflexivity.
Qed.
Lemma fold_values_kept : forall vs (m : atom_map Q) a,
  (forall v, In v vs -> fst v <> a) -> find_atom (fold_left (fun m v => add_atom (fst v) (snd v) m) vs m) a = find_atom m a.
Proof.
  induction vs as [|[b x] vs IH]; intros m a H; [reflexivity|]. cbn [fold_left fst snd]. rewrite IH.
  - rewrite find_add. destruct (atom_eqb a b) eqn:E; [|reflexivity]. apply atom_eqb_eq in E. subst b.
    destruct (H (a, x) (or_introl eq_refl) eq_refl).
  - intros v J. apply H. right. exact J.
Qed.
Theorem fill_ok : forall orders, can_fill W I orders = true -> filled W M (fill W I orders).
Proof.
  intros orders H. unfold can_fill in H. rewrite !andb_true_iff in H. destruct H as [[[Ap Va] Le] Or].
  cbv zeta in Va. rewrite forallb_forall in Va. unfold filled. parts; try reflexivity.
  - unfold named_apart in Ap. rewrite forallb_forall in Ap.
    assert (C : forall n, mentions W M n -> In n (nodup Pos.eq_dec (mentioned W I))).
    { intros n [p [l [B [F J]]]]. apply nodup_In. unfold mentioned. rewrite in_flat_map. exists p. split; [exact B|].
      rewrite in_flat_map. exists l. split; [apply rows_index, F|apply names_in_spec, J]. }
    intros n m Hn Hm E. specialize (Ap n (C n Hn)). rewrite forallb_forall in Ap. specialize (Ap m (C m Hm)).
    rewrite E, Pos.eqb_refl in Ap. cbn in Ap. apply Pos.eqb_eq, Ap.
  - intros t o. cbn [fill objects]. unfold filled_objects. rewrite in_app_iff, single_rows. reflexivity.
  - intros p l. cbn [initial holds_in fill initial_atoms]. rewrite !mem_is, mem_fold, orb_true_iff, existsb_exists.
    rewrite <- bound_atoms_in. split.
    + intros [[a [J E]]|H]; [right|left; exact H]. apply atom_eqb_eq in E. subst a. exact J.
    + intros [H|J]; [right; exact H|left]. exists (p, l). split; [exact J|apply atom_eqb_refl].
  - intros f l q. cbn [initial value_in fill initial_values]. rewrite <- (bound_values_in f l q). split.
    + intro H. apply fold_values in H. destruct H; auto.
    + intros [H|J].
      * unfold filled_values. rewrite fold_values_kept; [exact H|]. intros [[p r] x] J E. cbn [fst] in E.
        injection E as -> ->. apply bound_values_in in J. cbn [initial value_in] in J. destruct J as [J _]. congruence.
      * specialize (Va _ J). unfold has_value in Va. cbn [fst snd] in Va.
        destruct (find_atom (filled_values W I) (f, l)) as [x|]; [|discriminate]. apply exact_eqb_eq in Va. congruence.
  - cbn [fill actions]. apply Nat.eqb_eq in Le. revert orders Le Or.
    induction (schemas W) as [|s schemas IH]; intros orders Le Or.
    + constructor.
    + destruct orders as [|fs orders]; [discriminate|]. cbn in Le, Or |- *. apply andb_true_iff in Or.
      destruct Or as [O Or]. injection Le as Le. constructor; [|apply IH; assumption].
      unfold action_of, filled_action. unfold order_accepted in O. cbn [fst snd] in O.
      destruct (snd s) as [c|]; [|reflexivity]. rewrite !andb_true_iff, !forallb_forall in O.
      destruct O as [[D S] C]. exists fs. split; [apply distinct_nodup, D|]. split; [|reflexivity].
      intro f. rewrite <- single_rows. fold (required_objects W I c). split.
      * intro J. apply member_in, S, J.
      * intro J. apply member_in, C, J.
Qed.
End Filled.

Lemma check_filled_ok : forall W level steps orders check (claim : problem -> Prop), (forall P, check P = true -> claim P) ->
  check_filled W level steps orders check = true -> holds_for_mission W claim.
Proof.
  intros W level steps orders check claim Ok H. unfold check_filled in H. cbv zeta in H.
  rewrite !andb_true_iff in H. destruct H as [[D F] C]. apply knowledge in D. destruct D as [S [Co U]].
  exists (fun f => In f (map fst steps)), (fill W (index_of (map fst steps)) orders). parts.
  - exact S.
  - exact U.
  - exact Co.
  - apply fill_ok, F.
  - apply Ok, C.
Qed.

Theorem mission_optimal : forall W level steps orders T N case goal_case A oracle plan claim,
  check_mission W level steps orders T N case goal_case A oracle plan claim = true ->
  holds_for_mission W (fun P => is_optimal P plan claim).
Proof.
  intros W level steps orders T N case goal_case A oracle plan claim. apply check_filled_ok. intros P H.
  exact (optimal _ _ _ _ _ _ _ _ _ H).
Qed.

Theorem mission_front : forall W level steps orders first second es points,
  check_mission_front W level steps orders first second es points = true ->
  holds_for_mission W (fun P => is_front P first second points).
Proof.
  intros W level steps orders first second es points. apply check_filled_ok. intros P H.
  exact (front_optimal _ _ _ _ _ H).
Qed.

(* The facts determine the problem, except for the order of objects, and for the order of the parameters for designs. *)
Definition same_action (schema : action * option choice_of_designs) (a b : action) : Prop :=
  a = b \/ exists c functions others, snd schema = Some c /\ Permutation functions others /\
    a = with_designs c functions (fst schema) /\ b = with_designs c others (fst schema).
Theorem filled_determined : forall W M P Q, filled W M P -> filled W M Q ->
  (forall t o, In o (objects P t) <-> In o (objects Q t)) /\
  (forall a, holds_in (initial P) a = holds_in (initial Q) a) /\ (forall f, value_in (initial P) f = value_in (initial Q) f) /\
  (exists schemas, Forall2 (fun s ab => same_action s (fst ab) (snd ab)) schemas (combine (actions P) (actions Q)) /\
     length (actions P) = length (actions Q)) /\
  strata P = strata Q /\ goal_formula P = goal_formula Q /\
  metric P = metric Q /\ per_time P = per_time Q /\ per_step P = per_step Q.
Proof.
  intros W M P Q [_ [O [H [V [A [S [G [Me [T N]]]]]]]]] [_ [O' [H' [V' [A' [S' [G' [Me' [T' N']]]]]]]]]. parts; try congruence.
  - intros t o. rewrite O, O'. reflexivity.
  - intros [p l]. apply eq_true_iff_eq. rewrite H, H'. reflexivity.
  - intros [f l]. destruct (value_in (initial P) (f, l)) as [q|] eqn:E.
    + symmetry. apply V', V, E.
    + destruct (value_in (initial Q) (f, l)) as [q|] eqn:E'; [|reflexivity]. apply V', V in E'. congruence.
  - exists (schemas W). revert A A'. generalize (schemas W) (actions P) (actions Q). clear.
    intros ss. induction ss as [|s ss IH]; intros l m A A'; inversion A; inversion A'; subst; cbn.
    + split; [constructor|reflexivity].
    + destruct (IH _ _ H3 H8) as [F L]. split; [|f_equal; exact L]. constructor; [|exact F]. cbn [fst snd].
      unfold action_of in *. destruct (snd s) as [c|] eqn:E; [|left; congruence].
      destruct H1 as [fs [D [I ->]]], H6 as [gs [D' [I' ->]]]. right. exists c, fs, gs. parts; try reflexivity; [exact E|].
      apply NoDup_Permutation; try assumption. intro f. rewrite I, I'. reflexivity.
Qed.
