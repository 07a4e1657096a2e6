(* The symbolic evaluation of Faithful.v agrees with the semantics of Lifted.v. *)
From Coq Require Import ZArith QArith List Bool FMapPositive Lia Lqa Setoid.
From Proved Require Import Task Check Proof Lifted Faithful.
Import ListNotations.
Open Scope Q_scope.

Lemma atom_eqb_eq : forall a b, atom_eqb a b = true <-> a = b.
Proof.
  intros [p l] [q r]. unfold atom_eqb. rewrite andb_true_iff, Pos.eqb_eq. simpl.
  destruct (list_eq_dec Pos.eq_dec l r); split; intro H;
    [destruct H; congruence|split; congruence|destruct H; discriminate|congruence].
Qed.
Lemma atom_eqb_refl : forall a, atom_eqb a a = true.
Proof. intro. apply atom_eqb_eq. reflexivity. Qed.
Lemma assoc_In : forall X a (l : list (atom * X)) x, assoc a l = Some x -> In (a, x) l.
Proof.
  induction l as [|[b y] l IH]; simpl; intros x H; [discriminate|]. destruct (atom_eqb a b) eqn:E.
  - apply atom_eqb_eq in E. left. congruence.
  - right. apply IH, H.
Qed.
Lemma assoc_app : forall X a (l m : list (atom * X)), assoc a (l ++ m) = match assoc a l with Some x =>
  Some x | None => assoc a m end.
Proof. induction l as [|[b y] l IH]; simpl; intros; [reflexivity|]. destruct (atom_eqb a b); auto. Qed.
Lemma find_entries : forall X (m : atom_map X) a x, find_atom m a = Some x -> In (a, x) (all_entries m).
Proof.
  intros X m a x H. unfold find_atom, bucket_entries in H.
  destruct (PositiveMap.find (bucket a) m) as [l|] eqn:F; [|discriminate].
  apply PositiveMap.elements_correct in F. unfold all_entries. apply in_flat_map. exists (bucket a, l).
  split; [exact F|]. apply assoc_In, H.
Qed.
Lemma less_spec : forall x y, less x y = true <-> x < y.
Proof.
  intros. unfold less. rewrite negb_true_iff.
  destruct (Qle_bool y x) eqn:E; split; intro H; try discriminate; try reflexivity.
  - apply Qle_bool_iff in E. lra.
  - apply Qnot_le_lt. intro L. apply Qle_bool_iff in L. congruence.
Qed.
Lemma less_false : forall x y, less x y = false <-> y <= x.
Proof. intros. unfold less. rewrite negb_false_iff. apply Qle_bool_iff. Qed.
Lemma le_false : forall x y, Qle_bool x y = false <-> y < x.
Proof. intros. pose proof (less_spec y x) as H. unfold less in H. rewrite negb_true_iff in H. exact H. Qed.

(* Linear forms *)
Lemma ev_shift : forall w l c, ev w (l, c) == ev w (l, 0) + c.
Proof. intros w l c. unfold ev. simpl. induction l as [|t l IH]; simpl; [ring|]. rewrite IH. ring. Qed.
Lemma ev_cons : forall w t l c, ev w (t :: l, c) == default (value_in w (fst t)) * snd t + ev w (l, c).
Proof. intros. reflexivity. Qed.
Lemma ev_plus_term : forall w f q l c, ev w (plus_term f q l, c) == ev w (l, c) + default (value_in w f) * q.
Proof.
  intros w f q. induction l as [|[g y] l IH]; intro c; cbn [plus_term].
  - rewrite ev_cons. simpl. ring.
  - destruct (atom_eqb f g) eqn:E.
    + apply atom_eqb_eq in E. subst g. destruct (Qeq_bool (Qred (y + q)) 0) eqn:Z.
      * apply Qeq_bool_iff in Z. rewrite Qred_correct in Z. rewrite ev_cons. cbn [fst snd].
        setoid_replace q with (- y) by lra. ring.
      * rewrite !ev_cons. cbn [fst snd]. rewrite Qred_correct. ring.
    + rewrite !ev_cons, IH. ring.
Qed.
Lemma ev_plus_form : forall w a c b, ev w (plus_form a c b) == ev w a + c * ev w b.
Proof.
  intros w [la ca] c [lb cb]. unfold plus_form. cbn [fst snd].
  assert (G : forall l k, ev w (fold_left (fun l t =>
    plus_term (fst t) (c * snd t) l) lb l, k) == ev w (l, k) + c * ev w (lb, 0)).
  { induction lb as [|t lb IH]; intros l k; cbn [fold_left]; [unfold ev at 3; simpl; ring|].
    rewrite IH, ev_plus_term, (ev_cons w t lb). ring. }
  rewrite G, (ev_shift w lb cb), (ev_shift w la (Qred _)), (ev_shift w la ca), Qred_correct. ring.
Qed.
Lemma ev_constant : forall w q, ev w (constant q) == q.
Proof. intros. unfold ev. simpl. reflexivity. Qed.
Lemma ev_fluent : forall w f, ev w (fluent f) == default (value_in w f).
Proof. intros. unfold ev. simpl. ring. Qed.
Lemma ev_empty : forall w q, ev w ([], q) == q.
Proof. intros. reflexivity. Qed.

(* A symbolic state describes a world relative to an earlier world [w0]. *)
Record DescribesIn (P : problem) (w0 w : world) (s : symbolic) : Prop := {
  d_fact : forall a, is_stale P s (fst a) = false ->
    holds_in w a = match assoc a (new_truths s) with Some b => b | None => holds_in w0 a end;
  d_value : forall f, match assoc f (new_values s) with
                      | Some g => exists q, value_in w f = Some q /\ q == ev w0 g
                      | None => value_in w f = value_in w0 f end }.
Lemma describes_itself : forall P w, DescribesIn P w w unchanged.
Proof. intros P w. split; reflexivity. Qed.
Definition agrees (w0 : world) (o : option Q) (r : result) : Prop :=
  match r with Is g => forall q, o = Some q -> q == ev w0 g | Undefined => o = None | Unknown => True end.
Definition Knows (w : world) (k : knowledge) : Prop :=
  (forall a b, In (a, b) (literals k) -> holds_in w a = b) /\
  (forall st f, In (st, f) (bounds k) -> if st : bool then 0 < ev w f else 0 <= ev w f).

Section Evaluation.
Variables (P : problem) (T : task) (N : names) (w0 : world) (k : knowledge).
Notation Describes := (DescribesIn P).
Hypothesis base_truth_ok : forall a b, base_truth P T N k a = Some b -> holds_in w0 a = b.
Hypothesis static_value : forall f, changing N (fst f) = false -> value_in w0 f = value_in (initial P) f.
Hypothesis known : Knows w0 k.

Lemma symbolic_atom_ok : forall w s a b, Describes w0 w s -> symbolic_atom P T N k s a = Some b ->
  holds_in w a = b.
Proof.
  intros w s a b D H. unfold symbolic_atom in H. destruct (is_stale P s (fst a)) eqn:St; [discriminate|].
  rewrite (d_fact _ _ _ _ D a St). destruct (assoc a (new_truths s)); [congruence|]. apply base_truth_ok, H.
Qed.
Lemma symbolic_value_ok : forall w s f, Describes w0 w s -> agrees w0 (value_in w f) (symbolic_value P N s f).
Proof.
  intros w s f D. pose proof (d_value _ _ _ _ D f) as H. unfold symbolic_value.
  destruct (assoc f (new_values s)) as [g|].
  - destruct H as [q [E H]]. simpl. intros x X. rewrite E in X. injection X as <-. exact H.
  - rewrite H. destruct (changing N (fst f)) eqn:C; simpl.
    + intros q E. rewrite ev_fluent, E. reflexivity.
    + rewrite static_value by exact C. cbn [initial value_in].
      destruct (find_atom (initial_values P) f); [|exact eq_refl].
      intros x X. injection X as <-. rewrite ev_constant. reflexivity.
Qed.
Lemma agrees_plus : forall (f : Q -> Q -> Q) c a b r t, (forall x y, f x y == x + c * y) ->
  agrees w0 a r -> agrees w0 b t -> agrees w0 (lift f a b) (plus_result r c t).
Proof.
  intros f c a b r t F A B. destruct r as [| |x], t as [| |y]; simpl in *; auto;
    try (rewrite A; exact eq_refl); try (rewrite B; destruct a; exact eq_refl).
  intros q E. destruct a as [u|]; [|discriminate]. destruct b as [v|]; [|discriminate]. simpl in E.
  injection E as <-.
  rewrite F, ev_plus_form, (A u eq_refl), (B v eq_refl). reflexivity.
Qed.
Lemma symbolic_expression_ok : forall w s d r, Describes w0 w s -> agrees w0 d r ->
  forall env e, agrees w0 (eval w d env e) (symbolic_expression P N s r env e).
Proof.
  intros w s d r D R env. induction e; cbn [eval symbolic_expression].
  - simpl. intros x X. injection X as <-. rewrite ev_constant. reflexivity.
  - destruct (ground env ts); [apply symbolic_value_ok, D|exact eq_refl].
  - exact R.
  - apply agrees_plus; auto. intros. ring.
  - apply agrees_plus; auto. intros. ring.
  - destruct (symbolic_expression P N s r env e1) as [| |[[|t l] x]],
      (symbolic_expression P N s r env e2) as [| |[[|u l'] y]]; simpl in *; auto;
      try (rewrite IHe1; reflexivity); try (rewrite IHe2; destruct (eval w d env e1); reflexivity);
      intros q E; destruct (eval w d env e1) as [a|]; try discriminate; destruct (eval w d env e2) as [b|];
        try discriminate;
      simpl in E; injection E as <-; rewrite ev_plus_form, ev_constant, (IHe1 a eq_refl), (IHe2 b eq_refl),
        ?ev_empty; ring.
  - destruct (symbolic_expression P N s r env e1) as [| |x],
      (symbolic_expression P N s r env e2) as [| |[[|u l'] y]]; simpl in *; auto;
      try (rewrite IHe1; destruct (eval w d env e2); [destruct (Qeq_bool _ 0)|]; reflexivity);
      try (rewrite IHe2; reflexivity).
    destruct (Qeq_bool y 0) eqn:Z; simpl.
    + destruct (eval w d env e2) as [b|]; [|reflexivity].
      rewrite (Qeqb_comp b y (IHe2 b eq_refl : b == y) 0 0 (Qeq_refl 0)).
      rewrite Z. reflexivity.
    + intros q E. destruct (eval w d env e2) as [b|]; [|discriminate].
      rewrite (Qeqb_comp b y (IHe2 b eq_refl : b == y) 0 0 (Qeq_refl 0)) in E.
      rewrite Z in E. destruct (eval w d env e1) as [a|]; [|discriminate]. simpl in E. injection E as <-.
      rewrite ev_plus_form, ev_constant, (IHe1 a eq_refl), (IHe2 b eq_refl), ev_empty. unfold Qdiv. ring.
Qed.

Lemma implied_ok : forall st f, implied k st f = true -> if st : bool then 0 < ev w0 f else 0 <= ev w0 f.
Proof.
  intros st f H. unfold implied in H. apply orb_true_iff in H. destruct H as [H|H].
  - apply existsb_exists in H. destruct H as [[sb b] [I H]]. cbn [fst snd] in H.
    assert (B : if sb : bool then 0 < ev w0 b else 0 <= ev w0 b).
    { destruct I as [I|I]; [injection I as <- <-; rewrite ev_constant; lra|]. apply known, I. }
    pose proof (ev_plus_form w0 f (-1 # 1) b) as E.
    destruct (plus_form f (-1 # 1) b) as [[|] c]; [|discriminate].
    rewrite ev_empty in E.
    destruct st, sb; simpl in H; try (apply less_spec in H); try (apply Qle_bool_iff in H); lra.
  - destruct f as [[|] c]; [|discriminate]. apply andb_true_iff in H. destruct H as [S H]. subst st.
    apply less_spec in H. rewrite ev_empty. exact H.
Qed.
Lemma all_kleene_fold : forall X (t : X -> option bool) l,
  all_kleene t l = fold_right (fun x r => and_kleene (t x) r) (Some true) l.
Proof. induction l as [|x l IH]; cbn; [reflexivity|]. rewrite IH. destruct (t x) as [[]|]; reflexivity. Qed.
Lemma symbolic_truth_ok : forall w s d r, Describes w0 w s -> agrees w0 d r ->
  forall f env b, symbolic_truth P T N k s r env f = Some b -> truth P w d env f <> Some (negb b).
Proof.
  intros w s d r D R. induction f; intros env v H; cbn [symbolic_truth truth] in *.
  - injection H as <-. destruct b; discriminate.
  - destruct (ground env ts); [|discriminate]. apply (symbolic_atom_ok w) in H; [|exact D]. rewrite H.
    destruct v; discriminate.
  - destruct (object_of env t); [|discriminate]. destruct (object_of env u); [|discriminate].
    injection H as <-. destruct (Pos.eqb _ _); discriminate.
  - pose proof (symbolic_expression_ok w s d r D R env (Minus a b)) as G. cbn [eval] in G.
    unfold symbolic_comparison in H.
    destruct (eval w d env a) as [x|]; [|discriminate]. destruct (eval w d env b) as [y|]; [|discriminate].
    cbn [lift] in G.
    destruct (symbolic_expression P N s r env (Minus a b)) as [| |g]; unfold agrees in G;
      cbn [agrees symbolic_comparison] in *; try discriminate.
    specialize (G _ eq_refl). destruct (implied k strict g) eqn:I.
    + injection H as <-. apply implied_ok in I. intro E. injection E as E.
      destruct strict; [apply less_false in E|apply le_false in E]; lra.
    + destruct (implied k (negb strict) _) eqn:J; [|discriminate]. injection H as <-. apply implied_ok in J.
      intro E. injection E as E.
      destruct strict; cbn [negb] in J, E; rewrite ev_plus_form, ev_constant in J;
        [apply less_spec in E|apply Qle_bool_iff in E]; lra.
  - destruct (symbolic_truth P T N k s r env f) as [x|] eqn:E; [|discriminate]. simpl in H. injection H as <-.
    specialize (IHf env x E).
    destruct (truth P w d env f) as [[]|]; destruct x; simpl in *; congruence.
  - destruct (symbolic_truth P T N k s r env f1) as [[]|] eqn:E1.
    1: pose proof (IHf1 env _ E1); destruct (symbolic_truth P T N k s r env f2) as [[]|] eqn:E2; simpl in H;
         try discriminate.
    1,2: pose proof (IHf2 env _ E2). 
    all: try (pose proof (IHf1 env _ E1)).
    all: try (destruct (symbolic_truth P T N k s r env f2) as [[]|] eqn:E3; simpl in H; try discriminate;
           pose proof (IHf2 env _ E3)).
    all: injection H as <-; destruct (truth P w d env f1) as [[]|], (truth P w d env f2) as [[]|];
           simpl in *; congruence.
  - rewrite all_kleene_fold in H.
    revert v H. induction (objects P type) as [|o os IH]; intros v H; cbn [fold_right] in *;
      [injection H as <-; discriminate|].
    pose proof (fun v => IHf (env ++ [o]) v) as A. revert v H A.
    generalize (symbolic_truth P T N k s r (env ++ [o]) f) as x. generalize (truth P w d (env ++ [o]) f) as t.
    revert IH.
    generalize (fold_right (fun o r0 => and_kleene (symbolic_truth P T N k s r (env ++ [o]) f) r0)
      (Some true) os) as y.
    generalize (fold_right (fun o r0 => and_kleene (truth P w d (env ++ [o]) f) r0) (Some true) os) as u.
    intros u y B t x v H A.
    destruct x as [x|]; [specialize (A x eq_refl)|clear A];
      (destruct y as [y|]; [specialize (B y eq_refl)|clear B]);
      try destruct x; try destruct y; simpl in *; try discriminate; injection H as <-;
        destruct t as [[]|], u as [[]|]; simpl in *; congruence.
Qed.

(* Effects *)
Definition matches (c : change) (s : symbolic_change) : Prop :=
  match c, s with
  | Fact a b, SFact a' b' => a = a' /\ b = b'
  | Number f b q, SNumber f' b' g => f = f' /\ b = b' /\ q == ev w0 g
  | _, _ => False
  end.
Lemma both_ok : forall (a b : option (list change)) (c d : option (list symbolic_change)),
  (forall cs ss, a = Some cs -> c = Some ss -> Forall2 matches cs ss) ->
    (forall cs ss, b = Some cs -> d = Some ss -> Forall2 matches cs ss) ->
  forall cs ss, both a b = Some cs -> both c d = Some ss -> Forall2 matches cs ss.
Proof.
  intros [a|] [b|] [c|] [d|] A B cs ss H K; try discriminate. injection H as <-. injection K as <-.
  apply Forall2_app; auto.
Qed.
Lemma symbolic_changes_ok : forall w s d r, Describes w0 w s -> agrees w0 d r -> forall e env cs ss,
  changes P w d env e = Some cs -> symbolic_changes P T N k s r env e = Some ss -> Forall2 matches cs ss.
Proof.
  intros w s d r D R. induction e; intros env cs ss H K; cbn [changes symbolic_changes] in *.
  - injection H as <-. injection K as <-. constructor.
  - destruct (ground env ts); [|discriminate]. injection H as <-. injection K as <-.
    constructor; [split; reflexivity|constructor].
  - destruct (ground env ts); [|discriminate]. pose proof (symbolic_expression_ok w s d r D R env e) as G.
    destruct (eval w d env e) as [q|]; [|discriminate].
    destruct (symbolic_expression P N s r env e) as [| |g]; try discriminate.
    injection H as <-. injection K as <-. constructor; [|constructor]. simpl. repeat split. apply G.
    reflexivity.
  - eapply both_ok; [| |exact H|exact K]; intros; [eapply IHe1|eapply IHe2]; eassumption.
  - destruct (symbolic_truth P T N k s r env f) as [b|] eqn:E; [|discriminate].
    apply (symbolic_truth_ok w s d r D R) in E.
    destruct (truth P w d env f) as [[]|]; [| |discriminate]; destruct b; simpl in E; try congruence.
    + eapply IHe; eassumption.
    + injection H as <-. injection K as <-. constructor.
  - revert cs ss H K. induction (objects P type) as [|o os IH]; intros cs ss H K; cbn [fold_right] in *.
    + injection H as <-. injection K as <-. constructor.
    + eapply both_ok; [| |exact H|exact K]; [intros; eapply IHe; eassumption|exact IH].
Qed.
Lemma targets_same : forall cs ss, Forall2 matches cs ss -> changed_fluents cs = symbolic_changed_fluents ss.
Proof. induction 1 as [|c s cs ss M F IH]; [reflexivity|].
destruct c, s; simpl in *; try contradiction; [exact IH|]. destruct M as [-> _]. f_equal. exact IH. Qed.
Lemma changes_of_same : forall f cs ss, Forall2 matches cs ss ->
  Forall2 (fun a b => fst a = fst b /\ snd a == ev w0 (snd b)) (changes_of f cs) (symbolic_changes_of f ss).
Proof.
  intros f. induction 1 as [|c s cs ss M F IH]; [constructor|].
  destruct c, s; simpl in *; try contradiction; [exact IH|].
  destruct M as [-> [-> M]].
  destruct (atom_eqb f a0); [constructor; [split; [reflexivity|exact M]|exact IH]|exact IH].
Qed.
Lemma sum_ok : forall l m x g, Forall2 (fun (a : bool * Q) b => fst a = fst b /\
  snd a == ev w0 (snd b)) l m -> x == ev w0 g ->
  fold_left (fun s c => Qred (s + snd c)) l x == ev w0 (fold_left (fun s c => plus_form s 1 (snd c)) m g).
Proof.
  intros l m x g F. revert x g.
  induction F as [|a b l m [_ H] F IH]; intros x g G; cbn [fold_left]; [exact G|].
  apply IH. rewrite Qred_correct, ev_plus_form, G, H. ring.
Qed.
Lemma changed_ok : forall l m old r q g, Forall2 (fun (a : bool * Q) b => fst a = fst b /\
  snd a == ev w0 (snd b)) l m -> agrees w0 old r ->
  changed_value old l = Some q -> symbolic_new_value r m = Some g -> q == ev w0 g.
Proof.
  intros l m old r q g F A H K. destruct F as [|[b x] [b' y] l m [E1 E2] F]; [discriminate|]. simpl in E1, E2.
  subst b'.
  destruct b.
  - destruct m; [|discriminate]. inversion F; subst. simpl in *. injection H as <-. injection K as <-.
    exact E2.
  - cbn [changed_value symbolic_new_value] in *. destruct (existsb fst ((false, x) :: l)) ; [discriminate|].
    destruct old as [o|]; [|discriminate]. destruct (existsb fst ((false, y) :: m)); [discriminate|].
    destruct r as [| |z]; try discriminate.
    injection H as <-. injection K as <-. apply (sum_ok ((false, x) :: l) ((false, y) :: m)).
    + constructor; [split; [reflexivity|exact E2]|exact F].
    + apply A. reflexivity.
Qed.
Lemma updates_ok : forall w s cs ss, Describes w0 w s -> Forall2 matches cs ss -> forall fs l m,
  updates w cs fs = Some l -> symbolic_updates P N s ss fs = Some m ->
  forall f, match assoc f m with Some g => exists q, assoc f l = Some q /\ q == ev w0 g
    | None => assoc f l = None end.
Proof.
  intros w s cs ss D F. induction fs as [|h fs IH]; intros l m H K f; cbn [updates symbolic_updates] in *.
  - injection H as <-. injection K as <-. reflexivity.
  - destruct (changed_value _ _) as [q|] eqn:E1; [|discriminate].
    destruct (updates w cs fs) as [l'|]; [|discriminate]. injection H as <-.
    destruct (symbolic_new_value _ _) as [g|] eqn:E2; [|discriminate].
    destruct (symbolic_updates P N s ss fs) as [m'|]; [|discriminate]. injection K as <-.
    simpl. destruct (atom_eqb f h); [|apply IH; reflexivity]. exists q. split; [reflexivity|].
    eapply changed_ok; [apply changes_of_same, F|apply symbolic_value_ok, D|exact E1|exact E2].
Qed.
Lemma truths_ok : forall a b cs ss, Forall2 matches cs ss ->
  assoc a (atoms_set_to ss b) = if sets_atom cs a b then Some b else None.
Proof.
  intros a b. induction 1 as [|c s cs ss M F IH]; [reflexivity|]. unfold sets_atom, atoms_set_to in *.
  cbn [flat_map existsb].
  destruct c as [x y|], s as [x' y'|]; simpl in M; try contradiction; cbn [orb app].
  - destruct M as [<- <-].
    destruct (Bool.eqb b y); simpl; [rewrite andb_true_r; destruct (atom_eqb a x); [reflexivity|exact IH]|].
    rewrite andb_false_r. exact IH.
  - exact IH.
Qed.
Lemma needs_undefined_ok : forall w s d r, Describes w0 w s -> agrees w0 d r -> forall e env,
  needs_undefined P T N k s r env e = true -> changes P w d env e = None.
Proof.
  intros w s d r D R. induction e; intros env H; cbn [needs_undefined changes] in *; try discriminate.
  - destruct (ground env ts); [|reflexivity]. pose proof (symbolic_expression_ok w s d r D R env e) as G.
    destruct (symbolic_expression P N s r env e); try discriminate. unfold agrees in G. rewrite G.
    reflexivity.
  - apply orb_true_iff in H. destruct H as [H|H].
    + rewrite (IHe1 _ H). reflexivity.
    + rewrite (IHe2 _ H). destruct (changes P w d env e1); reflexivity.
  - destruct (symbolic_truth P T N k s r env f) as [[]|] eqn:E; try discriminate.
    apply (symbolic_truth_ok w s d r D R) in E.
    destruct (truth P w d env f) as [[]|]; [apply IHe, H|exfalso; apply E; reflexivity|reflexivity].
  - induction (objects P type) as [|o os IH]; [discriminate|]. cbn [existsb fold_right] in *.
    apply orb_true_iff in H. destruct H as [H|H].
    + rewrite (IHe _ H). reflexivity.
    + rewrite (IH H). destruct (changes P w d (env ++ [o]) e); reflexivity.
Qed.
Lemma symbolic_happening_ok : forall w s d r t env f e w', Describes w0 w s -> agrees w0 d r ->
  happening P w d env f e = Some w' ->
  match symbolic_happening P T N k s r t env f e with Never => False | Unclear => True
    | After s' t' => t' = t /\ Describes w0 w' s' end.
Proof.
  intros w s d r t env f e w' D R H. unfold happening in H.
  destruct (truth P w d env f) as [[]|] eqn:E; try discriminate.
  destruct (changes P w d env e) as [cs|] eqn:C; [|discriminate].
  destruct (updates w cs (changed_fluents cs)) as [l|] eqn:U; [|discriminate].
  injection H as <-. unfold symbolic_happening. destruct (symbolic_truth P T N k s r env f) as [[]|] eqn:E3.
  2: { apply (symbolic_truth_ok w s d r D R) in E3. apply E3. exact E. }
  all: destruct (needs_undefined P T N k s r env e) eqn:NU;
         [rewrite (needs_undefined_ok w s d r D R e env NU) in C; discriminate C|].
  all: destruct (symbolic_changes P T N k s r env e) as [ss|] eqn:C3; [|exact I];
    pose proof (symbolic_changes_ok w s d r D R e env cs ss C C3) as F; rewrite (targets_same _ _ F) in U;
    destruct (symbolic_updates P N s ss (symbolic_changed_fluents ss)) as [m|] eqn:U3; [|exact I]; split;
      [reflexivity|]; split; cbn [holds_in value_in new_truths new_values].
  1,3: intros a St; rewrite !assoc_app, !(truths_ok _ _ _ _ F), (d_fact _ _ _ _ D a St); destruct (sets_atom cs a true);
         [reflexivity|];
       destruct (sets_atom cs a false); [reflexivity|]; reflexivity.
  all: intro g; rewrite assoc_app; pose proof (updates_ok w s cs ss D F _ l m U U3 g) as Q;
         destruct (assoc g m);
       [destruct Q as [q [Q1 Q2]]; exists q; rewrite Q1; split; [reflexivity|exact Q2]|rewrite Q;
         apply (d_value _ _ _ _ D)].
Qed.
Lemma symbolic_duration_ok : forall a env e d, duration a = Some e -> eval w0 None env e = Some d ->
  agrees w0 (Some d) (symbolic_duration P N a env).
Proof. intros a env e d A E. unfold symbolic_duration. rewrite A, <- E.
apply symbolic_expression_ok; [apply describes_itself|exact eq_refl]. Qed.
Lemma make_stale_ok : forall w s, Describes w0 w s -> Describes w0 (derived_world P w) (make_stale s).
Proof.
  intros w s D. split; [|exact (d_value _ _ _ _ D)]. intros a St. unfold is_stale in St. cbn [make_stale stale] in St.
  cbn [derived_world with_facts holds_in]. cbn [andb] in St. rewrite St.
  apply (d_fact _ _ _ _ D). unfold is_stale. rewrite St, andb_false_r. reflexivity.
Qed.
Lemma symbolic_step_ok : forall a env w' d, step P true w0 a env = Some (w', d) ->
  match symbolic_step P T N k a env with Never => False | Unclear => True
    | After s t => t == d /\ Describes w0 w' s end.
Proof.
  intros a env w' d H. unfold step in H. destruct (negb _); [discriminate|]. unfold symbolic_step.
  destruct (duration a) as [e|] eqn:A.
  2: { destruct (happening P w0 None env (at_start a) (start_effect a)) as [x|] eqn:E; [|discriminate].
       injection H as <- <-.
       apply (symbolic_happening_ok w0 unchanged None Undefined 0) in E;
         [|apply describes_itself|exact eq_refl].
       destruct (symbolic_happening _ _ _ _ _ _ _ _ _ _); auto. destruct E as [-> E].
       split; [reflexivity|exact E]. }
  destruct (eval w0 None env e) as [q|] eqn:Ev; [|discriminate].
  pose proof (symbolic_duration_ok a env e q A Ev) as L.
  destruct (symbolic_duration P N a env) as [| |[[|t l] c]]; try exact I; [discriminate L|].
  specialize (L q eq_refl). rewrite ev_empty in L.
  assert (R : agrees w0 (Some q) (Is (constant c))) by (simpl; intros x X; injection X as <-;
    rewrite ev_constant; exact L).
  assert (L1 : less q 0 = less c 0) by (unfold less; rewrite (Qleb_comp 0 0 (Qeq_refl 0) q c L); reflexivity).
  rewrite L1 in H.
  destruct (less c 0); [discriminate|].
  rewrite (Qeqb_comp q c L 0 0 (Qeq_refl 0)) in H. destruct (Qeq_bool c 0).
  - match type of H with option_map _ ?h = _ => destruct h as [x|] eqn:E end; [|discriminate].
    injection H as <- <-.
    apply (symbolic_happening_ok w0 unchanged (Some q) (Is (constant c)) c) in E;
      [|apply describes_itself|exact R].
    destruct (symbolic_happening _ _ _ _ _ _ _ _ _ _); auto. destruct E as [-> E].
    split; [symmetry; exact L|exact E].
  - destruct (happening P w0 (Some q) env (at_start a) (start_effect a)) as [w1|] eqn:E1; [|discriminate].
    apply (symbolic_happening_ok w0 unchanged (Some q) (Is (constant c)) c) in E1;
      [|apply describes_itself|exact R].
    destruct (symbolic_happening _ _ _ _ _ _ _ _ _ _) as [| |s1 t1]; auto. destruct E1 as [_ E1].
    match type of H with option_map _ ?h = _ => destruct h as [x|] eqn:E end; [|discriminate].
    injection H as <- <-.
    apply (symbolic_happening_ok _ (make_stale s1) (Some q) (Is (constant c)) c) in E;
      [|apply make_stale_ok, E1|exact R].
    destruct (symbolic_happening _ _ _ _ _ _ _ _ _ _); auto. destruct E as [-> E].
    split; [symmetry; exact L|exact E].
Qed.

(* Projections *)
Definition kept (keep : atom -> bool) (with_numbers : bool) (c : change) : bool :=
  match c with Fact a _ => keep a | Number _ _ _ => with_numbers end.
Lemma both_filter : forall f (a b : option (list change)) (c d : option (list symbolic_change)),
  (forall cs ss, a = Some cs -> c = Some ss -> Forall2 matches (filter f cs) ss) ->
  (forall cs ss, b = Some cs -> d = Some ss -> Forall2 matches (filter f cs) ss) ->
  forall cs ss, both a b = Some cs -> both c d = Some ss -> Forall2 matches (filter f cs) ss.
Proof.
  intros f [a|] [b|] [c|] [d|] A B cs ss H K; try discriminate. injection H as <-. injection K as <-.
  rewrite filter_app. apply Forall2_app; auto.
Qed.
Lemma projected_matches : forall keep n e env cs ss, changes P w0 None env e = Some cs ->
  projected P T N keep n k env e = Some ss -> Forall2 matches (filter (kept keep n) cs) ss.
Proof.
  intros keep n. induction e; intros env cs ss H K; cbn [changes projected] in *.
  - injection H as <-. injection K as <-. constructor.
  - destruct (ground env ts); [|discriminate]. injection H as <-. injection K as <-. cbn [filter kept].
    destruct (keep _); [constructor; [split; reflexivity|constructor]|constructor].
  - destruct (ground env ts); [|discriminate].
    destruct (eval w0 None env e) as [q|] eqn:Ev; [|discriminate]. injection H as <-. cbn [filter kept].
    destruct n; [|injection K as <-; constructor].
    pose proof (symbolic_expression_ok w0 unchanged None Undefined (describes_itself P w0) eq_refl env e) as G.
    destruct (symbolic_expression P N unchanged Undefined env e) as [| |g]; try discriminate.
    injection K as <-. constructor; [|constructor]. simpl. repeat split. apply G. exact Ev.
  - eapply both_filter; [| |exact H|exact K]; intros; [eapply IHe1|eapply IHe2]; eassumption.
  - assert (K' : projected P T N keep n k env e = Some [] /\ ss = [] \/
      exists b, symbolic_truth P T N k unchanged Undefined env f = Some b /\
                if b then projected P T N keep n k env e = Some ss else ss = []).
    { destruct (projected P T N keep n k env e) as [[|]|]; [left; split; congruence| |];
        right; destruct (symbolic_truth P T N k unchanged Undefined env f) as [[]|]; try discriminate;
        eexists; (split; [reflexivity|]); cbv iota; congruence. }
    destruct K' as [[Pr ->]|[b [E Pr]]].
    + destruct (truth P w0 None env f) as [[]|]; [| |discriminate].
      * eapply IHe; eassumption.
      * injection H as <-. constructor.
    + apply (symbolic_truth_ok w0 unchanged None Undefined (describes_itself P w0) eq_refl) in E.
      destruct (truth P w0 None env f) as [[]|]; [| |discriminate]; destruct b; simpl in E; try congruence.
      * eapply IHe; eassumption.
      * injection H as <-. subst ss. constructor.
  - revert cs ss H K. induction (objects P type) as [|o os IH]; intros cs ss H K; cbn [fold_right] in *.
    + injection H as <-. injection K as <-. constructor.
    + eapply both_filter; [| |exact H|exact K]; [intros; eapply IHe; eassumption|exact IH].
Qed.
Lemma both_in : forall X (a b : option (list change)) (c d : option (list X)) (Q : change -> list X -> Prop),
  (forall c l m, Q c l -> Q c (l ++ m)) -> (forall c l m, Q c m -> Q c (l ++ m)) ->
  (forall cs l, a = Some cs -> c = Some l -> forall x, In x cs -> Q x l) ->
  (forall cs l, b = Some cs -> d = Some l -> forall x, In x cs -> Q x l) ->
  forall cs l, both a b = Some cs -> both c d = Some l -> forall x, In x cs -> Q x l.
Proof.
  intros X [a|] [b|] [c|] [d|] Q L M A B cs l H K x I; try discriminate. injection H as <-. injection K as <-.
  apply in_app_or in I. destruct I as [I|I]; [apply L; eapply A|apply M; eapply B]; eauto.
Qed.
Definition listed (c : change) (l : list (atom * bool)) : Prop := forall a b, c = Fact a b -> In (a, b) l.
Lemma possible_facts_ok : forall e env cs l, changes P w0 None env e = Some cs ->
  possible_facts P T N k env e = Some l -> forall c, In c cs -> listed c l.
Proof.
  assert (L : forall c l m, listed c l -> listed c (l ++ m)) by (intros c l m H a b E; apply in_or_app; left;
    apply H, E).
  assert (M : forall c l m, listed c m -> listed c (l ++ m)) by (intros c l m H a b E; apply in_or_app;
    right; apply H, E).
  induction e; intros env cs l H K; cbn [changes possible_facts] in *.
  - injection H as <-. intros c [].
  - destruct (ground env ts); [|discriminate]. injection H as <-. injection K as <-.
    intros c [<-|[]] a b E. injection E as <- <-. left. reflexivity.
  - destruct (ground env ts); [|discriminate]. destruct (eval w0 None env e); [|discriminate].
    injection H as <-.
    intros c [<-|[]] a b E. discriminate.
  - eapply (both_in _ _ _ _ _ listed L M); [| |exact H|exact K]; intros; [eapply IHe1|eapply IHe2];
      eassumption.
  - destruct (symbolic_truth P T N k unchanged Undefined env f) as [b|] eqn:E.
    + apply (symbolic_truth_ok w0 unchanged None Undefined (describes_itself P w0) eq_refl) in E.
      destruct (truth P w0 None env f) as [[]|]; [| |discriminate]; destruct b; simpl in E; try congruence.
      * eapply IHe; eassumption.
      * injection H as <-. intros c [].
    + destruct (truth P w0 None env f) as [[]|]; [| |discriminate].
      * eapply IHe; eassumption.
      * injection H as <-. intros c [].
  - revert cs l H K. induction (objects P type) as [|o os IH]; intros cs l H K; cbn [fold_right] in *.
    + injection H as <-. intros c [].
    + eapply (both_in _ _ _ _ _ listed L M); [| |exact H|exact K]; [intros; eapply IHe; eassumption|exact IH].
Qed.

(* The world after an instantaneous action, by its changes *)
Lemma happening_changes : forall env f e w', happening P w0 None env f e = Some w' ->
  exists cs l, changes P w0 None env e = Some cs /\ updates w0 cs (changed_fluents cs) = Some l /\
    (forall a, holds_in w' a = sets_atom cs a true || (negb (sets_atom cs a false) && holds_in w0 a)) /\
    (forall g, value_in w' g = match assoc g l with Some q => Some q | None => value_in w0 g end).
Proof.
  intros env f e w' H. unfold happening in H. destruct (truth P w0 None env f) as [[]|]; try discriminate.
  destruct (changes P w0 None env e) as [cs|]; [|discriminate].
  destruct (updates w0 cs (changed_fluents cs)) as [l|] eqn:U; [|discriminate]. injection H as <-.
  exists cs, l. split; [reflexivity|]. split; [exact U|]. split; reflexivity.
Qed.
Lemma sets_atom_filter : forall keep n a b cs, keep a = true ->
  sets_atom (filter (kept keep n) cs) a b = sets_atom cs a b.
Proof.
  intros keep n a b cs Ka. unfold sets_atom. induction cs as [|c cs IH]; [reflexivity|]. cbn [filter].
  destruct c as [x y|x y z]; cbn [kept].
  - destruct (keep x) eqn:Kx; cbn [existsb]; [rewrite IH; reflexivity|].
    destruct (atom_eqb a x) eqn:E; [apply atom_eqb_eq in E; congruence|]. exact IH.
  - destruct n; cbn [existsb orb]; exact IH.
Qed.
Lemma projected_facts : forall keep n env f e w' ss, happening P w0 None env f e = Some w' ->
  projected P T N keep n k env e = Some ss -> forall a, keep a = true ->
  holds_in w' a = match assoc a (truths_of ss) with Some b => b | None => holds_in w0 a end.
Proof.
  intros keep n env f e w' ss H Pr a Ka. destruct (happening_changes _ _ _ _ H) as [cs [l [C [_ [F _]]]]].
  pose proof (projected_matches _ _ _ _ _ _ C Pr) as M. rewrite F. unfold truths_of.
  rewrite assoc_app, !(truths_ok _ _ _ _ M), !sets_atom_filter by exact Ka.
  destruct (sets_atom cs a true); [reflexivity|]. destruct (sets_atom cs a false); reflexivity.
Qed.
Lemma untouched : forall env f e w' l, happening P w0 None env f e = Some w' ->
  possible_facts P T N k env e = Some l -> forall a, (forall b, ~ In (a, b) l) ->
    holds_in w' a = holds_in w0 a.
Proof.
  intros env f e w' l H Po a No. destruct (happening_changes _ _ _ _ H) as [cs [m [C [_ [F _]]]]]. rewrite F.
  assert (Z : forall b, sets_atom cs a b = false).
  { intro b. destruct (sets_atom cs a b) eqn:E; [|reflexivity]. exfalso. unfold sets_atom in E.
    apply existsb_exists in E. destruct E as [[x y|] [I E]]; [|discriminate]. apply andb_true_iff in E.
    destruct E as [E _]. apply atom_eqb_eq in E. subst x.
    apply (No y). exact (possible_facts_ok _ _ _ _ C Po _ I a y eq_refl). }
  rewrite !Z. reflexivity.
Qed.
Lemma added : forall env f e w' l, happening P w0 None env f e = Some w' ->
  possible_facts P T N k env e = Some l -> forall a, holds_in w' a = true ->
    holds_in w0 a = true \/ In (a, true) l.
Proof.
  intros env f e w' l H Po a Ha. destruct (happening_changes _ _ _ _ H) as [cs [m [C [_ [F _]]]]].
  rewrite F in Ha.
  apply orb_true_iff in Ha. destruct Ha as [Ha|Ha]; [right|left].
  - unfold sets_atom in Ha. apply existsb_exists in Ha. destruct Ha as [[x y|] [I E]]; [|discriminate].
    apply andb_true_iff in E. destruct E as [E B]. apply atom_eqb_eq in E. subst x.
    destruct y; [|discriminate].
    exact (possible_facts_ok _ _ _ _ C Po _ I a true eq_refl).
  - apply andb_true_iff in Ha. apply Ha.
Qed.
Lemma projected_numbers : forall env f e w' ss l, happening P w0 None env f e = Some w' ->
  projected P T N (fun _ => false) true k env e = Some ss ->
  symbolic_updates P N unchanged ss (symbolic_changed_fluents ss) = Some l ->
  forall g, match assoc g l with Some h => exists q, value_in w' g = Some q /\ q == ev w0 h
            | None => value_in w' g = value_in w0 g end.
Proof.
  intros env f e w' ss l H Pr U g. destruct (happening_changes _ _ _ _ H) as [cs [m [C [Um [_ V]]]]].
  pose proof (projected_matches _ _ _ _ _ _ C Pr) as M.
  set (fs := filter (kept (fun _ => false) true) cs) in *.
  assert (A : changed_fluents fs = changed_fluents cs).
  { subst fs. clear. induction cs as [|[x y|x y z] cs IH]; cbn [filter kept changed_fluents];
      [reflexivity|exact IH|].
    f_equal. exact IH. }
  assert (B : forall h, changes_of h fs = changes_of h cs).
  { intro h. subst fs. clear.
    induction cs as [|[x y|x y z] cs IH]; cbn [filter kept changes_of flat_map]; [reflexivity|exact IH|].
    f_equal. exact IH. }
  assert (D : forall hs, updates w0 fs hs = updates w0 cs hs).
  { induction hs as [|h hs IH]; cbn [updates]; [reflexivity|]. rewrite B, IH. reflexivity. }
  rewrite (targets_same _ _ M) in A. rewrite <- A, <- D in Um.
  pose proof (updates_ok w0 unchanged fs ss (describes_itself P w0) M _ _ _ Um U g) as Q. rewrite V.
  destruct (assoc g l) as [h|];
    [destruct Q as [q [Q1 Q2]]; exists q; rewrite Q1; split; [reflexivity|exact Q2]|].
  rewrite Q. reflexivity.
Qed.
End Evaluation.
