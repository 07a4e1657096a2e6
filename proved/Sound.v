(* Theorem [sound]: an accepted argument bounds the cost of every plan of the ground task, by
   induction over the plan. *)
From Coq Require Import ZArith List Bool FMapPositive Lia.
From Proved Require Import Task Check Proof.
Import ListNotations.
Open Scope Z_scope.

(* No operator whose facts a state has is left out. *)
Lemma with_fact_add : forall f p m g, with_fact (add_front f p m) g =
  if Pos.eqb (fst f) (fst g) && Pos.eqb (slot (snd f)) (slot (snd g)) then p :: with_fact m f else with_fact m g.
Proof.
  intros f p m g. unfold with_fact at 1, add_front, row at 1. destruct (Pos.eqb_spec (fst f) (fst g)) as [->|D].
  - rewrite M.gss. destruct (Pos.eqb_spec (slot (snd f)) (slot (snd g))) as [->|E]; cbn [andb].
    + rewrite M.gss. reflexivity.
    + rewrite M.gso by congruence. reflexivity.
  - rewrite M.gso by congruence. reflexivity.
Qed.
Lemma rarest_In : forall m fs f, rarest m fs = Some f -> In f fs.
Proof.
  induction fs as [|g r IH]; intros f H; [discriminate|]. simpl in H. destruct (rarest m r) as [h|].
  - destruct (_ <? _); injection H as <-; [left; reflexivity|right; apply IH; reflexivity].
  - injection H as <-. left. reflexivity.
Qed.
Lemma index_complete : forall m ps p, In p ps ->
  match rarest m (facts (precondition (fst p))) with
  | None => In p (fst (index_fronts m ps))
  | Some f => In p (with_fact (snd (index_fronts m ps)) f)
  end.
Proof.
  induction ps as [|q r IH]; intros p I; [destruct I|]. simpl.
  destruct (index_fronts m r) as [others by_fact]. cbn [fst snd] in IH. destruct I as [->|I].
  - destruct (rarest m (facts (precondition (fst p)))) as [f|]; cbn [fst snd]; [|left; reflexivity].
    rewrite with_fact_add, !Pos.eqb_refl. left. reflexivity.
  - specialize (IH p I). destruct (rarest m (facts (precondition (fst p)))) as [f|],
      (rarest m (facts (precondition (fst q)))) as [g|]; cbn [fst snd]; auto; [|right; exact IH].
    rewrite with_fact_add. destruct (Pos.eqb_spec (fst g) (fst f)) as [E|]; [|exact IH].
    destruct (Pos.eqb_spec (slot (snd g)) (slot (snd f))) as [E2|]; [|exact IH]. right.
    unfold with_fact in *. rewrite E, E2. exact IH.
Qed.
Lemma applicable_complete : forall m ps s p, In p ps -> holds_facts (precondition (fst p)) s = true ->
  In p (applicable (fst (index_fronts m ps)) (M.elements (snd (index_fronts m ps))) s).
Proof.
  intros m ps s p I H. pose proof (index_complete m ps p I) as C. unfold applicable. apply in_or_app.
  destruct (rarest m (facts (precondition (fst p)))) as [f|] eqn:E; [|left; exact C]. right.
  apply rarest_In in E. unfold holds_facts in H. apply andb_true_iff in H. destruct H as [H _].
  rewrite forallb_forall in H. specialize (H f E). unfold is_fact in H. apply Z.eqb_eq in H.
  apply in_flat_map. unfold with_fact, row in C. destruct (M.find (fst f) (snd (index_fronts m ps))) as [r|] eqn:F.
  - exists (fst f, r). split; [apply M.elements_correct, F|]. cbn [fst snd]. rewrite H. exact C.
  - rewrite M.gempty in C. destruct C.
Qed.

Section Main.
Variables (T : task) (A : argument) (claim : option Z) (oracle : state -> list positive).
Notation mono := (is_monotone T).

Definition reached (total : Z) : Prop := match claim with Some c => c <= total | None => False end.

Hypothesis task_ok : check_task T = true.
Lemma heads : forallb (forallb (fun r : fact * condition =>
  negb (is_basic T (fst (fst r))))) (layers T) = true.
Proof. unfold check_task in task_ok. rewrite !andb_true_iff in task_ok. tauto. Qed.
Lemma deriveds : forallb (fun d : key * Z => negb (is_basic T (fst d))) (derived T) = true.
Proof. unfold check_task in task_ok. rewrite !andb_true_iff in task_ok. tauto. Qed.

Hypothesis pots_ok : forallb (check_potential T (map prepare (operators T))) (potentials A) = true.
Hypothesis needs_ok : forallb (check_need T (map prepare (operators T))) (needs A) = true.
Variable frequency_of : M.t (M.t Z).
Notation index := (index_fronts frequency_of (map (fun o => (o, undominated_choices mono o)) (operators T))).
Hypothesis labels_ok : forallb (fun il => check_label T A claim oracle mono (basics T)
    (applicable (fst index) (M.elements (snd index))) (snd il)) (M.elements (labels A)) = true.

Definition Covered (s : state) (p : Z) : Prop :=
  (exists t, In t (potentials A) /\ potential_prunes T claim s p t = true) \/
  (exists nt, In nt (needs A) /\ need_prunes T s nt = true) \/
  (exists i l, M.find i (labels A) = Some l /\ path_cost l <= p /\ no_worse T mono (label_state l) s).

Lemma covered_Covered : forall s p, covered T A claim oracle mono (basics T) s p = true -> Covered s p.
Proof.
  intros s p H. unfold covered in H. rewrite !orb_true_iff in H. destruct H as [[H|H]|H];
    apply existsb_exists in H; destruct H as [x [I E]].
  - left. exists x. tauto.
  - right. left. exists x. tauto.
  - right. right. destruct (M.find x (labels A)) as [l|] eqn:F; [|discriminate]. exists x, l.
    unfold label_covers in E. rewrite !andb_true_iff in E. destruct E as [[E1 E2] E3].
    split; [exact F|]. split; [lia|]. split.
    + intros v B. rewrite forallb_forall in E2. specialize (E2 v (basics_In T v B)). lia.
    + intros n N. unfold numbers_cover in E3. rewrite forallb_forall in E3. specialize (E3 n N).
      unfold num_value, rel. destruct mono; lia.
Qed.

Lemma rel_trans : forall m a b c, rel m a b -> rel m b c -> rel m a c.
Proof. intros [] a b c; unfold rel; lia. Qed.
Lemma Covered_worse : forall s t p q, Covered s p -> no_worse T mono s t -> p <= q -> Covered t q.
Proof.
  intros s t p q H [V N] L.
  assert (Sh : forall pat, forallb (is_basic T) pat = true -> map (var_value t) pat = map (var_value s) pat).
  { intros pat B. apply map_ext_in. intros v I. symmetry. apply V. rewrite forallb_forall in B. apply B, I. }
  destruct H as [[x [I E]]|[[[n x] [I E]]|[i [l [F [P W]]]]]].
  - left. exists x. split; [exact I|]. unfold potential_prunes in *.
    rewrite Sh.
    + destruct (table_bound T x _); [|reflexivity]. destruct claim; [lia|exact E].
    + rewrite forallb_forall in pots_ok. specialize (pots_ok x I). unfold check_potential in pots_ok.
      rewrite !andb_true_iff in pots_ok. tauto.
  - right. left. exists (n, x). split; [exact I|].
    rewrite forallb_forall in needs_ok. specialize (needs_ok _ I). unfold check_need in needs_ok.
    rewrite !andb_true_iff in needs_ok. destruct needs_ok as [[[[Nn B] _] _] _].
    apply memb_In in Nn. specialize (N n Nn).
    unfold need_prunes in *. cbn [fst snd] in *. rewrite Sh by exact B.
    destruct (table_bound T x _); [|reflexivity]. unfold rel in N. destruct mono; lia.
  - right. right. exists i, l. split; [exact F|]. split; [lia|]. destruct W as [W1 W2]. split.
    + intros v B. rewrite W1 by exact B. apply V, B.
    + intros n I. eapply rel_trans; [apply W2, I|apply N, I].
Qed.

Lemma mono_op : forall o, In o (operators T) -> mono = true ->
  forallb nonneg (comparisons (precondition o)) = true /\
    forallb (fun c => nonneg (snd c)) (number_effects o) = true.
Proof.
  intros o I M. unfold is_monotone in M. rewrite !andb_true_iff in M. destruct M as [[M _] _].
  rewrite forallb_forall in M. specialize (M o I). apply andb_true_iff in M. exact M.
Qed.
Lemma mono_rules : mono = true -> forall ls, In ls (layers T) -> forall r, In r ls ->
  comparisons (snd r) = [].
Proof.
  intros M ls I r R. unfold is_monotone in M. rewrite !andb_true_iff in M. destruct M as [_ M].
  rewrite forallb_forall in M. specialize (M ls I). rewrite forallb_forall in M. specialize (M r R).
  destruct (comparisons (snd r)); [reflexivity|discriminate].
Qed.

Lemma cover_bounds : forall s steps c, plan T s steps c -> wf T s -> forall p, Covered s p -> reached (p + c).
Proof.
  intros s steps c P. induction P as [s HG|s o ch steps c Io Ad Ho P IH]; intros W p C.
  1: pose proof (plan_goal T s HG) as Q. 2: pose proof (plan_step T s o ch steps c Io Ad Ho P) as Q.
  all: destruct C as [[x [I E]]|[[[n x] [I E]]|[i [l [F [L Nw]]]]]].
  1,4: (pose proof (proj1 (forallb_forall _ _) pots_ok x I) as PO;
        destruct (potential_ok T heads deriveds task_ok x PO _ _ _ Q W) as [k [K Le]];
        unfold potential_prunes, shape in *; rewrite K in E; unfold reached; destruct claim;
          [lia|discriminate]).
  1,3: (pose proof (proj1 (forallb_forall _ _) needs_ok _ I) as NO;
        destruct (need_ok T heads deriveds task_ok n x NO _ _ _ Q W) as [k [K [K0 Le]]];
        unfold need_prunes, shape in *; cbn [fst snd] in *; rewrite K in E; exfalso; lia).
  all: pose proof (derive_same T mono mono_rules _ _ Nw) as Sa;
       pose proof (proj1 (forallb_forall _ _) labels_ok _ (M.elements_correct _ _ F)) as LO; cbn [snd] in LO;
       unfold check_label in LO; apply andb_true_iff in LO; destruct LO as [G O].
  - apply negb_true_iff in G.
    assert (Hl : holds (goal T) (derive T (label_state l)) [] [] = true).
    { eapply holds_mono; [|exact Sa|exact HG]. intro M. unfold is_monotone in M.
      rewrite !andb_true_iff in M. tauto. }
    rewrite Hl in G. simpl in G. unfold reached. destruct claim; [lia|discriminate].
  - destruct (front_ok mono o ch Ad) as [ch' [If Nd]].
    assert (Hl : holds (precondition o) (derive T (label_state l)) (slot_sizes o) ch' = true).
    { eapply holds_mono2; [|exact Sa| |exact Ho].
      - intro M. apply (mono_op o Io M).
      - intros lin Il. apply Nd. apply in_or_app. left. exact Il. }
    assert (Hf : holds_facts (precondition o) (derive T (label_state l)) = true).
    { unfold holds in Hl. apply andb_true_iff in Hl. tauto. }
    rewrite forallb_forall in O.
    specialize (O _ (applicable_complete frequency_of _ _ (o, undominated_choices mono o)
      (in_map (fun o => (o, undominated_choices mono o)) _ _ Io) Hf)).
    cbn [fst snd] in O. rewrite Hf in O. rewrite forallb_forall in O. specialize (O ch' If). rewrite Hl in O.
    apply covered_Covered in O.
    replace (p + (amount (cost o) (slot_sizes o) ch + c)) with
      ((p + amount (cost o) (slot_sizes o) ch) + c) by lia.
    apply IH; [apply wf_apply, wf_derive; auto using heads, deriveds|].
    eapply Covered_worse; [exact O| |].
    + apply apply_no_worse; [|exact Sa|exact Nd]. intro M. apply (mono_op o Io M).
    + destruct Nd as [Nd _]. lia.
Qed.
End Main.

(* Every plan of an accepted task costs at least the claimed bound; without a bound, there is no
   plan. *)
Theorem sound : forall T A claim oracle, check T A claim oracle = true ->
  forall steps c, plan T (init T) steps c -> match claim with Some table_bound => table_bound <= c
    | None => False end.
Proof.
  intros T A claim oracle H steps c P. unfold check in H.
  destruct claim as [b|].
  2: destruct (existsb _ _) eqn:E.
  2: { exfalso. (* the goal has an empty clause *)
       assert (G : forall s sz ch, holds (goal T) s sz ch = false).
       { intros. unfold holds, holds_facts. apply existsb_exists in E. destruct E as [cl [I E]].
         destruct cl; [|discriminate].
         replace (forallb (existsb (is_literal s)) (clauses (goal T))) with false;
           [rewrite andb_false_r; reflexivity|].
         symmetry. destruct (forallb _ (clauses (goal T))) eqn:F; [|reflexivity].
         rewrite forallb_forall in F. specialize (F [] I). discriminate. }
       clear -P G. induction P; [rewrite G in H; discriminate|assumption]. }
  all: rewrite !andb_true_iff in H; destruct H as [[[[H1 H2] H3] H4] H5].
  1: replace c with (0 + c) by lia; change (reached (Some b) (0 + c)).
  2: change (reached None (0 + c)).
  all: eapply cover_bounds; eauto; [apply wf_init; auto|eapply covered_Covered; eauto].
Qed.
