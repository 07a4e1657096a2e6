(* Every plan of the PDDL problem is simulated by a plan of the ground task that costs no more. *)
From Coq Require Import ZArith QArith List Bool FMapPositive Lia Lqa Setoid.
From Proved Require Import Task Check Proof Sound Derived Lifted Faithful Symbolic Axioms.
Import ListNotations.
Open Scope Q_scope.

Section Simulation.
Variables (P : problem) (T : task) (N : names) (case : nat -> list key -> case_tree) (goal_case : case_tree).
Hypothesis task_ok : check_task T = true.
Hypothesis ok : faithful P T N case goal_case = true.
Notation Describes := (DescribesIn P).

(* A world with its derived atoms, or with some of them, and a state *)
Record Rel (w : world) (s : state) : Prop := {
  r_var : forall v vals x a, M.find v (variables N) = Some vals -> In (x, a) vals ->
    holds_in w a = Z.eqb (var_value s v) x;
  r_num : forall n f, M.find n (fluents N) = Some f ->
    exists q, value_in w f = Some q /\ q * scaled N == inject_Z (num_value s n);
  r_fact : forall p os, changing N p = false -> holds_in w (p, os) = holds_in (initial P) (p, os);
  r_value : forall f, changing N (fst f) = false -> value_in w f = value_in (initial P) f;
  r_may : forall a, changing N (fst a) = true -> holds_in w a = true -> mem (may_hold N) a = true;
  r_exclusive : forall g a b, In g (exclusive N) -> In a g -> In b g -> holds_in w a = true ->
    holds_in w b = true -> a = b;
  r_derived : forall v x d a, M.find v (derived_atoms N) = Some (x, d, a) -> holds_in w a = true ->
    is_fact (derive T s) (v, x) = true;
  r_invariant : forall st f, In (st, f) (invariants N) -> if st : bool then 0 < ev w f else 0 <= ev w f;
  r_wf : wf T s }.
(* The same, but for derived atoms *)
Record Base (w : world) (s : state) : Prop := {
  b_var : forall v vals x a, M.find v (variables N) = Some vals -> In (x, a) vals ->
    holds_in w a = Z.eqb (var_value s v) x;
  b_num : forall n f, M.find n (fluents N) = Some f ->
    exists q, value_in w f = Some q /\ q * scaled N == inject_Z (num_value s n);
  b_fact : forall p os, changing N p = false -> holds_in w (p, os) = holds_in (initial P) (p, os);
  b_value : forall f, changing N (fst f) = false -> value_in w f = value_in (initial P) f;
  b_may : forall a, is_derived P (fst a) = false -> changing N (fst a) = true -> holds_in w a = true ->
    mem (may_hold N) a = true;
  b_exclusive : forall g a b, In g (exclusive N) -> In a g -> In b g -> holds_in w a = true ->
    holds_in w b = true -> a = b;
  b_invariant : forall st f, In (st, f) (invariants N) -> if st : bool then 0 < ev w f else 0 <= ev w f;
  b_wf : wf T s }.

Lemma parts :
  (forall a, changing N (fst a) = true -> holds_in (initial P) a = true -> mem (may_hold N) a = true) /\
  (forall v vals, M.find v (variables N) = Some vals -> is_basic T v = true /\
     forall x a, In (x, a) vals -> holds_in (initial P) a = Z.eqb (var_value (init T) v) x /\
       find_atom (fact_of N) a = Some (v, x)) /\
  (forall a v x, find_atom (fact_of N) a = Some (v, x) ->
    exists vals, M.find v (variables N) = Some vals /\ In (x, a) vals) /\
  (forall n f, M.find n (fluents N) = Some f -> mem_key n (numbers T) = true /\ changing N (fst f) = true /\
     find_atom (number_of N) f = Some n /\ exists q, value_in (initial P) f = Some q /\
       q * scaled N == inject_Z (num_value (init T) n)) /\
  tree_ok P T N (goal_leaf P T N) (with_invariants N (conjuncts P N unchanged Undefined [] (goal_formula P))) goal_case = true /\
  (forall i a, nth_error (actions P) i = Some a -> action_ok P T N case i a = true).
Proof.
  unfold faithful in ok. rewrite !andb_true_iff in ok. destruct ok as [[[[[[[[_ _] H1] H2] H3] H4] H5] H6] _].
  rewrite forallb_forall in H1, H2, H3, H4, H6. split; [|split; [|split; [|split; [|split]]]].
  - intros a C H. simpl in H. destruct (find_atom (initial_atoms P) a) as [u|] eqn:F; [|discriminate].
    apply find_entries in F.
    specialize (H1 _ F). cbn [fst] in H1. rewrite C in H1. exact H1.
  - intros v vals F. apply M.elements_correct in F. specialize (H2 _ F). cbn beta iota in H2.
    apply andb_true_iff in H2. destruct H2 as [B H2].
    split; [exact B|]. intros x a I. rewrite forallb_forall in H2. specialize (H2 _ I). cbn beta iota in H2.
    apply andb_true_iff in H2.
    destruct H2 as [E H2]. apply eqb_prop in E. split; [exact E|].
    destruct (find_atom (fact_of N) a) as [[u y]|]; [|discriminate].
    apply andb_true_iff in H2. destruct H2 as [E1 E2]. apply Pos.eqb_eq in E1. apply Z.eqb_eq in E2. subst.
    reflexivity.
  - intros a v x F. apply find_entries in F. specialize (H3 _ F). cbn beta iota in H3.
    destruct (M.find v (variables N)) as [vals|]; [|discriminate].
    exists vals. split; [reflexivity|]. apply existsb_exists in H3. destruct H3 as [[y b] [I E]].
    apply andb_true_iff in E. destruct E as [E1 E2].
    cbn [fst snd] in *. apply Z.eqb_eq in E1. apply atom_eqb_eq in E2. subst. exact I.
  - intros n f F. apply M.elements_correct in F. specialize (H4 _ F). cbn beta iota in H4.
    rewrite !andb_true_iff in H4. destruct H4 as [[[A B] C] D].
    split; [exact A|]. split; [exact B|]. split.
    + destruct (find_atom (number_of N) f) as [m|]; [|discriminate]. apply Pos.eqb_eq in D. subst.
      reflexivity.
    + destruct (value_in (initial P) f) as [q|]; [|discriminate]. apply Qeq_bool_iff in C. exists q.
      split; [reflexivity|exact C].
  - exact H5.
  - intros i a Hn. apply (H6 (i, a)). clear -Hn.
    assert (G : forall (l : list action) k i a, nth_error l i = Some a ->
      In ((k + i)%nat, a) (combine (seq k (length l)) l)).
    { induction l as [|b l IH]; intros k j c E; destruct j; simpl in *; try discriminate.
      - injection E as ->. left. f_equal. lia.
      - right. specialize (IH (S k) j c E). replace (k + S j)%nat with (S k + j)%nat by lia. exact IH. }
    apply (G _ 0%nat _ _ Hn).
Qed.

Lemma rule_parts :
  is_stratified (strata P) = true /\ fst (check_layers (layers T)) = true /\
  (forall p, is_derived P p = true -> changing N p = true) /\
  (forall v x d a, M.find v (derived_atoms N) = Some (x, d, a) -> is_derived P (fst a) = true /\
     find_atom (derived_of N) a = Some (v, x)) /\
  (forall g a, In g (exclusive N) -> In a g -> is_derived P (fst a) = false) /\
  (forall v vals x a, M.find v (variables N) = Some vals -> In (x, a) vals -> is_derived P (fst a) = false) /\
  (forall before rules later i, strata P = before ++ rules :: later -> In i (rule_instances P rules) ->
     rule_ok P T N (length before) (ground_rules T) i = true).
Proof.
  unfold faithful in ok. rewrite !andb_true_iff in ok. destruct ok as [[[[[[[[_ H] _] _] _] _] _] _] _].
  unfold rules_ok in H. rewrite !andb_true_iff in H. destruct H as [[[[[[[[H1 H2] H3] H4] H5] H6] _] _] H7].
  rewrite forallb_forall in H3, H4, H5, H6. repeat (split; [assumption|]).
  split; [|split; [|split; [|split]]].
  - intros p D. unfold is_derived in D. apply existsb_exists in D. destruct D as [rules [I D]].
    apply existsb_exists in D. destruct D as [r [J D]]. apply Pos.eqb_eq in D. subst p.
    specialize (H3 _ I). rewrite forallb_forall in H3. apply H3, J.
  - intros v x d a F. apply M.elements_correct in F. specialize (H4 _ F). cbn beta iota in H4.
    rewrite !andb_true_iff in H4. destruct H4 as [[[[[D _] _] _] _] H4]. split; [exact D|].
    destruct (find_atom (derived_of N) a) as [[u y]|]; [|discriminate]. apply andb_true_iff in H4.
    destruct H4 as [E1 E2]. apply Pos.eqb_eq in E1. apply Z.eqb_eq in E2. subst. reflexivity.
  - intros g a G I. specialize (H5 _ G). rewrite forallb_forall in H5. apply negb_true_iff, H5, I.
  - intros v vals x a F I. apply M.elements_correct in F. specialize (H6 _ F). cbn [snd] in H6.
    rewrite forallb_forall in H6. specialize (H6 _ I). cbn [snd] in H6. apply negb_true_iff, H6.
  - intros before rules later i L J. rewrite L in H7. clear -H7 J.
    assert (G : forall before n, strata_ok P T N n (ground_rules T) (before ++ rules :: later) = true ->
      rule_ok P T N (n + length before) (ground_rules T) i = true).
    { clear -J. induction before as [|r before IH]; intros n H; cbn [app strata_ok length] in *;
        apply andb_true_iff in H; destruct H as [H1 H2].
      - rewrite Nat.add_0_r. rewrite forallb_forall in H1. apply H1, J.
      - apply IH in H2. rewrite Nat.add_succ_r. exact H2. }
    exact (G before 0%nat H7).
Qed.
Lemma ground_parts :
  (forall v x d a, M.find v (derived_atoms N) = Some (x, d, a) -> is_basic T v = false /\ x <> d /\
     (exists f, In f (derived T) /\ fst f = v) /\ (forall f, In f (derived T) -> fst f = v -> snd f = d)) /\
  (forall v x d a rules r, M.find v (derived_atoms N) = Some (x, d, a) -> In rules (layers T) -> In r rules ->
     fst (fst r) = v -> snd (fst r) = x) /\
  (equivalent N = true -> fst (ground_rules_ok P T N (layers T)) = true).
Proof.
  unfold faithful in ok. rewrite !andb_true_iff in ok. destruct ok as [[[[[[[[_ H] _] _] _] _] _] _] _].
  unfold rules_ok in H. rewrite !andb_true_iff in H. destruct H as [[[[[[[[_ _] _] H4] _] _] H8] H9] _].
  rewrite forallb_forall in H4, H8. split; [|split].
  - intros v x d a F. apply M.elements_correct in F. specialize (H4 _ F). cbn beta iota in H4.
    rewrite !andb_true_iff in H4. destruct H4 as [[[[[_ B] X] E] D] _].
    split; [apply negb_true_iff, B|]. split; [intro Q; subst; rewrite Z.eqb_refl in X; discriminate|]. split.
    + apply existsb_exists in E. destruct E as [f [I E]]. apply Pos.eqb_eq in E. exists f. auto.
    + intros [u y] I Ef. rewrite forallb_forall in D. specialize (D _ I). cbn [fst snd] in *. subst u.
      rewrite Pos.eqb_refl in D.
      cbn [negb orb] in D. apply Z.eqb_eq, D.
  - intros v x d a rules r F I J E. specialize (H8 _ I). rewrite forallb_forall in H8. specialize (H8 _ J).
    rewrite E, F in H8. apply Z.eqb_eq, H8.
  - intro E. rewrite E in H9. exact H9.
Qed.
Lemma invariant_at_first : forall st f, In (st, f) (invariants N) ->
  if st : bool then 0 < ev (initial P) f else 0 <= ev (initial P) f.
Proof.
  intros st f I. unfold faithful in ok. rewrite !andb_true_iff in ok. destruct ok as [[[[[[[[H _] _] _] _] _] _] _] _].
  rewrite forallb_forall in H. specialize (H _ I). cbn [fst snd] in H.
  destruct st; [apply less_spec, H|apply Qle_bool_iff, H].
Qed.
Lemma exclusive_at_first : forall g a b, In g (exclusive N) -> In a g -> In b g ->
  holds_in (initial P) a = true -> holds_in (initial P) b = true -> a = b.
Proof.
  intros g a b G A B Ha Hb. unfold faithful in ok. rewrite !andb_true_iff in ok. destruct ok as [_ H].
  rewrite forallb_forall in H. specialize (H _ G). rewrite forallb_forall in H. specialize (H _ A).
  rewrite Ha in H. cbn [negb orb] in H.
  rewrite forallb_forall in H. specialize (H _ B). rewrite Hb in H. rewrite orb_false_r in H.
  apply atom_eqb_eq, H.
Qed.

Section State.
Variables (w : world) (s : state).
Hypothesis R : Rel w s.
Notation ds := (derive T s).
Lemma d_val : forall v vals, M.find v (variables N) = Some vals -> var_value ds v = var_value s v.
Proof. intros v vals F. apply derive_val; [apply heads|apply deriveds|]; auto. destruct parts as [_ [A _]].
apply (A _ _ F). Qed.
Lemma d_num : forall n f, M.find n (fluents N) = Some f -> num_value ds n = num_value s n.
Proof. intros n f F. rewrite derive_num. destruct parts as [_ [_ [_ [A _]]]]. rewrite (proj1 (A _ _ F)).
reflexivity. Qed.

Definition lower_ok (full : key -> bool) : Prop := forall v x d a, M.find v (derived_atoms N) = Some (x, d, a) ->
  full (fst a) = true -> holds_in w a = false -> var_value ds v = d.
Section Known.
Variable k : knowledge.
Hypothesis K : Knows w k.
Lemma in_variable_ok : forall v x b, In (x, b) (in_variable N k v) -> Z.eqb (var_value s v) x = b.
Proof.
  intros v x b I. unfold in_variable in I. apply in_flat_map in I. destruct I as [[a c] [I J]].
  cbn [fst snd] in J.
  destruct (find_atom (fact_of N) a) as [[u y]|] eqn:F; [|destruct J].
  destruct (Pos.eqb_spec u v); [|destruct J]. destruct J as [J|[]].
  injection J as -> ->. subst u. destruct parts as [_ [_ [A _]]]. destruct (A _ _ _ F) as [vals [F1 F2]].
  rewrite <- (r_var _ _ R _ _ _ _ F1 F2). apply K, I.
Qed.
Lemma excluded_by_ok : forall a, excluded_by N k a = true -> holds_in w a = false.
Proof.
  intros a H. unfold excluded_by, in_group in H. apply existsb_exists in H. destruct H as [g [G H]].
  apply andb_true_iff in H. destruct H as [A H].
  apply existsb_exists in A. destruct A as [a' [A E]]. apply atom_eqb_eq in E. subst a'.
  apply existsb_exists in H. destruct H as [[b c] [I H]]. cbn [fst snd] in H. rewrite !andb_true_iff in H.
  destruct H as [[C Ne] B]. subst c.
  apply existsb_exists in B. destruct B as [b' [B E]]. apply atom_eqb_eq in E. subst b'.
  destruct (holds_in w a) eqn:Ha; [|reflexivity].
  pose proof (r_exclusive _ _ R g b a G B A (proj1 K _ _ I) Ha) as E. subst b.
  rewrite (proj2 (atom_eqb_eq a a) eq_refl) in Ne. discriminate.
Qed.
Lemma possible_ok : forall v vals, M.find v (variables N) = Some vals ->
  In (var_value s v) (possible T N k v).
Proof.
  intros v vals F. unfold possible. apply filter_In. split.
  - destruct (List.find snd (in_variable N k v)) as [[x b]|] eqn:E.
    + apply find_some in E. destruct E as [I E]. simpl in E. subst b. apply in_variable_ok in I.
      apply Z.eqb_eq in I. left. symmetry. exact I.
    + apply range_In, (r_wf _ _ R). destruct parts as [_ [A _]]. apply (A _ _ F).
  - apply andb_true_iff. split.
    + apply forallb_forall. intros [x b] I. apply in_variable_ok in I. cbn [fst snd]. rewrite I.
      apply eqb_reflx.
    + rewrite F. apply negb_true_iff. destruct (existsb _ vals) eqn:E; [|reflexivity]. exfalso.
      apply existsb_exists in E.
      destruct E as [[x a] [I E]]. cbn [fst snd] in E. apply andb_true_iff in E. destruct E as [E1 E2].
      apply excluded_by_ok in E2.
      rewrite (r_var _ _ R _ _ _ _ F I), E1 in E2. discriminate.
Qed.
Lemma known_fact_ok : forall full, lower_ok full -> forall v x b,
  known_fact T N full k v x = Some b -> is_fact ds (v, x) = b.
Proof.
  intros full Lo v x b H. unfold known_fact in H. destruct (M.find v (variables N)) as [vals|] eqn:F.
  - pose proof (possible_ok _ _ F) as I. unfold is_fact. cbn [fst snd]. rewrite (d_val _ _ F).
    cbv zeta in H. destruct (forallb (Z.eqb x) (possible T N k v)) eqn:A.
    + injection H as <-. rewrite forallb_forall in A. specialize (A _ I). rewrite Z.eqb_sym. exact A.
    + destruct (forallb (fun y => negb (Z.eqb x y)) (possible T N k v)) eqn:B; [|discriminate].
      injection H as <-. rewrite forallb_forall in B. specialize (B _ I).
      apply negb_true_iff in B. rewrite Z.eqb_sym. exact B.
  - destruct (M.find v (derived_atoms N)) as [[[y d] a]|] eqn:D; [|discriminate].
    destruct (assoc a (literals k)) as [t|] eqn:A; [|discriminate]. apply assoc_In, (proj1 K) in A.
    unfold is_fact. cbn [fst snd]. destruct t.
    + injection H as <-. apply (r_derived _ _ R _ _ _ _ D) in A. unfold is_fact in A. cbn [fst snd] in A.
      apply Z.eqb_eq in A. rewrite A. apply Z.eqb_sym.
    + destruct (full (fst a)) eqn:Fu; [|discriminate]. injection H as <-. rewrite (Lo _ _ _ _ D Fu A). apply Z.eqb_sym.
Qed.
Lemma base_truth_ok : forall a b, base_truth P T N k a = Some b -> holds_in w a = b.
Proof.
  intros a b H. unfold base_truth in H. destruct (changing N (fst a)) eqn:C; cbn [negb] in H.
  2: { destruct a as [p os]. rewrite (r_fact _ _ R) by exact C. congruence. }
  destruct (assoc a (literals k)) as [c|] eqn:E.
  { apply assoc_In in E. rewrite (proj1 K _ _ E). congruence. }
  destruct (excluded_by N k a) eqn:Ex; cbn [orb] in H; [injection H as <-; apply excluded_by_ok, Ex|].
  destruct (mem (may_hold N) a) eqn:M; cbn [negb] in H.
  - destruct (find_atom (fact_of N) a) as [[v x]|] eqn:F; [|discriminate]. apply known_fact_ok in H; [|intros ? ? ? ? _ X; discriminate X].
    destruct parts as [_ [_ [A _]]]. destruct (A _ _ _ F) as [vals [F1 F2]].
    rewrite (r_var _ _ R _ _ _ _ F1 F2). unfold is_fact in H. cbn [fst snd] in H. rewrite (d_val _ _ F1) in H.
    exact H.
  - injection H as <-. destruct (holds_in w a) eqn:E2; [|reflexivity]. rewrite (r_may _ _ R a C E2) in M.
    discriminate.
Qed.
Lemma static_value : forall f, changing N (fst f) = false -> value_in w f = value_in (initial P) f.
Proof. apply (r_value _ _ R). Qed.
End Known.
Lemma impossible_ok : forall k, Knows w k -> impossible P T N k = true -> False.
Proof.
  intros k K H. unfold impossible in H. apply orb_true_iff in H. destruct H as [H|H].
  - apply existsb_exists in H. destruct H as [[a b] [I H]]. cbn [fst snd] in H. rewrite !orb_true_iff in H.
    destruct H as [[H|H]|H].
    2: { apply andb_true_iff in H. destruct H as [-> H]. apply (excluded_by_ok k K) in H.
         rewrite (proj1 K _ _ I) in H. discriminate. }
    + destruct (base_truth P T N (Knowledge [] (bounds k)) a) as [c|] eqn:E; [|discriminate].
      assert (K0 : Knows w (Knowledge [] (bounds k))) by (split; [intros ? ? []|apply K]).
      apply (base_truth_ok _ K0) in E. rename E into E'.
      rewrite (proj1 K _ _ I) in E'. subst c. rewrite eqb_reflx in H. discriminate.
    + destruct (find_atom (fact_of N) a) as [[v x]|] eqn:F; [|discriminate]. destruct parts as [_ [_ [A _]]].
      destruct (A _ _ _ F) as [vals [F1 _]].
      pose proof (possible_ok k K _ _ F1) as Q. destruct (possible T N k v); [destruct Q|discriminate].
  - apply existsb_exists in H. destruct H as [[st f] [I H]]. cbn [fst snd] in H.
    pose proof (proj2 K _ _ I) as B. apply (implied_ok w k K) in H.
    destruct st; cbn [negb] in H; rewrite ev_plus_form, ev_constant in H; lra.
Qed.
(* Derived variables follow from atoms up to stratum [limit]. *)
Section Lower.
Variable limit : nat.
Hypothesis Or : forall a, is_derived P (fst a) = true -> holds_in w a = true -> has_rule P w a.
Hypothesis Cl : forall a r, (level (strata P) (fst a) <= limit)%nat -> In r (concat (strata P)) ->
  is_rule_of P a r = true -> truth P w None (snd a) (body r) = Some true -> holds_in w a = true.
Lemma rules_of_spec : forall a r, In r (rules_of P a) <-> In r (concat (strata P)) /\ is_rule_of P a r = true.
Proof. intros a r. apply filter_In. Qed.
Lemma definite_ok : forall look, (forall a b, look a = Some b -> holds_in w a = b) -> forall f env b,
  definite P look env f = Some b -> truth P w None env f = Some b.
Proof.
  intros look L. induction f; intros env v H; cbn [definite truth] in *; try exact H; try discriminate.
  - destruct (ground env ts); [|discriminate]. rewrite (L _ _ H). reflexivity.
  - destruct (definite P look env f) as [t|] eqn:E; [|discriminate]. rewrite (IHf _ _ E). exact H.
  - assert (H' : and_kleene (definite P look env f1) (definite P look env f2) = Some v)
      by (destruct (definite P look env f1) as [[]|]; exact H).
    clear H. rename H' into H.
    destruct (definite P look env f1) as [x|] eqn:E1; [rewrite (IHf1 _ _ E1)|];
      destruct (definite P look env f2) as [y|] eqn:E2; try (rewrite (IHf2 _ _ E2)); try exact H;
      try destruct x; try destruct y; try discriminate; injection H as <-;
      try (destruct (truth P w None env f1) as [[]|]; reflexivity);
      destruct (truth P w None env f2) as [[]|]; reflexivity.
  - rewrite all_kleene_fold in H.
    revert v H. induction (objects P type) as [|o os IH]; intros v H; cbn [fold_right] in *; [exact H|].
    set (x := fold_right _ _ os) in H. set (y := fold_right _ _ os).
    assert (X : forall b, x = Some b -> y = Some b) by exact IH. clearbody x y. clear IH.
    destruct (definite P look (env ++ [o]) f) as [t|] eqn:E.
    + rewrite (IHf _ _ E). destruct x as [c|]; [rewrite (X _ eq_refl); exact H|].
      destruct t; [discriminate|]. injection H as <-. reflexivity.
    + destruct x as [[]|]; try discriminate. injection H as <-. rewrite (X _ eq_refl).
      destruct (truth P w None (env ++ [o]) f) as [[]|]; reflexivity.
Qed.
Lemma look_up_ok : forall k, Knows w k -> forall l, (l <= limit)%nat -> forall n a b, look_up P T N n l k a = Some b -> holds_in w a = b.
Proof.
  intros k K l Le. induction n; intros a b H; cbn [look_up] in H;
    (destruct (base_truth P T N k a) as [c|] eqn:B; [injection H as <-; apply (base_truth_ok k K), B|]);
    [discriminate|].
  destruct (is_unfolded P N a && Nat.leb (level (strata P) (fst a)) l) eqn:U; [|discriminate].
  apply andb_true_iff in U. destruct U as [U Lv]. apply Nat.leb_le in Lv. unfold is_unfolded in U.
  apply andb_true_iff in U. destruct U as [D _]. destruct (existsb _ _) eqn:E; [injection H as <-|].
  - apply existsb_exists in E. destruct E as [t [I E]]. apply in_map_iff in I. destruct I as [r [<- I]].
    apply rules_of_spec in I. destruct I as [I Ru].
    destruct (definite P (look_up P T N n l k) (snd a) (body r)) as [[]|] eqn:F; try discriminate.
    apply (definite_ok _ (IHn)) in F. apply (Cl a r); [lia|exact I|exact Ru|exact F].
  - destruct (forallb _ _) eqn:A; [injection H as <-|discriminate]. destruct (holds_in w a) eqn:Ha; [|reflexivity].
    destruct (Or _ D Ha) as [r [I [Ru Tr]]]. rewrite forallb_forall in A.
    specialize (A (definite P (look_up P T N n l k) (snd a) (body r))).
    assert (J : In r (rules_of P a)) by (apply rules_of_spec; auto).
    specialize (A (in_map (fun r => definite P (look_up P T N n l k) (snd a) (body r)) _ _ J)).
    destruct (definite P (look_up P T N n l k) (snd a) (body r)) as [[]|] eqn:F; try discriminate.
    apply (definite_ok _ (IHn)) in F. congruence.
Qed.
Lemma ground_rules_ok_rest : forall before rules rest, fst (ground_rules_ok P T N (before ++ rules :: rest)) = true ->
  forallb (ground_rule_ok P T N (snd (check_layers (rules :: rest)))) rules = true.
Proof.
  assert (S : forall ls, snd (ground_rules_ok P T N ls) = snd (check_layers ls)).
  { induction ls as [|rules ls IH]; [reflexivity|]. cbn [ground_rules_ok check_layers].
    destruct (ground_rules_ok P T N ls), (check_layers ls). cbn [snd] in *. subst. reflexivity. }
  induction before as [|layer before IH]; intros rules rest H; cbn [app ground_rules_ok] in H.
  - specialize (S rest). cbn [check_layers]. destruct (ground_rules_ok P T N rest), (check_layers rest).
    cbn [fst snd] in *. subst. apply andb_true_iff in H. apply H.
  - apply IH. destruct (ground_rules_ok P T N (before ++ rules :: rest)). cbn [fst] in *.
    apply andb_true_iff in H. apply H.
Qed.
Lemma lower_atoms : equivalent N = true -> forall v x d a, M.find v (derived_atoms N) = Some (x, d, a) ->
  (level (strata P) (fst a) <= limit)%nat -> is_fact ds (v, x) = true -> holds_in w a = true.
Proof.
  intro Eq. destruct ground_parts as [G1 [G2 G3]]. specialize (G3 Eq).
  assert (H : forall v x, (exists d a, M.find v (derived_atoms N) = Some (x, d, a)) -> is_fact ds (v, x) = true ->
    forall x d a, M.find v (derived_atoms N) = Some (x, d, a) -> (level (strata P) (fst a) <= limit)%nat ->
      holds_in w a = true).
  { apply (derive_invariant T s (fun v x => exists d a, M.find v (derived_atoms N) = Some (x, d, a))
      (fun v => forall x d a, M.find v (derived_atoms N) = Some (x, d, a) ->
        (level (strata P) (fst a) <= limit)%nat -> holds_in w a = true));
      [apply heads; exact task_ok|apply deriveds; exact task_ok| |].
    - intros v x [d [a F]] Is. exfalso. destruct (G1 _ _ _ _ F) as [_ [Ne [Ex De]]].
      unfold is_fact, reset_derived, var_value in Is. cbn [fst snd var_values] in Is. rewrite get_puts in Is.
      apply Z.eqb_eq in Is. pose proof (last_put_some (derived T) v
        (get (put_all (map (fun v => (v, get (var_values s) v)) (basics T)) (M.empty Z)) v) Ex) as L.
      apply De in L; [|reflexivity]. cbn [snd] in L. apply Ne. etransitivity; [symmetry; exact Is|exact L].
    - intros rules rest before t r L I B1 B2 B3 Ho _ x d a F Lv. rewrite L in G3.
      apply ground_rules_ok_rest in G3. rewrite forallb_forall in G3. specialize (G3 _ I).
      unfold ground_rule_ok in G3. rewrite F in G3. apply andb_true_iff in G3. destruct G3 as [Neg G3].
      rewrite forallb_forall in Neg. apply existsb_exists in G3. destruct G3 as [rule [Ir G3]].
      apply rules_of_spec in Ir. destruct Ir as [Ir Ru].
      cbv zeta in G3.
      set (k := Knowledge (ground_literals P N (level (strata P) (fst a)) (snd r)) []) in *.
      assert (K : Knows w k).
      { split; [|intros ? ? []]. intros b c J. unfold k, ground_literals in J. cbn [literals] in J.
        apply in_flat_map in J. destruct J as [[u z] [J J2]]. cbn [fst snd] in J2.
        assert (Is : var_value t u = z).
        { unfold holds, holds_facts in Ho. rewrite !andb_true_iff in Ho. destruct Ho as [[Ho _] _].
          rewrite forallb_forall in Ho. specialize (Ho _ J). unfold is_fact in Ho. apply Z.eqb_eq in Ho. exact Ho. }
        destruct (M.find u (variables N)) as [vals|] eqn:V.
        - apply in_map_iff in J2. destruct J2 as [[y b'] [E J2]]. injection E as <- <-. cbn [fst snd].
          rewrite (r_var _ _ R _ _ _ _ V J2). f_equal. rewrite <- Is. symmetry. apply B1.
          destruct parts as [_ [A _]]. apply (A _ _ V).
        - destruct (M.find u (derived_atoms N)) as [[[y e] b']|] eqn:D; [|destruct J2].
          destruct (Z.eqb_spec z y) as [E|E].
          + destruct (Nat.leb (level (strata P) (fst b')) (level (strata P) (fst a))) eqn:Lb; [|destruct J2].
            destruct J2 as [J2|[]]. injection J2 as <- <-. apply Nat.leb_le in Lb.
            subst y. apply (B3 u z (ex_intro _ e (ex_intro _ b' D))) with (x := z) (d := e); [|exact D|lia].
            unfold is_fact. cbn [fst snd]. apply Z.eqb_eq, Is.
          + destruct J2 as [J2|[]]. injection J2 as <- <-. destruct (holds_in w b') eqn:Hb; [|reflexivity]. exfalso. apply (r_derived _ _ R _ _ _ _ D) in Hb.
            specialize (Neg _ J). cbn [fst snd] in Neg. rewrite D in Neg.
            destruct (Z.eqb_spec z y); [contradiction|]. cbn [orb] in Neg.
            assert (N0 : M.find u (snd (check_layers (rules :: rest))) = None)
              by (destruct (M.find u (snd (check_layers (rules :: rest)))); [discriminate|reflexivity]).
            apply B2 in N0. unfold is_fact in Hb. cbn [fst snd] in Hb. apply Z.eqb_eq in Hb. congruence. }
      destruct (definite P (look_up P T N max_unfoldings (level (strata P) (fst a)) k) (snd a) (body rule))
        as [[]|] eqn:Df; try discriminate.
      apply (definite_ok _ (look_up_ok k K _ Lv max_unfoldings)) in Df. exact (Cl a rule Lv Ir Ru Df). }
  intros v x d a F Lv Is. exact (H v x (ex_intro _ d (ex_intro _ a F)) Is x d a F Lv).
Qed.
Lemma lower_up_to : lower_ok (fun p => equivalent N && Nat.leb (level (strata P) p) limit).
Proof.
  intros v x d a F Fu Ha. apply andb_true_iff in Fu. destruct Fu as [Eq Lv]. apply Nat.leb_le in Lv.
  destruct ground_parts as [G1 [G2 _]]. destruct (G1 _ _ _ _ F) as [_ [_ [Ex De]]].
  destruct (derived_values T s v x d Ex De (fun rules r I J E => G2 _ _ _ _ _ _ F I J E)) as [E|E]; [|exact E].
  exfalso. assert (Is : is_fact ds (v, x) = true) by (unfold is_fact; cbn [fst snd]; apply Z.eqb_eq; exact E).
  pose proof (lower_atoms Eq _ _ _ _ F Lv Is) as X. congruence.
Qed.
End Lower.
(* In a world with all of its derived atoms *)
Variable below : world.
Hypothesis complete : w = derived_world P below.
Lemma defined_ok : forall f env, is_defined P env f = true -> truth P w None env f <> None.
Proof.
  induction f; intros env H; cbn [is_defined truth] in *; try discriminate.
  - destruct (ground env ts); discriminate.
  - destruct (object_of env t); [|discriminate]. destruct (object_of env u); discriminate.
  - specialize (IHf _ H). destruct (truth P w None env f); [discriminate|congruence].
  - apply andb_true_iff in H. destruct H as [H1 H2]. specialize (IHf1 _ H1). specialize (IHf2 _ H2).
    destruct (truth P w None env f1) as [[]|], (truth P w None env f2) as [[]|]; simpl; congruence.
  - induction (objects P type) as [|o os IH]; [discriminate|]. cbn [forallb fold_right] in *.
    apply andb_true_iff in H. destruct H as [H1 H2]. specialize (IHf _ H1). specialize (IH H2).
    destruct (truth P w None (env ++ [o]) f) as [[]|],
      (fold_right (fun o r => and_kleene (truth P w None (env ++ [o]) f) r) (Some true) os) as [[]|];
      simpl; congruence.
Qed.
Lemma contradictory_ok : forall k, Knows w k -> contradictory P T N k = true -> False.
Proof.
  intros k K H. unfold contradictory in H. apply orb_true_iff in H. destruct H as [H|H];
    [eapply impossible_ok; eassumption|].
  unfold contradicts_rules in H. apply existsb_exists in H. destruct H as [[a holds] [I H]].
  apply andb_true_iff in H. destruct H as [D H]. cbv zeta in H. pose proof (proj1 K _ _ I) as A.
  destruct rule_parts as [St _].
  pose proof (symbolic_truth_ok P T N w k (base_truth_ok k K) static_value K w unchanged None Undefined
    (describes_itself P w) eq_refl) as S. destruct holds.
  - rewrite complete in A. destruct (rule_origin P below St a D A) as [r [Ir [Ru Tr]]]. rewrite <- complete in Tr.
    rewrite forallb_forall in H. specialize (H r (proj2 (filter_In _ _ _) (conj Ir Ru))).
    destruct (symbolic_truth P T N k unchanged Undefined (snd a) (body r)) as [[]|] eqn:E; try discriminate.
    apply (S _ _ _ E). exact Tr.
  - apply existsb_exists in H. destruct H as [r [J H]]. apply filter_In in J. destruct J as [Ir Ru].
    destruct (symbolic_truth P T N k unchanged Undefined (snd a) (body r)) as [[]|] eqn:E; try discriminate.
    apply S in E. apply defined_ok in H. assert (Tr : truth P w None (snd a) (body r) = Some true)
      by (destruct (truth P w None (snd a) (body r)) as [[]|]; simpl in *; congruence).
    rewrite complete in Tr. apply (rule_closed P below St a r Ir Ru) in Tr. rewrite <- complete in Tr. congruence.
Qed.

Lemma complete_origin : forall a, is_derived P (fst a) = true -> holds_in w a = true -> has_rule P w a.
Proof.
  intros a D H. rewrite complete in H. rewrite complete. destruct rule_parts as [St _].
  apply (rule_origin P below St a D H).
Qed.
Lemma level_bound : forall ls p, (level ls p <= length ls)%nat.
Proof.
  induction ls as [|rules ls IH]; intro p; cbn [level length]; [lia|]. specialize (IH p).
  destruct (level ls p); [destruct (is_head p rules); lia|lia].
Qed.
Lemma lower_holds : lower_ok (fun _ => equivalent N).
Proof.
  intros v x d a F Eq Ha. destruct rule_parts as [St _].
  apply (lower_up_to (length (strata P)) complete_origin) with (x := x) (a := a); [|exact F| |exact Ha].
  - intros b r _ I Ru Tr. rewrite complete in Tr. rewrite complete. exact (rule_closed P below St b r I Ru Tr).
  - cbv beta. rewrite Eq. apply Nat.leb_le, level_bound.
Qed.
(* Operators *)
Section Operators.
Variable k : knowledge.
Hypothesis K : Knows w k.
Lemma factors_ok : forall l g, factors_of N l = Some g -> forall a : Z, ev w g * scaled N + inject_Z a
  == inject_Z (fold_left (fun a t => (a + num_value ds (fst t) * snd t)%Z) l a).
Proof.
  induction l as [|[n f] l IH]; intros g H a; cbn [factors_of fold_left] in *.
  - injection H as <-. rewrite ev_constant. ring.
  - destruct (M.find n (fluents N)) as [h|] eqn:F; [|discriminate].
    destruct (factors_of N l) as [g'|]; [|discriminate]. injection H as <-.
    rewrite <- (IH _ eq_refl), ev_plus_form. destruct (r_num _ _ R _ _ F) as [q [E Q]]. cbn [fst snd].
    rewrite (d_num _ _ F), inject_Z_plus, inject_Z_mult.
    rewrite <- Q. unfold ev at 2. cbn [fst snd fold_right]. rewrite E. cbn [default]. ring.
Qed.
Lemma scaled_pos : 0 < scaled N. Proof. unfold scaled. reflexivity. Qed.
Lemma form_of_ok : forall l szs ch g, form_of N l szs ch = Some g ->
  ev w g * scaled N == inject_Z (value l ds szs ch).
Proof.
  intros l szs ch g H. unfold form_of in H.
  destruct (factors_of N (factors l)) as [f|] eqn:E; [|discriminate]. injection H as <-.
  unfold value. rewrite <- (factors_ok _ _ E), ev_plus_form, ev_constant. field. pose proof scaled_pos. lra.
Qed.
Lemma required_ok : forall l szs ch g, form_of N l szs ch = Some g -> required N k g = true ->
  (0 <= value l ds szs ch)%Z.
Proof.
  intros l szs ch g F H. unfold required in H. apply (implied_ok w k K) in H.
  rewrite ev_plus_form, ev_constant in H.
  apply form_of_ok in F. pose proof scaled_pos as S.
  assert (B : 0 < (ev w g + 1 * / scaled N) * scaled N) by (apply Qmult_lt_0_compat; assumption).
  setoid_replace ((ev w g + 1 * / scaled N) * scaled N) with (ev w g * scaled N + 1) in B by (field; lra).
  rewrite F in B. change 1 with (inject_Z 1) in B. rewrite <- inject_Z_plus in B.
  change 0 with (inject_Z 0) in B. rewrite <- Zlt_Qlt in B. lia.
Qed.
Lemma known_literal_ok : forall full, lower_ok full -> forall l b,
  known_literal T N full k l = Some b -> is_literal ds l = b.
Proof.
  intros full Lo [[v x] t] b H. unfold known_literal in H. cbn [fst snd] in H.
  destruct (known_fact T N full k v x) as [c|] eqn:F; [|discriminate]. injection H as <-.
  apply (known_fact_ok k K full Lo) in F. exact (f_equal (fun b => Bool.eqb b t) F).
Qed.
Lemma known_condition_ok : forall full, lower_ok full -> forall c szs ch,
  known_condition T N full k c szs ch = true -> holds c ds szs ch = true.
Proof.
  intros full Lo c szs ch H. unfold known_condition in H. rewrite !andb_true_iff in H. destruct H as [[H1 H2] H3].
  rewrite forallb_forall in H1, H2, H3.
  unfold holds, holds_facts. rewrite !andb_true_iff. split; [split|]; apply forallb_forall.
  - intros [v x] I. specialize (H1 _ I). cbn [fst snd] in H1.
    destruct (known_fact T N full k v x) as [[]|] eqn:F; try discriminate.
    apply (known_fact_ok k K full Lo), F.
  - intros cl I. specialize (H2 _ I). apply existsb_exists in H2. destruct H2 as [l [J E]].
    apply existsb_exists. exists l. split; [exact J|].
    destruct (known_literal T N full k l) as [[]|] eqn:F; try discriminate.
    apply (known_literal_ok full Lo), F.
  - intros l I. specialize (H3 _ I). destruct (form_of N l szs ch) as [g|] eqn:F; [|discriminate].
    apply Z.leb_le. eapply required_ok; eassumption.
Qed.
Lemma known_effects_ok : forall cs l, known_effects T N k cs = Some l ->
  l = flat_map snd (filter (fires ds) cs).
Proof.
  induction cs as [|c cs IH]; intros l H; cbn [known_effects filter] in *; [injection H as <-; reflexivity|].
  destruct (existsb _ (fst c)) eqn:E.
  - replace (fires ds c) with false; [apply IH, H|]. symmetry. unfold fires. apply existsb_exists in E.
    destruct E as [x [I E]].
    destruct (known_literal T N (fun _ => equivalent N) k x) as [[]|] eqn:F; try discriminate.
    apply (known_literal_ok _ lower_holds) in F.
    destruct (forallb _ _) eqn:A; [|reflexivity].
    rewrite forallb_forall in A. rewrite (A _ I) in F. discriminate.
  - destruct (forallb _ (fst c)) eqn:A; [|discriminate].
    destruct (known_effects T N k cs) as [r|]; [|discriminate]. injection H as <-.
    replace (fires ds c) with true; [simpl; f_equal; apply IH; reflexivity|]. symmetry. unfold fires.
    apply forallb_forall. intros x I.
    rewrite forallb_forall in A. specialize (A _ I).
    destruct (known_literal T N (fun _ => equivalent N) k x) as [[]|] eqn:F; try discriminate.
    apply (known_literal_ok _ lower_holds), F.
Qed.

Lemma admitted_ok : forall o ch, admitted_choice o ch = true -> admitted o ch.
Proof.
  intros o ch H. unfold admitted_choice in H. rewrite !andb_true_iff in H. destruct H as [[H1 H2] H3]. split.
  - apply Nat.eqb_eq in H1. revert H1 H2. generalize (slot_sizes o) as ns. clear.
    induction ch as [|x ch IH]; intros [|n ns] L F; try discriminate; constructor.
    + simpl in F. rewrite !andb_true_iff in F. destruct F as [F _]. lia.
    + simpl in F. rewrite !andb_true_iff in F. destruct F as [_ F]. apply IH; [simpl in L; lia|exact F].
  - intros slots bad I J. unfold admits in H3. rewrite forallb_forall in H3. specialize (H3 _ I). simpl in H3.
    apply negb_true_iff in H3.
    assert (E : existsb (equal_lists (map (fun i => nth i ch 0%Z) slots)) bad = true); [|congruence].
    apply existsb_exists. exists (map (fun i => nth i ch 0%Z) slots). split; [exact J|].
    unfold equal_lists. destruct (list_eq_dec _ _ _); [reflexivity|congruence].
Qed.
Lemma find_filter : forall X (f : X -> bool) l, List.find f l = match filter f l with [] => None
  | c :: _ => Some c end.
Proof. intros X f. induction l as [|x l IH]; simpl; [reflexivity|]. destruct (f x); [reflexivity|exact IH].
Qed.
Definition describes_values (w' : world) (news : list (atom * form)) : Prop :=
  forall f, match assoc f news with
            | Some g => exists q, value_in w' f = Some q /\ q == ev w g
            | None => value_in w' f = value_in w f end.
Definition after_of (o : option (operator * choice)) : state := match o with Some (o, ch) => apply o ds ch
  | None => s end.
Lemma is_zero_ok : forall f, is_zero f = true -> ev w f == 0.
Proof. intros [[|] c] H; [|discriminate]. apply Qeq_bool_iff in H. rewrite ev_empty. exact H. Qed.
(* The part of [Rel] on numbers *)
Lemma numbers_ok : forall sy o w', describes_values w' (new_values sy) ->
  match o with Some (o, _) => distinct (map fst (number_effects o)) = true | None => True end ->
  (forall n, In n (match o with Some (o, _) => map fst (number_effects o) | None => [] end
     ++ flat_map (fun l => match find_atom (number_of N) (fst l) with Some n => [n] | None => [] end)
          (new_values sy)) -> number_ok N sy o n = true) ->
  forall n f, M.find n (fluents N) = Some f ->
  exists q, value_in w' f = Some q /\ q * scaled N == inject_Z (num_value (after_of o) n).
Proof.
  intros sy o w' DV Dist H2 n f F. pose proof (DV f) as V. destruct (r_num _ _ R _ _ F) as [q0 [E0 Q0]].
      assert (X : exists q, value_in w' f = Some q /\
        q == ev w (match assoc f (new_values sy) with Some g => g | None => fluent f end)).
      { destruct (assoc f (new_values sy)) as [g|]; [exact V|]. exists q0. rewrite V, ev_fluent, E0.
        split; reflexivity. }
      destruct X as [q [X1 X2]]. exists q. split; [exact X1|]. rewrite X2.
      assert (Q : number_ok N sy o n = true \/ (match assoc f (new_values sy) with Some g => g
        | None => fluent f end = fluent f /\
                    match o with Some (o, _) =>
                      List.find (fun c => Pos.eqb (fst c) n) (number_effects o) = None | None => True end)).
      { destruct (in_dec Pos.eq_dec n (match o with Some (o, _) => map fst (number_effects o) | None => [] end
           ++ flat_map (fun l => match find_atom (number_of N) (fst l) with Some n => [n]
                | None => [] end) (new_values sy))) as [J|J].
        - left. apply H2, J.
        - right. split.
          + destruct (assoc f (new_values sy)) as [g|] eqn:A; [|reflexivity]. exfalso. apply J, in_or_app.
            right. apply in_flat_map.
            exists (f, g). split; [apply assoc_In, A|]. cbn [fst]. destruct parts as [_ [_ [_ [B _]]]].
            destruct (B _ _ F) as [_ [_ [B' _]]]. rewrite B'. left. reflexivity.
          + destruct o as [[o ch]|]; [|exact I]. destruct (List.find _ _) as [c|] eqn:A; [|reflexivity].
            exfalso. apply find_some in A. destruct A as [A1 A2].
            apply Pos.eqb_eq in A2. apply J, in_or_app. left. rewrite <- A2. apply in_map, A1. }
      assert (Y : match o with Some (o, ch) =>
        match List.find (fun c => Pos.eqb (fst c) n) (number_effects o) with
                     | Some c => num_value (after_of (Some (o, ch))) n = value (snd c) ds (slot_sizes o) ch
                       | None => num_value (after_of (Some (o, ch))) n = num_value s n end
                  | None => num_value (after_of o) n = num_value s n end).
      { destruct o as [[o ch]|]; [|reflexivity]. pose proof Dist as Di.
        pose proof (changed (fun l => value l ds (slot_sizes o) ch) (number_effects o) n
          (get (num_values ds) n) Di) as CH. cbv beta in CH.
        rewrite find_filter. unfold after_of, apply, num_value at 1 2. cbn [num_values]. rewrite get_puts, CH.
        change (get (num_values ds) n) with (num_value ds n).
        destruct (filter _ _); [apply (d_num _ _ F)|reflexivity]. }
      destruct Q as [Q|[Q1 Q2]].
      * unfold number_ok in Q. rewrite F in Q. cbv zeta in Q. destruct o as [[o ch]|].
        -- destruct (List.find (fun c : positive * linear => Pos.eqb (fst c) n) (number_effects o)) as [c|].
           ++ destruct (form_of N (snd c) (slot_sizes o) ch) as [g|] eqn:G; [|discriminate].
              apply is_zero_ok in Q. rewrite ev_plus_form in Q.
              apply form_of_ok in G. rewrite Y, <- G.
              setoid_replace (ev w g) with (ev w (match assoc f (new_values sy) with Some g => g
                | None => fluent f end)) by lra. reflexivity.
           ++ apply is_zero_ok in Q. rewrite ev_plus_form, (ev_fluent w f), E0 in Q. cbn [default] in Q.
              rewrite Y, <- Q0.
              setoid_replace q0 with (ev w (match assoc f (new_values sy) with Some g => g
                | None => fluent f end)) by lra. reflexivity.
        -- apply is_zero_ok in Q. rewrite ev_plus_form, (ev_fluent w f), E0 in Q. cbn [default] in Q.
           rewrite Y, <- Q0.
           setoid_replace q0 with (ev w (match assoc f (new_values sy) with Some g => g
             | None => fluent f end)) by lra. reflexivity.
      * rewrite Q1, (ev_fluent w f), E0. cbn [default]. rewrite Q0.
        destruct o as [[o ch]|]; [rewrite Q2 in Y|]; rewrite Y; reflexivity.
Qed.
Lemma form_after_ok : forall sy w', describes_values w' (new_values sy) -> forall f, ev w' f == ev w (form_after sy f).
Proof.
  intros sy w' D [l c]. unfold form_after. cbn [fst snd]. induction l as [|[f q] l IH]; cbn [fold_right].
  - rewrite ev_constant. reflexivity.
  - rewrite ev_plus_form, <- IH, ev_cons. cbn [fst snd]. specialize (D f). destruct (assoc f (new_values sy)) as [h|].
    + destruct D as [x [D1 D2]]. rewrite D1. cbn [default]. rewrite D2. ring.
    + rewrite D, ev_fluent. ring.
Qed.
Lemma stays_invariant_ok : forall sy w', describes_values w' (new_values sy) ->
  forallb (stays_invariant k sy) (invariants N) = true ->
  forall st f, In (st, f) (invariants N) -> if st : bool then 0 < ev w' f else 0 <= ev w' f.
Proof.
  intros sy w' D H st f I. rewrite forallb_forall in H. specialize (H _ I). unfold stays_invariant in H.
  cbn [fst snd] in H. apply orb_true_iff in H. destruct H as [H|H].
  - assert (E : ev w' f == ev w f).
    { rewrite forallb_forall in H. destruct f as [l c]. cbn [fst] in H. clear I.
      induction l as [|[g q] l IH]; [reflexivity|]. rewrite !ev_cons. cbn [fst snd].
      rewrite IH by (intros t J; apply H; right; exact J). specialize (H _ (or_introl eq_refl)). cbn [fst] in H.
      specialize (D g). destruct (assoc g (new_values sy)); [discriminate|]. rewrite D. reflexivity. }
    pose proof (r_invariant _ _ R _ _ I) as X. destruct st; rewrite E; exact X.
  - apply (implied_ok w k K) in H.
    destruct st; rewrite (form_after_ok sy w' D f); exact H.
Qed.
Lemma simulated_ok : forall sy time o w', Describes w w' sy ->
  (forall p os, changing N p = false -> holds_in w' (p, os) = holds_in w (p, os)) ->
  (forall f, changing N (fst f) = false -> value_in w' f = value_in w f) ->
  forallb (fun l => match assoc (fst l) (new_truths sy) with Some true => mem (may_hold N) (fst l)
    | _ => true end) (new_truths sy) = true ->
  forallb (stays_exclusive P T N k sy) (exclusive N) = true ->
  forallb (stays_invariant k sy) (invariants N) = true ->
  match o with Some (o, _) => In o (operators T) | None => True end ->
  simulated P T N k sy time o = true ->
  Base w' (after_of o) /\ match o with Some (o, ch) => admitted o ch /\
    holds (precondition o) ds (slot_sizes o) ch = true | None => True end /\
  exists g, growth P N sy time = Some g /\ inject_Z (step_cost o) <= g * (Zpos (cost_scale N) # 1).
Proof.
  intros sy time o w' D Sf Sv May Excl Inv Io H. unfold simulated in H.
  match type of H with match ?e with None => _ | Some _ => _ end = _ => destruct e as [made|] eqn:E end;
    [|discriminate].
  rewrite !andb_true_iff in H. destruct H as [[H1 H2] H3]. rewrite forallb_forall in H1, H2.
  assert (Pre : match o with Some (o, ch) => admitted o ch /\
    holds (precondition o) ds (slot_sizes o) ch = true /\ distinct (map fst (number_effects o)) = true /\
    made = made_facts o ds
                | None => made = [] end).
  { destruct o as [[o ch]|]; [|congruence].
    destruct (admitted_choice o ch && known_condition T N (fun _ => equivalent N) k (precondition o) (slot_sizes o) ch &&
      distinct (map fst (number_effects o))) eqn:A; [|discriminate].
    rewrite !andb_true_iff in A. destruct A as [[A1 A2] A3]. split; [apply admitted_ok, A1|].
    split; [apply (known_condition_ok _ lower_holds), A2|]. split; [exact A3|].
    destruct (known_effects T N k (conditional o)) as [l|] eqn:F; [|discriminate].
    apply known_effects_ok in F. simpl in E. injection E as <-. unfold made_facts. congruence. }
  assert (Val : forall v vals, M.find v (variables N) = Some vals ->
    var_value (after_of o) v = last_put made v (var_value s v)).
  { intros v vals F. destruct o as [[o ch]|].
    - destruct Pre as [_ [_ [_ ->]]]. unfold after_of, apply, var_value at 1. cbn [var_values].
      rewrite get_puts. change (get (var_values ds) v) with (var_value ds v). rewrite (d_val _ _ F).
      reflexivity.
    - rewrite Pre. reflexivity. }
  split; [|split].
  - split.
    + intros v vals x a F I. destruct rule_parts as [_ [_ [_ [_ [_ [Nd _]]]]]].
      assert (St : is_stale P sy (fst a) = false) by (unfold is_stale; rewrite (Nd _ _ _ _ F I); apply andb_false_r).
      rewrite (d_fact _ _ _ _ D a St).
      assert (Q : variable_ok T N k sy made v = true \/ (last_put made v (var_value s v) = var_value s v /\
        assoc a (new_truths sy) = None)).
      { destruct (in_dec Pos.eq_dec v (map fst made ++ flat_map (fun l =>
          match find_atom (fact_of N) (fst l) with Some f => [fst f]
          | None => [] end) (new_truths sy))) as [J|J].
        - left. apply H1, J.
        - right. split.
          + apply last_put_none. intros f If e. apply J, in_or_app. left. apply in_map_iff. exists f.
            split; assumption.
          + destruct (assoc a (new_truths sy)) as [b|] eqn:A; [|reflexivity]. exfalso. apply J, in_or_app.
            right. apply in_flat_map.
            exists (a, b). split; [apply assoc_In, A|]. cbn [fst]. destruct parts as [_ [B _]].
            destruct (B _ _ F) as [_ B']. destruct (B' _ _ I) as [_ B'']. rewrite B''. left. reflexivity. }
      rewrite (Val _ _ F). destruct Q as [Q|[Q1 Q2]].
      * unfold variable_ok in Q. rewrite F in Q. rewrite forallb_forall in Q.
        specialize (Q _ (possible_ok k K _ _ F)). unfold value_ok in Q. cbv zeta in Q.
        rewrite forallb_forall in Q. specialize (Q _ I). cbn [fst snd] in Q. apply eqb_prop in Q.
        rewrite <- Q.
        destruct (assoc a (new_truths sy)); [reflexivity|]. apply (r_var _ _ R _ _ _ _ F I).
      * rewrite Q1, Q2. apply (r_var _ _ R _ _ _ _ F I).
    + apply (numbers_ok sy); [exact (d_value _ _ _ _ D)| |exact H2].
      destruct o as [[o ch]|]; [apply Pre|exact Logic.I].
    + intros p os C. rewrite Sf by exact C. apply (r_fact _ _ R), C.
    + intros f C. rewrite Sv by exact C. apply (r_value _ _ R), C.
    + intros a Da C Ha.
      assert (St : is_stale P sy (fst a) = false) by (unfold is_stale; rewrite Da; apply andb_false_r).
      rewrite (d_fact _ _ _ _ D a St) in Ha.
      destruct (assoc a (new_truths sy)) as [b|] eqn:A; [|apply (r_may _ _ R); assumption].
      subst b. rewrite forallb_forall in May. specialize (May _ (assoc_In _ _ _ _ A)). cbn [fst] in May.
      rewrite A in May. exact May.
    + intros g a b G A B Ha Hb. rewrite forallb_forall in Excl. specialize (Excl _ G).
      unfold stays_exclusive in Excl. rewrite forallb_forall in Excl.
      assert (One : forall x y, In x g -> In y g -> assoc x (new_truths sy) = Some true ->
        holds_in w' y = true -> x = y).
      { intros x y X Y Et Hy. specialize (Excl _ X). rewrite Et in Excl. rewrite forallb_forall in Excl.
        specialize (Excl _ Y).
        apply orb_true_iff in Excl. destruct Excl as [Eq|F]; [apply atom_eqb_eq, Eq|]. exfalso.
        destruct (symbolic_atom P T N k sy y) as [[]|] eqn:Sy; try discriminate.
        apply (symbolic_atom_ok P T N w k (base_truth_ok k K) w' sy y false D) in Sy. congruence. }
      destruct rule_parts as [_ [_ [_ [_ [Nd _]]]]].
      assert (St : forall x, In x g -> is_stale P sy (fst x) = false)
        by (intros x X; unfold is_stale; rewrite (Nd _ _ G X); apply andb_false_r).
      pose proof (d_fact _ _ _ _ D a (St _ A)) as Da. pose proof (d_fact _ _ _ _ D b (St _ B)) as Db.
      destruct (assoc a (new_truths sy)) as [ta|] eqn:Ea.
      * rewrite Da in Ha. subst ta. apply (One a b); assumption.
      * destruct (assoc b (new_truths sy)) as [tb|] eqn:Eb.
        -- rewrite Db in Hb. subst tb. symmetry. apply (One b a); assumption.
        -- apply (r_exclusive _ _ R g); congruence.
    + exact (stays_invariant_ok sy w' (d_value _ _ _ _ D) Inv).
    + destruct o as [[o ch]|]; [|apply R]. apply wf_apply; [exact task_ok|exact Io|].
      apply wf_derive; [apply heads|apply deriveds|apply R]; exact task_ok.
  - destruct o as [[o ch]|]; [|exact I]. tauto.
  - destruct (growth P N sy time) as [g|]; [|discriminate]. exists g. split; [reflexivity|].
    apply Qle_bool_iff, H3.
Qed.
End Operators.

(* Projections: actions whose effects have unknown conditions *)
Lemma with_value_ok : forall k v vals, Knows w k -> M.find v (variables N) = Some vals ->
  Knows w (with_value k vals (var_value s v)).
Proof.
  intros k v vals [K1 K2] F. split; [|exact K2]. intros a b I. cbn [with_value literals] in I.
  apply in_app_or in I. destruct I as [I|I]; [|apply K1, I]. apply in_map_iff in I.
  destruct I as [[x c] [E I]]. injection E as <- <-. apply (r_var _ _ R _ _ _ _ F I).
Qed.
Lemma known_effects_on_ok : forall k, Knows w k -> forall v cs l x, known_effects_on T N v k cs = Some l ->
  last_put l v x = last_put (flat_map snd (filter (fires ds) cs)) v x.
Proof.
  intros k K v. induction cs as [|c cs IH]; intros l x H; cbn [known_effects_on filter] in *;
    [injection H as <-; reflexivity|].
  destruct (forallb (fun f => negb (Pos.eqb (fst f) v)) (snd c)) eqn:Z.
  - rewrite (IH _ _ H). destruct (fires ds c); [|reflexivity]. cbn [flat_map]. rewrite last_put_app. f_equal.
    symmetry. apply last_put_none. intros f I E. rewrite forallb_forall in Z. specialize (Z _ I).
    apply negb_true_iff in Z. apply Pos.eqb_neq in Z. contradiction.
  - destruct (existsb _ (fst c)) eqn:E.
    + replace (fires ds c) with false; [apply IH, H|]. symmetry. unfold fires. apply existsb_exists in E.
      destruct E as [y [I E]]. destruct (known_literal T N (fun _ => equivalent N) k y) as [[]|] eqn:F; try discriminate.
      apply (known_literal_ok k K _ lower_holds) in F. destruct (forallb (is_literal ds) (fst c)) eqn:A; [|reflexivity].
      rewrite forallb_forall in A. rewrite (A _ I) in F. discriminate.
    + destruct (forallb _ (fst c)) eqn:A; [|discriminate].
      destruct (known_effects_on T N v k cs) as [r|]; [|discriminate]. injection H as <-.
      replace (fires ds c) with true.
      * cbn [flat_map]. rewrite !last_put_app. apply IH. reflexivity.
      * symmetry. unfold fires. apply forallb_forall. intros y I. rewrite forallb_forall in A.
        specialize (A _ I). destruct (known_literal T N (fun _ => equivalent N) k y) as [[]|] eqn:F; try discriminate.
        apply (known_literal_ok k K _ lower_holds), F.
Qed.
Lemma step_instantaneous : forall a env w' d, duration a = None -> step P true w a env = Some (w', d) ->
  happening P w None env (at_start a) (start_effect a) = Some w' /\ d = 0.
Proof.
  intros a env w' d A H. unfold step in H. destruct (negb _); [discriminate|]. rewrite A in H.
  destruct (happening P w None env (at_start a) (start_effect a)) as [x|]; [|discriminate].
  injection H as <- <-. split; reflexivity.
Qed.
Lemma split_on_ok : forall check atoms k, Knows w k -> split_on P T N atoms check k = true ->
  exists k, Knows w k /\ check k = true.
Proof.
  intros check. induction atoms as [|a atoms IH]; intros k K H; cbn [split_on] in H;
    rewrite !orb_true_iff in H;
    destruct H as [[H|H]|H]; try (exists k; split; assumption);
      try (exfalso; eapply contradictory_ok; eassumption);
    try discriminate.
  apply andb_true_iff in H. destruct H as [H1 H2].
  destruct (holds_in w a) eqn:E; [apply (IH _) in H1; [exact H1|]|apply (IH _) in H2; [exact H2|]];
    (split; [intros b c [I|I]; [injection I as <- <-; exact E|apply K, I]|apply K]).
Qed.
Lemma projected_ok_ok : forall k a env o w' d, Knows w k -> step P true w a env = Some (w', d) ->
  (forall p os, changing N p = false -> holds_in w' (p, os) = holds_in w (p, os)) ->
  (forall f, changing N (fst f) = false -> value_in w' f = value_in w f) ->
  match o with Some (o, _) => In o (operators T) | None => True end ->
  projected_ok P T N k a env o = true ->
  Base w' (after_of o) /\
  match o with Some (o, ch) => admitted o ch /\ holds (precondition o) ds (slot_sizes o) ch = true
    | None => True end /\
  d = 0 /\ exists l g, describes_values w' l /\ growth P N (Symbolic [] l false) 0 = Some g /\
    inject_Z (step_cost o) <= g * (Zpos (cost_scale N) # 1).
Proof.
  intros k a env o w' d K St Sf Sv Io H. unfold projected_ok in H.
  destruct (duration a) eqn:A; [discriminate|].
  destruct (possible_facts P T N k env (start_effect a)) as [touched|] eqn:Po; [|discriminate].
  destruct (projected P T N (fun _ => false) true k env (start_effect a)) as [nums|] eqn:Pn; [|discriminate].
  destruct (step_instantaneous _ _ _ _ A St) as [Ha Hd].
  rewrite !andb_true_iff in H. destruct H as [[[[H1 H2] H3] H4] H5].
  destruct (symbolic_updates P N unchanged nums (symbolic_changed_fluents nums)) as [l|] eqn:U;
    [|discriminate].
  cbv zeta in H5. rewrite !andb_true_iff in H5. destruct H5 as [[Inv H5] H6]. rewrite forallb_forall in H1, H2, H4, H5.
  assert (Base : forall k, Knows w k -> forall a b, base_truth P T N k a = Some b -> holds_in w a = b)
    by (intros k' K'; apply (base_truth_ok k' K')).
  assert (V : describes_values w' l).
  { exact (projected_numbers P T N w k (Base k K) static_value K env _ _ w' nums l Ha Pn U). }
  assert (Pre : match o with Some (o, ch) => admitted o ch /\
    holds (precondition o) ds (slot_sizes o) ch = true /\ distinct (map fst (number_effects o)) = true
    | None => True end).
  { destruct o as [[o ch]|]; [|exact Logic.I]. rewrite !andb_true_iff in H3. destruct H3 as [[A1 A2] A3].
    split; [apply admitted_ok, A1|]. split; [apply (known_condition_ok k K _ lower_holds), A2|exact A3]. }
  split; [|split; [destruct o as [[o ch]|]; [tauto|exact Logic.I]|split; [exact Hd|]]].
  2: { exists l. destruct (growth P N (Symbolic [] l false) 0) as [g|]; [|discriminate]. exists g.
       split; [exact V|]. split; [reflexivity|]. apply Qle_bool_iff, H6. }
  split.
  - intros v vals x b F I.
    destruct (in_dec Pos.eq_dec v (match o with Some (o, _) =>
      map fst (effects o ++ flat_map snd (conditional o))
        | None => [] end ++ flat_map (fun l => match find_atom (fact_of N) (fst l) with Some f => [fst f]
        | None => [] end) touched)) as [J|J].
    + specialize (H4 _ J). unfold projected_variable_ok in H4. rewrite F in H4. rewrite forallb_forall in H4.
      specialize (H4 _ (possible_ok k K _ _ F)). cbv zeta in H4.
      set (keep := fun a => existsb (fun xa : Z * atom => atom_eqb a (snd xa)) vals) in *.
      apply split_on_ok in H4; [|apply (with_value_ok k v vals K F)]. destruct H4 as [kv [Kv H4]].
      destruct (projected P T N keep false kv env (start_effect a)) as [cs|] eqn:Pv; [|discriminate].
      match type of H4 with match ?e with Some _ => _ | None => _ end = _ => destruct e as [made|] eqn:E end;
        [|discriminate].
      unfold value_ok in H4. cbv zeta in H4. rewrite forallb_forall in H4. specialize (H4 _ I).
      cbn [fst snd] in H4.
      apply eqb_prop in H4.
      assert (Kb : keep b = true).
      { unfold keep. apply existsb_exists. exists (x, b). split; [exact I|]. apply atom_eqb_eq. reflexivity. }
      rewrite (projected_facts P T N w kv (Base kv Kv) static_value Kv keep false env _ _ w' cs Ha Pv b Kb).
      assert (Val : var_value (after_of o) v = last_put made v (var_value s v)).
      { destruct o as [[o ch]|]; [|injection E as <-; reflexivity].
        destruct (known_effects_on T N v kv (conditional o)) as [r|] eqn:Ke; [|discriminate].
        injection E as <-.
        unfold after_of, apply, var_value at 1. cbn [var_values]. rewrite get_puts.
        change (get (var_values ds) v) with (var_value ds v). rewrite (d_val _ _ F). unfold made_facts.
        rewrite !last_put_app. symmetry. apply (known_effects_on_ok kv Kv), Ke. }
      rewrite Val, <- H4. destruct (assoc b (truths_of cs)); [reflexivity|]. apply (r_var _ _ R _ _ _ _ F I).
    + rewrite (untouched P T N w k (Base k K) static_value K env _ _ w' touched Ha Po).
      * rewrite (r_var _ _ R _ _ _ _ F I). f_equal. symmetry. destruct o as [[o ch]|]; [|reflexivity].
        unfold after_of, apply, var_value at 1. cbn [var_values]. rewrite get_puts.
        change (get (var_values ds) v) with (var_value ds v). rewrite (d_val _ _ F). apply last_put_none.
        intros f If e. apply J, in_or_app. left. rewrite <- e. apply in_map. unfold made_facts in If.
        apply in_app_or in If. apply in_or_app. destruct If as [If|If]; [left; exact If|right].
        apply in_flat_map in If. destruct If as [c [Ic If]]. apply in_flat_map. exists c.
        apply filter_In in Ic. split; [apply Ic|exact If].
      * intros t It. apply J, in_or_app. right. apply in_flat_map. exists (b, t). split; [exact It|].
        cbn [fst].
        destruct parts as [_ [B _]]. destruct (B _ _ F) as [_ B']. destruct (B' _ _ I) as [_ B''].
        rewrite B''.
        left. reflexivity.
  - apply (numbers_ok (Symbolic [] l false)); [exact V| |exact H5].
    destruct o as [[o ch]|]; [apply Pre|exact Logic.I].
  - intros p os C. rewrite Sf by exact C. apply (r_fact _ _ R), C.
  - intros f C. rewrite Sv by exact C. apply (r_value _ _ R), C.
  - intros b _ C Hb. destruct (added P T N w k (Base k K) static_value K env _ _ w' touched Ha Po b Hb) as
      [Q|Q];
      [apply (r_may _ _ R); assumption|]. specialize (H1 _ Q). exact H1.
  - intros g x y G X Y Hx Hy. specialize (H2 _ G).
    destruct (projected P T N (fun a => in_group a g) false k env (start_effect a)) as [cs|] eqn:Pg;
      [|discriminate].
    assert (InG : forall z, In z g -> in_group z g = true).
    { intros z Iz. apply existsb_exists. exists z. split; [exact Iz|]. apply atom_eqb_eq. reflexivity. }
    pose proof (fun z Iz => projected_facts P T N w k (Base k K) static_value K (fun a => in_group a g) false
      env _ _ w'
      cs Ha Pg z (InG z Iz)) as D.
    unfold stays_exclusive in H2. cbn [new_truths] in H2. rewrite forallb_forall in H2.
    assert (One : forall u t, In u g -> In t g -> assoc u (truths_of cs) = Some true ->
      holds_in w' t = true -> u = t).
    { intros u t Iu It Et Ht. specialize (H2 _ Iu). rewrite Et in H2. rewrite forallb_forall in H2.
      specialize (H2 _ It). apply orb_true_iff in H2. destruct H2 as [Eq|Fa]; [apply atom_eqb_eq, Eq|].
      exfalso.
      unfold symbolic_atom in Fa. cbn [new_truths] in Fa. rewrite (D t It) in Ht.
      destruct (assoc t (truths_of cs)) as [b|]; [subst b; discriminate|].
      destruct (base_truth P T N k t) as [[]|] eqn:Bt; try discriminate. apply (Base k K) in Bt. congruence. }
    pose proof (D x X) as Dx. pose proof (D y Y) as Dy. destruct (assoc x (truths_of cs)) as [tx|] eqn:Ex.
    + rewrite Dx in Hx. subst tx. apply (One x y); assumption.
    + destruct (assoc y (truths_of cs)) as [ty|] eqn:Ey.
      * rewrite Dy in Hy. subst ty. symmetry. apply (One y x); assumption.
      * apply (r_exclusive _ _ R g); congruence.
  - exact (stays_invariant_ok k K (Symbolic [] l false) w' V Inv).
  - destruct o as [[o ch]|]; [|apply R]. apply wf_apply; [exact task_ok|exact Io|].
    apply wf_derive; [apply heads|apply deriveds|apply R]; exact task_ok.
Qed.

(* Knowledge from conditions that hold *)
Lemma knows_join : forall a b, Knows w a -> Knows w b -> Knows w (join a b).
Proof.
  intros a b [A1 A2] [B1 B2].
  split; simpl; intros ? ? I; apply in_app_or in I; destruct I; auto; [apply A2|apply B2]; assumption.
Qed.
Lemma knows_invariants : forall k, Knows w k -> Knows w (with_invariants N k).
Proof.
  intros k [K1 K2]. split; [exact K1|]. intros st f I. cbn [with_invariants bounds] in I. apply in_app_or in I.
  destruct I as [I|I]; [apply (r_invariant _ _ R), I|apply K2, I].
Qed.
Lemma knows_nothing : Knows w (Knowledge [] []).
Proof. split; intros ? ? []. Qed.
Lemma conjuncts_ok : forall w1 sy d r, Describes w w1 sy -> agrees w d r -> forall env f,
  truth P w1 d env f = Some true -> Knows w (conjuncts P N sy r env f).
Proof.
  intros w1 sy d r D A env. 
  assert (L : forall p ts b l, ground env ts = Some l -> holds_in w1 (p, l) = b ->
    Knows w (match assoc (p, l) (new_truths sy) with
             | None => if changing N p && negb (is_stale P sy p) then Knowledge [((p, l), b)] [] else Knowledge [] []
               | Some _ => Knowledge [] [] end)).
  { intros p ts b l G H. pose proof (d_fact _ _ _ _ D (p, l)) as Df. cbn [fst] in Df.
    destruct (assoc (p, l) (new_truths sy)); [apply knows_nothing|].
    destruct (is_stale P sy p); [rewrite andb_false_r; apply knows_nothing|]. rewrite (Df eq_refl) in H.
    destruct (changing N p); [|apply knows_nothing]. split; [intros b0 c [I|[]]; congruence|intros b0 c []]. }
  induction f; intro H; try (exact knows_nothing); cbn [truth conjuncts] in *.
  - destruct (ground env ts) as [l|] eqn:G; [|exact knows_nothing]. injection H as H. eapply L; eassumption.
  - pose proof (symbolic_expression_ok P N w static_value w1 sy d r D A env (Minus a b)) as Q.
    cbn [eval] in Q.
    destruct (symbolic_expression P N sy r env (Minus a b)) as [| |g]; try (exact knows_nothing).
    destruct (eval w1 d env a) as [x|]; [|discriminate]. destruct (eval w1 d env b) as [y|]; [|discriminate].
    unfold agrees in Q. specialize (Q _ eq_refl). simpl in Q.
    injection H as H. split; [intros b0 c []|intros b0 c [I|[]]]. injection I as <- <-.
    destruct strict; [apply less_spec in H|apply Qle_bool_iff in H]; lra.
  - destruct f; try (exact knows_nothing). cbn [truth] in H.
    destruct (ground env ts) as [l|] eqn:G; [|exact knows_nothing].
    simpl in H. injection H as H. apply negb_true_iff in H. eapply L; eassumption.
  - apply (knows_join (conjuncts P N sy r env f1) (conjuncts P N sy r env f2)); [apply IHf1|apply IHf2];
      destruct (truth P w1 d env f1) as [[]|]; try destruct (truth P w1 d env f2) as [[]|]; simpl in H;
        congruence.
Qed.
Lemma happening_holds : forall w1 d env f e w2, happening P w1 d env f e = Some w2 ->
  truth P w1 d env f = Some true.
Proof. intros w1 d env f e w2 H. unfold happening in H.
destruct (truth P w1 d env f) as [[]|]; try discriminate. reflexivity. Qed.
Lemma gathered_ok : forall a env w' d, step P true w a env = Some (w', d) -> Knows w (gathered P T N a env).
Proof.
  intros a env w' d H. unfold step in H. destruct (negb _); [discriminate|]. unfold gathered.
  destruct (duration a) as [e|] eqn:A.
  2: { destruct (happening P w None env (at_start a) (start_effect a)) as [x|] eqn:E; [|discriminate].
       apply happening_holds in E.
       apply (conjuncts_ok w unchanged None Undefined); [apply describes_itself|exact eq_refl|exact E]. }
  destruct (eval w None env e) as [q|] eqn:Ev; [|discriminate].
  pose proof (symbolic_duration_ok P N w static_value a env e q A Ev) as L.
  destruct (symbolic_duration P N a env) as [| |[[|t l] c]]; try (exact knows_nothing). unfold agrees in L.
  specialize (L q eq_refl). rewrite ev_empty in L.
  assert (R1 : agrees w (Some q) (Is (constant c))) by (simpl; intros x X; injection X as <-;
    rewrite ev_constant; exact L).
  destruct (less q 0); [discriminate|]. rewrite (Qeqb_comp q c L 0 0 (Qeq_refl 0)) in H. cbv zeta.
  destruct (Qeq_bool c 0).
  - match type of H with option_map _ ?h = _ => destruct h as [x|] eqn:E end; [|discriminate].
    apply happening_holds in E.
    apply (conjuncts_ok w unchanged (Some q) (Is (constant c)) (describes_itself P w) R1 env
      (And (at_start a) (at_end a))). exact E.
  - destruct (happening P w (Some q) env (at_start a) (start_effect a)) as [w1|] eqn:E1; [|discriminate].
    pose proof (conjuncts_ok w unchanged (Some q) (Is (constant c)) (describes_itself P w) R1 env _
      (happening_holds _ _ _ _ _ _ E1)) as K0.
    apply (symbolic_happening_ok P T N w _ (base_truth_ok _ K0) static_value K0 w unchanged (Some q)
      (Is (constant c)) c) in E1; [|apply describes_itself|exact R1].
    destruct (symbolic_happening _ _ _ _ _ _ _ _ _ _) as [| |s1 t1]; try exact K0. destruct E1 as [_ E1].
    match type of H with option_map _ ?h = _ => destruct h as [x|] eqn:E end; [|discriminate].
    apply happening_holds in E.
    apply knows_join; [exact K0|].
    exact (conjuncts_ok _ (make_stale s1) (Some q) (Is (constant c)) (make_stale_ok P w _ _ E1) R1 env _ E).
Qed.
Lemma tree_cases : forall (leaf : knowledge -> option (nat * choice) -> bool) (Q : Prop),
  (forall k o, Knows w k -> leaf k o = true -> Q) -> forall t k, Knows w k ->
    tree_ok P T N leaf k t = true -> Q.
Proof.
  intros leaf Q L. induction t; intros k K H; cbn [tree_ok] in H.
  - eapply L; eassumption.
  - exfalso. eapply contradictory_ok; eassumption.
  - apply andb_true_iff in H. destruct H as [H1 H2].
    destruct (holds_in w a) eqn:E; [eapply IHt1; [|exact H1]|eapply IHt2; [|exact H2]];
      (split; [intros b c [I|I]; [injection I as <- <-; exact E|apply K, I]|apply K]).
  - apply andb_true_iff in H. destruct H as [H1 H2].
    destruct (Qle_bool 0 (ev w f)) eqn:E; [eapply IHt1; [|exact H1]|eapply IHt2; [|exact H2]];
      (split; [apply K|intros st g [I|I]; [injection I as <- <-|apply K, I]]).
    + apply Qle_bool_iff, E.
    + apply le_false in E. rewrite ev_plus_form, ev_constant. lra.
Qed.
Definition accepts (next : continuation) : Prop := exists k, Knows w k /\ next k = true.
Definition is_sound (after : atom -> bool -> continuation -> continuation) : Prop := forall a b next k,
  Knows w k -> holds_in w a = b -> after a b next k = true -> accepts next.
Lemma expand_ok : forall after, is_sound after -> forall f b env next k, Knows w k ->
  truth P w None env f = Some b -> expand P T N after f b env next k = true -> accepts next.
Proof.
  intros after Af. induction f; intros v env next k K H E; cbn [expand truth] in *.
  - injection H as <-. rewrite eqb_reflx in E. exists k. auto.
  - destruct (ground env ts) as [l|]; [|discriminate]. injection H as H.
    destruct (base_truth P T N k (p, l)) as [c|] eqn:B.
    + apply (base_truth_ok k K) in B. rewrite H in B. subst c. rewrite eqb_reflx in E. exists k. auto.
    + refine (Af _ _ _ _ _ H E).
      split; [intros a c [I|I]; [injection I as <- <-; exact H|apply K, I]|apply K].
  - destruct (object_of env t); [|discriminate]. destruct (object_of env u); [|discriminate].
    injection H as <-. rewrite eqb_reflx in E. exists k. auto.
  - destruct v; [|exists k; auto]. eexists. split; [|exact E]. apply knows_join; [exact K|].
    apply (conjuncts_ok w unchanged None Undefined (describes_itself P w) eq_refl env (Compare strict a b)).
    exact H.
  - destruct (truth P w None env f) as [t|] eqn:F; [|discriminate]. injection H as <-.
    rewrite negb_involutive in E. eapply IHf; eassumption.
  - destruct v.
    + assert (A : truth P w None env f1 = Some true /\ truth P w None env f2 = Some true)
        by (destruct (truth P w None env f1) as [[]|], (truth P w None env f2) as [[]|]; simpl in H;
            split; congruence).
      destruct A as [A1 A2]. destruct (IHf1 _ _ _ _ K A1 E) as [k1 [K1 E1]]. eapply IHf2; eassumption.
    + apply andb_true_iff in E. destruct E as [E1 E2].
      assert (A : truth P w None env f1 = Some false \/ truth P w None env f2 = Some false)
        by (destruct (truth P w None env f1) as [[]|], (truth P w None env f2) as [[]|]; simpl in H;
            try discriminate; auto).
      destruct A as [A|A]; [eapply IHf1|eapply IHf2]; eassumption.
  - destruct v.
    + revert k K H E. induction (objects P type) as [|o os IH]; intros k K H E; cbn [fold_right] in *;
        [exists k; auto|].
      set (x := fold_right _ _ os) in H.
      assert (A : truth P w None (env ++ [o]) f = Some true /\ x = Some true)
        by (destruct (truth P w None (env ++ [o]) f) as [[]|], x as [[]|]; simpl in H; split; congruence).
      destruct A as [A1 A2]. destruct (IHf _ _ _ _ K A1 E) as [k1 [K1 E1]]. exact (IH k1 K1 A2 E1).
    + revert H E. induction (objects P type) as [|o os IH]; intros H E; cbn [fold_right forallb] in *;
        [discriminate|].
      apply andb_true_iff in E. destruct E as [E1 E2]. set (x := fold_right _ _ os) in *.
      assert (A : truth P w None (env ++ [o]) f = Some false \/ x = Some false)
        by (destruct (truth P w None (env ++ [o]) f) as [[]|], x as [[]|]; simpl in H; try discriminate; auto).
      destruct A as [A|A]; [eapply IHf; eassumption|exact (IH A E2)].
Qed.
Lemma unfold_ok : (forall a, is_derived P (fst a) = true -> holds_in w a = true -> has_rule P w a) -> forall limit,
  (forall a r, (level (strata P) (fst a) <= limit)%nat -> In r (concat (strata P)) -> is_rule_of P a r = true ->
     truth P w None (snd a) (body r) = Some true -> holds_in w a = true) ->
  forall n, is_sound (unfold P T N n limit).
Proof.
  intros O limit Cl. induction n; intros a b next k K H E; cbn [unfold] in E; [exists k; auto|].
  destruct (is_unfolded P N a) eqn:U; cbn [negb] in E; [|exists k; auto].
  unfold is_unfolded in U. apply andb_true_iff in U. destruct U as [D _]. destruct b.
  - destruct (O _ D H) as [r [I [Ru Tr]]]. rewrite forallb_forall in E.
    apply (expand_ok _ IHn (body r) true (snd a) next k K Tr). apply E, filter_In. auto.
  - destruct (Nat.leb (level (strata P) (fst a)) limit) eqn:Lv; [|exists k; auto]. apply Nat.leb_le in Lv.
    assert (Fa : forall r, In r (rules_of P a) -> truth P w None (snd a) (body r) <> Some true).
    { intros r I Tr. apply rules_of_spec in I. destruct I as [I Ru]. rewrite (Cl a r Lv I Ru Tr) in H. discriminate. }
    revert k K E. induction (rules_of P a) as [|r rs IH]; intros k K E; cbn [fold_right] in E; [exists k; auto|].
    assert (Fr : forall r, In r rs -> truth P w None (snd a) (body r) <> Some true)
      by (intros q I; apply Fa; right; exact I).
    destruct (is_defined P (snd a) (body r)) eqn:Df; [|exact (IH Fr k K E)].
    apply defined_ok in Df. pose proof (Fa r (or_introl eq_refl)) as Ne.
    assert (Tr : truth P w None (snd a) (body r) = Some false)
      by (destruct (truth P w None (snd a) (body r)) as [[]|]; congruence).
    destruct (expand_ok _ IHn (body r) false (snd a) _ k K Tr E) as [k1 [K1 E1]]. exact (IH Fr k1 K1 E1).
Qed.
End State.

(* Derived atoms *)
Lemma ground_rules_ok : forall v l r, M.find v (ground_rules T) = Some l -> In r l ->
  In ((v, fst r), snd r) (concat (layers T)).
Proof.
  unfold ground_rules. induction (concat (layers T)) as [|q rs IH]; intros v l r F I; cbn [fold_right] in F.
  - rewrite M.gempty in F. discriminate.
  - destruct (Pos.eq_dec v (fst (fst q))) as [e|e].
    + subst v. rewrite M.gss in F. injection F as <-. destruct I as [<-|I].
      * left. destruct q as [[v x] c]. reflexivity.
      * right. match type of I with In _ (match ?e with Some _ => _ | None => _ end) => destruct e as [l|] eqn:E end;
          [|destruct I]. eapply IH; eassumption.
    + rewrite M.gso in F by exact e. right. eapply IH; eassumption.
Qed.
Definition follows (s : state) (a : atom) : Prop := mem (may_hold N) a = true /\
  forall v x, find_atom (derived_of N) a = Some (v, x) -> is_fact (derive T s) (v, x) = true.
Lemma with_facts_related : forall w s F, Base w s -> (forall a, mem F a = true -> follows s a) ->
  Rel (with_facts P w F) s.
Proof.
  intros w s F B H. destruct rule_parts as [_ [_ [Ch [De [Ex [Va _]]]]]].
  split; cbn [with_facts holds_in value_in].
  - intros v vals x a Fi I. rewrite (Va _ _ _ _ Fi I). apply (b_var _ _ B _ _ _ _ Fi I).
  - apply B.
  - intros p os C. cbn [fst]. destruct (is_derived P p) eqn:D; [rewrite (Ch _ D) in C; discriminate|].
    apply (b_fact _ _ B), C.
  - apply B.
  - intros a C A. destruct (is_derived P (fst a)) eqn:D; [apply (H a), A|apply (b_may _ _ B); assumption].
  - intros g a b G I J. rewrite (Ex _ _ G I), (Ex _ _ G J). apply (b_exclusive _ _ B g); assumption.
  - intros v x d a D A. destruct (De _ _ _ _ D) as [D1 D2]. rewrite D1 in A. apply (H a A), D2.
  - exact (b_invariant _ _ B).
  - apply B.
Qed.
Lemma settled_level : forall before ls p, existsb (is_head p) ls = false <-> (level (before ++ ls) p <= length before)%nat.
Proof.
  assert (Z : forall ls p, existsb (is_head p) ls = false <-> level ls p = 0%nat).
  { induction ls as [|rules ls IH]; intro p; [split; reflexivity|]. cbn [existsb level]. specialize (IH p).
    destruct (existsb (is_head p) ls), (level ls p); destruct (is_head p rules); cbn [orb]; split; intro H;
      try discriminate; try reflexivity; try lia; destruct IH as [I1 I2]; try (specialize (I1 eq_refl); discriminate);
      specialize (I2 eq_refl); discriminate. }
  induction before as [|rules before IH]; intros ls p; cbn [app length level].
  - rewrite Z. lia.
  - rewrite IH. destruct (level (before ++ ls) p); [destruct (is_head p rules); lia|lia].
Qed.
Lemma derived_related : forall w s, Base w s -> Rel (derived_world P w) s.
Proof.
  intros w s B. apply with_facts_related; [exact B|]. apply derived_invariant; [apply rule_parts|].
  intros before rules later F0 F i L H0 Ju0 Cl0 Same H Ju J Fi. pose proof (with_facts_related _ _ _ B H) as R.
  pose proof (with_facts_related _ _ _ B H0) as R0.
  destruct rule_parts as [_ [La [_ [De [_ [_ Ok]]]]]]. specialize (Ok _ _ _ _ L J). unfold rule_ok in Ok.
  set (full := fun p => equivalent N && Nat.leb (level (strata P) p) (length before)) in *.
  assert (X : find_atom (derived_of N) (fst i) = None /\ mem (may_hold N) (fst i) = true \/
    expand P T N (unfold P T N max_unfoldings (length before)) (snd i) true (snd (fst i)) (rule_leaf P T N full (ground_rules T) (fst i))
      (Knowledge [] []) = true)
    by (destruct (find_atom (derived_of N) (fst i)), (mem (may_hold N) (fst i)); auto).
  destruct X as [[X1 X2]|X]; [split; [exact X2|intros v x E; congruence]|].
  assert (Or : forall F, (forall a, mem F a = true -> has_rule P (with_facts P w F) a) -> forall a,
    is_derived P (fst a) = true -> holds_in (with_facts P w F) a = true -> has_rule P (with_facts P w F) a).
  { intros F' Ju' a D A. cbn [with_facts holds_in] in A. rewrite D in A. exact (Ju' a A). }
  assert (Closed0 : forall b r, (level (strata P) (fst b) <= length before)%nat -> In r (concat (strata P)) ->
    is_rule_of P b r = true -> truth P (with_facts P w F0) None (snd b) (body r) = Some true ->
    holds_in (with_facts P w F0) b = true).
  { intros b r Lv I Ru Tr. rewrite L in Lv. apply settled_level in Lv. rewrite L, concat_app in I.
    unfold is_rule_of in Ru. rewrite <- andb_assoc in Ru. apply andb_true_iff in Ru. destruct Ru as [Hd Ty].
    apply Pos.eqb_eq in Hd. apply in_app_or in I. destruct I as [I|I].
    + apply (proj2 (tuples_spec P _ _)) in Ty. pose proof (Cl0 r (snd b) I Ty Tr) as M. rewrite <- Hd in M.
      cbn [with_facts holds_in]. replace (is_derived P (fst b)) with true; [destruct b; exact M|].
      symmetry. apply in_concat in I. destruct I as [rs [I1 I2]]. rewrite Hd. apply (head_derived P rs); [|exact I2].
      rewrite L. apply in_or_app. left. exact I1.
    + exfalso. apply in_concat in I. destruct I as [rs [I1 I2]].
      assert (E : existsb (is_head (fst b)) (rules :: later) = true); [|congruence].
      apply existsb_exists. exists rs. split; [exact I1|]. apply existsb_exists. exists r. split; [exact I2|].
      apply Pos.eqb_eq, Hd. }
  assert (Closed : forall b r, (level (strata P) (fst b) <= length before)%nat -> In r (concat (strata P)) ->
    is_rule_of P b r = true -> truth P (with_facts P w F) None (snd b) (body r) = Some true ->
    holds_in (with_facts P w F) b = true).
  { intros b r Lv I Ru Tr. pose proof (proj1 rule_parts) as St. rewrite L in St.
    assert (Ib : In r (concat before)).
    { pose proof I as I'. rewrite L, concat_app in I'. apply in_app_or in I'. destruct I' as [I'|I']; [exact I'|exfalso].
      pose proof Lv as Lv'. rewrite L in Lv'. apply settled_level in Lv'. apply in_concat in I'.
      destruct I' as [rs [I1 I2]]. unfold is_rule_of in Ru. rewrite !andb_true_iff in Ru. destruct Ru as [[Hd _] _].
      assert (E : existsb (is_head (fst b)) (rules :: later) = true); [|congruence].
      apply existsb_exists. exists rs. split; [exact I1|]. apply existsb_exists. exists r. split; [exact I2|exact Hd]. }
    assert (Tr0 : truth P (with_facts P w F0) None (snd b) (body r) = Some true).
    { pose proof (earlier_bodies before (rules :: later) St r Ib) as O.
      apply (truth_kept P (fun p _ => negb (existsb (is_head p) (rules :: later))) (with_facts P w F));
        [| |reflexivity|exact O|exact Tr];
        intros c Al; apply negb_true_iff in Al; cbn [with_facts holds_in]; destruct (is_derived P (fst c)); auto.
      - change (mem F c = true -> mem F0 c = true). rewrite (Same c Al). auto.
      - change (mem F c = false -> mem F0 c = false). rewrite (Same c Al). auto. }
    pose proof (Closed0 b r Lv I Ru Tr0) as Hb. pose proof Lv as Lv'. rewrite L in Lv'. apply settled_level in Lv'.
    cbn [with_facts holds_in] in *. destruct (is_derived P (fst b)); [|exact Hb].
    change (mem F0 b = true) in Hb. change (mem F b = true). rewrite (Same b Lv'). exact Hb. }
  (* What does not hold in the earlier strata does not follow in the ground task. *)
  assert (Lo : lower_ok (with_facts P w F) s full).
  { intros v x d a Fv Fu Ha. destruct (De _ _ _ _ Fv) as [D _].
    apply (lower_up_to _ _ R0 (length before) (Or F0 Ju0)) with (x := x) (a := a); [|exact Fv|exact Fu|].
    - exact Closed0.
    - cbn [with_facts holds_in] in Ha |- *. rewrite D in *. unfold full in Fu. apply andb_true_iff in Fu.
      destruct Fu as [_ Fu]. apply Nat.leb_le in Fu. rewrite L in Fu. apply settled_level in Fu.
      change (mem F a = false) in Ha. change (mem F0 a = false). rewrite <- (Same a Fu). exact Ha. }
  unfold fires_in in Fi. destruct (truth P (with_facts P w F) None (snd (fst i)) (snd i)) as [[]|] eqn:Tr;
    try discriminate.
  destruct (expand_ok _ _ R _ (unfold_ok _ _ R (Or F Ju) (length before) Closed max_unfoldings) _ _ _ _ _ (knows_nothing _) Tr X)
    as [k [K Lf]]. unfold rule_leaf in Lf.
  apply orb_true_iff in Lf. destruct Lf as [Lf|Lf]; [exfalso; exact (impossible_ok _ _ R k K Lf)|].
  apply andb_true_iff in Lf. destruct Lf as [May Lf]. split; [exact May|]. intros v x E. rewrite E in Lf.
  destruct (M.find v (ground_rules T)) as [l|] eqn:G; [|discriminate]. apply existsb_exists in Lf.
  destruct Lf as [r [Ir Lf]]. apply andb_true_iff in Lf. destruct Lf as [Ex Lf]. apply Z.eqb_eq in Ex. subst x.
  apply (known_condition_ok _ _ R k K full Lo) in Lf. pose proof (ground_rules_ok _ _ _ G Ir) as C.
  apply in_concat in C. destruct C as [layer [C1 C2]].
  exact (derive_closed T La s layer ((v, fst r), snd r) C1 C2 Lf).
Qed.

(* Instances *)
Lemma ground_prefix : forall e more ts l, ground e ts = Some l -> ground (e ++ more) ts = Some l.
Proof.
  intros e more. induction ts as [|t ts IH]; intros l H; simpl in *; [exact H|].
  destruct (object_of e t) as [o|] eqn:O; [|discriminate]. destruct (ground e ts) as [l'|]; [|discriminate].
  rewrite (IH _ eq_refl).
  replace (object_of (e ++ more) t) with (Some o); [exact H|]. destruct t; simpl in *; [|congruence].
  rewrite nth_error_app1; [congruence|]. apply nth_error_Some. congruence.
Qed.
Lemma object_prefix : forall e more t o, object_of e t = Some o -> object_of (e ++ more) t = Some o.
Proof. intros e more t o H. destruct t; simpl in *; [|exact H]. rewrite nth_error_app1; [exact H|].
apply nth_error_Some. congruence. Qed.
Definition same_statics (w : world) := forall p os, changing N p = false ->
  holds_in w (p, os) = holds_in (initial P) (p, os).
Lemma static_false_ok : forall w d e more f, same_statics w -> static_false P N e f = true ->
  truth P w d (e ++ more) f <> Some true.
Proof.
  intros w d e more f S. induction f; intro H; cbn [static_false truth] in *; try discriminate.
  - apply andb_true_iff in H. destruct H as [C H]. apply negb_true_iff in C.
    destruct (ground e ts) as [l|] eqn:G; [|discriminate].
    rewrite (ground_prefix _ _ _ _ G), S by exact C. apply negb_true_iff in H. rewrite H. discriminate.
  - destruct (object_of e t) as [a|] eqn:A; [|discriminate].
    destruct (object_of e u) as [b|] eqn:B; [|discriminate].
    rewrite (object_prefix _ _ _ _ A), (object_prefix _ _ _ _ B). apply negb_true_iff in H. rewrite H.
    discriminate.
  - destruct f; try discriminate; cbn [truth] in *.
    + apply andb_true_iff in H. destruct H as [C H]. apply negb_true_iff in C.
      destruct (ground e ts) as [l|] eqn:G; [|discriminate].
      rewrite (ground_prefix _ _ _ _ G), S by exact C. rewrite H. discriminate.
    + destruct (object_of e t) as [a|] eqn:A; [|discriminate].
      destruct (object_of e u) as [b|] eqn:B; [|discriminate].
      rewrite (object_prefix _ _ _ _ A), (object_prefix _ _ _ _ B), H. discriminate.
  - apply orb_true_iff in H. destruct H as [H|H]; [specialize (IHf1 H)|specialize (IHf2 H)];
      destruct (truth P w d (e ++ more) f1) as [[]|], (truth P w d (e ++ more) f2) as [[]|]; simpl;
        congruence.
Qed.
(* Every change has a predicate or function among the heads of its effect. *)
Definition head (c : change) : key := match c with Fact a _ => fst a | Number a _ _ => fst a end.
Lemma changes_heads : forall w d e env cs c, changes P w d env e = Some cs -> In c cs ->
  In (head c) (effect_heads e).
Proof.
  intros w d. induction e; intros env cs c H I; cbn [changes effect_heads] in *.
  - injection H as <-. destruct I.
  - destruct (ground env ts); [|discriminate]. injection H as <-. destruct I as [<-|[]]. left. reflexivity.
  - destruct (ground env ts); [|discriminate]. destruct (eval w d env e); [|discriminate]. injection H as <-.
    destruct I as [<-|[]]. left. reflexivity.
  - destruct (changes P w d env e1) as [x|] eqn:E1; [|discriminate].
    destruct (changes P w d env e2) as [y|] eqn:E2; [|discriminate]. injection H as <-.
    apply in_or_app. apply in_app_or in I.
    destruct I as [I|I]; [left; eapply IHe1|right; eapply IHe2]; eassumption.
  - destruct (truth P w d env f) as [[]|]; try discriminate;
      [eapply IHe; eassumption|injection H as <-; destruct I].
  - revert cs H I. induction (objects P type) as [|o os IH]; intros cs H I; cbn [fold_right] in H;
      [injection H as <-; destruct I|].
    destruct (changes P w d (env ++ [o]) e) as [x|] eqn:E1; [|discriminate].
    destruct (fold_right _ _ os) as [y|]; [|discriminate]. injection H as <-.
    apply in_app_or in I. destruct I as [I|I]; [eapply IHe; eassumption|eapply IH; [reflexivity|exact I]].
Qed.
Lemma updates_targets : forall w cs fs l f q, updates w cs fs = Some l -> assoc f l = Some q -> In f fs.
Proof.
  intros w cs. induction fs as [|h fs IH]; intros l f q H A; cbn [updates] in H;
    [injection H as <-; discriminate|].
  destruct (changed_value _ _); [|discriminate]. destruct (updates w cs fs) as [l'|]; [|discriminate].
  injection H as <-. simpl in A.
  destruct (atom_eqb f h) eqn:E; [left; symmetry; apply atom_eqb_eq,
    E|right; eapply IH; [reflexivity|exact A]].
Qed.
Lemma targets_In : forall cs f, In f (changed_fluents cs) -> exists b q, In (Number f b q) cs.
Proof.
  induction cs as [|c cs IH]; intros f I; [destruct I|]. destruct c; simpl in I.
  - destruct (IH _ I) as [b [q J]]. exists b, q. right. exact J.
  - destruct I as [<-|I]; [exists assigns, q; left; reflexivity|]. destruct (IH _ I) as [b [q' J]].
    exists b, q'. right. exact J.
Qed.
Definition keeps_statics (w w' : world) := (forall p os, changing N p = false ->
  holds_in w' (p, os) = holds_in w (p, os)) /\
  (forall f, changing N (fst f) = false -> value_in w' f = value_in w f).
Lemma happening_statics : forall w d env f e w', forallb (changing N) (effect_heads e) = true ->
  happening P w d env f e = Some w' -> keeps_statics w w'.
Proof.
  intros w d env f e w' C H. rewrite forallb_forall in C. unfold happening in H.
  destruct (truth P w d env f) as [[]|]; try discriminate.
  destruct (changes P w d env e) as [cs|] eqn:E; [|discriminate].
  destruct (updates w cs (changed_fluents cs)) as [l|] eqn:U; [|discriminate]. injection H as <-.
  assert (X : forall c, In c cs -> changing N (head c) = true) by (intros c I; apply C; eapply changes_heads;
    eassumption).
  split; simpl.
  - intros p os S. assert (Y : forall b, sets_atom cs (p, os) b = false).
    { intro b. destruct (sets_atom cs (p, os) b) eqn:Z; [|reflexivity]. unfold sets_atom in Z.
      apply existsb_exists in Z. destruct Z as [[a b'|] [I Z]]; [|discriminate].
      apply andb_true_iff in Z. destruct Z as [Z _]. apply atom_eqb_eq in Z. subst a. specialize (X _ I).
      simpl in X. congruence. }
    rewrite !Y. reflexivity.
  - intros g S. destruct (assoc g l) as [q|] eqn:A; [|reflexivity]. exfalso.
    apply (updates_targets _ _ _ _ _ _ U) in A. apply targets_In in A.
    destruct A as [b [q' I]]. specialize (X _ I). simpl in X. congruence.
Qed.
Lemma derived_statics : forall w p os, changing N p = false ->
  holds_in (derived_world P w) (p, os) = holds_in w (p, os).
Proof.
  intros w p os C. cbn [derived_world with_facts holds_in fst]. destruct (is_derived P p) eqn:D; [|reflexivity].
  destruct rule_parts as [_ [_ [X _]]]. rewrite (X _ D) in C. discriminate.
Qed.
Lemma step_statics : forall w a env w' d, forallb (changing N)
  (effect_heads (start_effect a) ++ effect_heads (end_effect a)) = true ->
  same_statics w -> step P true w a env = Some (w', d) ->
    keeps_statics w w' /\ (forall e more, env = e ++ more -> pruned P N a e = false).
Proof.
  intros w a env w' d C S H. rewrite forallb_app in C. pose proof C as C0. apply andb_true_iff in C.
  destruct C as [C1 C2]. unfold step in H. destruct (negb _); [discriminate|].
  assert (T1 : forall q e more, env = e ++ more -> truth P w q env (at_start a) = Some true ->
    static_false P N e (at_start a) = false).
  { intros q e more E Tr. destruct (static_false P N e (at_start a)) eqn:F; [|reflexivity]. exfalso.
    rewrite E in Tr. eapply static_false_ok; eassumption. }
  destruct (duration a) as [x|] eqn:A.
  2: { destruct (happening P w None env (at_start a) (start_effect a)) as [y|] eqn:E; [|discriminate].
       injection H as <- <-. split; [exact (happening_statics _ _ _ _ _ _ C1 E)|].
       intros e more Q. unfold pruned. rewrite A, (T1 None e more Q); [reflexivity|].
       eapply happening_holds, E. }
  destruct (eval w None env x) as [q|]; [|discriminate]. destruct (less q 0); [discriminate|].
  destruct (Qeq_bool q 0).
  - match type of H with option_map _ ?h = _ => destruct h as [y|] eqn:E end; [|discriminate].
    injection H as <- <-. split.
    + eapply happening_statics; [|exact E]. cbn [effect_heads]. rewrite forallb_app. exact C0.
    + intros e more Q. apply happening_holds in E. cbn [truth] in E. unfold pruned. rewrite A.
      assert (Ts : truth P w (Some q) env (at_start a) = Some true) by
        (destruct (truth P w (Some q) env (at_start a)) as [[]|],
        (truth P w (Some q) env (at_end a)) as [[]|]; simpl in E; congruence).
      assert (Te : truth P w (Some q) env (at_end a) = Some true) by
        (destruct (truth P w (Some q) env (at_start a)) as [[]|],
        (truth P w (Some q) env (at_end a)) as [[]|]; simpl in E; congruence).
      rewrite (T1 _ _ _ Q Ts). destruct (static_false P N e (at_end a)) eqn:F; [|reflexivity]. exfalso.
      rewrite Q in Te. eapply static_false_ok; eassumption.
  - destruct (happening P w (Some q) env (at_start a) (start_effect a)) as [w1|] eqn:E1; [|discriminate].
    match type of H with option_map _ ?h = _ => destruct h as [y|] eqn:E end; [|discriminate].
    injection H as <- <-.
    pose proof (happening_statics _ _ _ _ _ _ C1 E1) as [K1 K2].
    pose proof (happening_statics _ _ _ _ _ _ C2 E) as [K3 K4].
    pose proof (derived_statics w1) as Kd. split.
    + split; [intros p os Z; rewrite K3, Kd, K1 by exact Z; reflexivity|intros f Z; rewrite K4 by exact Z;
        exact (K2 f Z)].
    + intros e more Q. apply happening_holds in E1. apply happening_holds in E. cbn [truth] in E.
      unfold pruned. rewrite A, (T1 _ _ _ Q E1).
      assert (Te : truth P (derived_world P w1) (Some q) env (at_end a) = Some true) by
        (destruct (truth P (derived_world P w1) (Some q) env (over_all a)) as [[]|],
        (truth P (derived_world P w1) (Some q) env (at_end a)) as [[]|]; simpl in E; congruence).
      destruct (static_false P N e (at_end a)) eqn:F; [|reflexivity]. exfalso. rewrite Q in Te.
      eapply static_false_ok; [|exact F|exact Te]. intros p os Z. rewrite Kd, K1 by exact Z. apply S, Z.
Qed.
Lemma instances_ok : forall (prune : list key -> bool) env types e more, env = e ++ more ->
  (forall e more, env = e ++ more -> prune e = false) -> length more = length types ->
  forallb (fun x => existsb (Pos.eqb (fst x)) (objects P (snd x))) (combine more types) = true ->
    In env (instances P prune types e).
Proof.
  intros prune env. induction types as [|t types IH]; intros e more E Pr L F; destruct more as [|o more];
    try discriminate; simpl.
  - left. rewrite app_nil_r in E. symmetry. exact E.
  - simpl in F. apply andb_true_iff in F. destruct F as [F1 F2]. apply existsb_exists in F1.
    destruct F1 as [o' [I E1]]. apply Pos.eqb_eq in E1. subst o'.
    apply in_flat_map. exists o. split; [exact I|].
    rewrite (Pr (e ++ [o]) more) by (rewrite <- app_assoc; exact E).
    apply (IH _ more); [rewrite <- app_assoc; exact E|exact Pr|simpl in L; lia|exact F2].
Qed.

(* Metric *)
Definition measure (w : world) : Q := match symbolic_expression P N unchanged Undefined [] (metric P) with
  Is f => ev w f | _ => 0 end.
Lemma measure_changes : forall w w' s sy e f g, Rel w s ->
  (forall f, changing N (fst f) = false -> value_in w' f = value_in w f) ->
    describes_values w w' (new_values sy) ->
  symbolic_expression P N unchanged Undefined [] e = Is f ->
    symbolic_expression P N sy Undefined [] e = Is g -> ev w' f == ev w g.
Proof.
  intros w w' s sy e f g R St D. revert f g. induction e; intros x y; cbn [symbolic_expression].
  - intros H K. injection H as <-. injection K as <-. rewrite !ev_constant. reflexivity.
  - destruct (ground [] ts) as [l|]; [|discriminate]. unfold symbolic_value. cbn [unchanged new_values assoc].
    pose proof (D (f, l)) as V. cbn [fst]. destruct (changing N f) eqn:C.
    + intros H K. injection H as <-. rewrite ev_fluent. destruct (assoc (f, l) (new_values sy)) as [z|].
      * injection K as <-. destruct V as [q [V1 V2]]. rewrite V1. exact V2.
      * injection K as <-. rewrite ev_fluent, V. reflexivity.
    + destruct (value_in (initial P) (f, l)) as [q|] eqn:Q; [|discriminate]. intros H K. injection H as <-.
      rewrite ev_constant.
      destruct (assoc (f, l) (new_values sy)) as [z|].
      * injection K as <-. destruct V as [q' [V1 V2]]. rewrite St, (r_value _ _ R), Q in V1 by exact C.
        injection V1 as <-. exact V2.
      * injection K as <-. rewrite ev_constant. reflexivity.
  - discriminate.
  - destruct (symbolic_expression P N unchanged Undefined [] e1) as [| |a],
      (symbolic_expression P N unchanged Undefined [] e2) as [| |b]; simpl; try discriminate.
    destruct (symbolic_expression P N sy Undefined [] e1) as [| |c],
      (symbolic_expression P N sy Undefined [] e2) as [| |d]; simpl; try discriminate.
    intros H K. injection H as <-. injection K as <-.
    rewrite !ev_plus_form, (IHe1 _ _ eq_refl eq_refl), (IHe2 _ _ eq_refl eq_refl). reflexivity.
  - destruct (symbolic_expression P N unchanged Undefined [] e1) as [| |a],
      (symbolic_expression P N unchanged Undefined [] e2) as [| |b]; simpl; try discriminate.
    destruct (symbolic_expression P N sy Undefined [] e1) as [| |c],
      (symbolic_expression P N sy Undefined [] e2) as [| |d]; simpl; try discriminate.
    intros H K. injection H as <-. injection K as <-.
    rewrite !ev_plus_form, (IHe1 _ _ eq_refl eq_refl), (IHe2 _ _ eq_refl eq_refl). reflexivity.
  - destruct (symbolic_expression P N unchanged Undefined [] e1) as [| |[[|] a]],
      (symbolic_expression P N unchanged Undefined [] e2) as [| |[[|] b]]; try discriminate;
    destruct (symbolic_expression P N sy Undefined [] e1) as [| |[[|] c]],
      (symbolic_expression P N sy Undefined [] e2) as [| |[[|] d]]; try discriminate;
    intros H K; injection H as <-; injection K as <-; rewrite !ev_plus_form, !ev_constant;
    specialize (IHe1 _ _ eq_refl eq_refl); specialize (IHe2 _ _ eq_refl eq_refl); rewrite ?ev_empty in *;
      rewrite ?IHe1, ?IHe2; try ring; try (rewrite <- IHe1, <- IHe2; ring); try (rewrite <- IHe1; ring);
      rewrite <- IHe2; ring.
  - destruct (symbolic_expression P N unchanged Undefined [] e1) as [| |a],
      (symbolic_expression P N unchanged Undefined [] e2) as [| |[[|] b]]; try discriminate.
    destruct (Qeq_bool b 0); [discriminate|].
    destruct (symbolic_expression P N sy Undefined [] e1) as [| |c],
      (symbolic_expression P N sy Undefined [] e2) as [| |[[|] d]]; try discriminate.
    destruct (Qeq_bool d 0); [discriminate|]. intros H K. injection H as <-. injection K as <-.
    specialize (IHe1 _ _ eq_refl eq_refl). specialize (IHe2 _ _ eq_refl eq_refl). rewrite !ev_empty in IHe2.
    rewrite !ev_plus_form, !ev_constant, IHe1, IHe2. reflexivity.
Qed.
Lemma initially : Base (initial P) (init T).
Proof.
  destruct parts as [A1 [A2 [_ [A4 _]]]]. split; auto.
  - intros v vals x a F I. destruct (A2 _ _ F) as [_ B]. apply B, I.
  - intros n f F. apply A4, F.
  - apply exclusive_at_first.
  - apply invariant_at_first.
  - apply wf_init; exact task_ok.
Qed.
Lemma simulation : forall steps w s spent w' spent', execute P true w spent steps = Some (w', spent') ->
  Base w s ->
  exists ps c, Task.plan T s ps c /\ inject_Z c <= (measure w' + spent' - measure w - spent) *
    (Zpos (cost_scale N) # 1) /\ exists s', Base w' s'.
Proof.
  induction steps as [|[i env] steps IH]; intros w0 s spent w' spent' H R0; cbn [execute] in H;
    pose proof (derived_related _ _ R0) as R; remember (derived_world P w0) as w eqn:Cw;
    assert (Mw : measure w0 = measure w) by (subst w; reflexivity).
  - destruct (truth P w None [] (goal_formula P)) as [[]|] eqn:G; try discriminate. injection H as <- <-.
    rewrite Mw. exists [], 0%Z.
    split; [|split; [setoid_replace (measure w + spent - measure w - spent) with 0 by ring;
      change (inject_Z 0) with 0; lra|exists s; exact R0]].
    constructor. destruct parts as [_ [_ [_ [_ [B _]]]]]. 
    eapply (tree_cases w s R w0 Cw (goal_leaf P T N));
      [|apply (knows_invariants w s R), (conjuncts_ok w s R w unchanged None Undefined);
      [apply describes_itself|exact eq_refl|exact G]|exact B].
    intros k o K L. unfold goal_leaf in L.
    destruct (symbolic_truth P T N k unchanged Undefined [] (goal_formula P)) as [[]|] eqn:E.
    2: { exfalso. apply (symbolic_truth_ok P T N w k (base_truth_ok w s R k K) (static_value w s R) K w
           unchanged None Undefined (describes_itself P w) eq_refl) in E. apply E. exact G. }
    all: apply (known_condition_ok w s R k K (fun _ => equivalent N)); [apply (lower_holds w s R w0 Cw)|exact L].
  - rewrite Mw. destruct (nth_error (actions P) i) as [a|] eqn:Ni; [|discriminate].
    destruct (step P true w a env) as [[w1 d]|] eqn:S; [|discriminate].
    destruct parts as [_ [_ [_ [_ [_ B]]]]]. specialize (B _ _ Ni). unfold action_ok in B.
    apply andb_true_iff in B. destruct B as [C0 B].
    assert (C : forallb (changing N) (effect_heads (start_effect a) ++ effect_heads (end_effect a)) = true).
    { rewrite forallb_forall in *. intros p I. specialize (C0 _ I). apply andb_true_iff in C0. apply C0. }
    pose proof (step_statics w a env w1 d C (r_fact _ _ R) S) as [[K1 K2] Pr].
    rewrite forallb_forall in B. specialize (B env).
    assert (I : In env (instances P (pruned P N a) (parameters a) [])).
    { pose proof S as S'. unfold step in S'. destruct (negb _) eqn:Ng; [discriminate|].
      apply negb_false_iff in Ng. apply andb_true_iff in Ng. destruct Ng as [N1 N2].
      apply (instances_ok _ env _ [] env); auto. apply Nat.eqb_eq, N1. }
    specialize (B I).
    assert (Go : exists o sy t, match o with Some (o, _) => In o (operators T)
      | None => True end /\ Base w1 (after_of s o) /\
       match o with Some (o, ch) => admitted o ch /\
         holds (precondition o) (derive T s) (slot_sizes o) ch = true
         | None => True end /\ describes_values w w1 (new_values sy) /\ t == d /\
       exists g, growth P N sy t = Some g /\ inject_Z (step_cost o) <= g * (Zpos (cost_scale N) # 1)).
    { eapply (tree_cases w s R w0 Cw); [|apply (knows_invariants w s R); eapply gathered_ok; eassumption|exact B]. intros k o K L.
      assert (L' : exists o, match o with Some (o, _) => In o (operators T)
        | None => True end /\ leaf_ok P T N k a env o = true).
      { unfold instance_leaf in L. destruct o as [[j ch]|]; [|exists None; split; [exact Logic.I|exact L]].
        destruct (nth_error (operators T) j) as [o|] eqn:Nj; [|discriminate]. exists (Some (o, ch)).
        split; [eapply nth_error_In, Nj|exact L]. }
      clear L. destruct L' as [o' [Io L]]. unfold leaf_ok in L.
      pose proof (symbolic_step_ok P T N w k (base_truth_ok w s R k K) (static_value w s R) K a env w1 d S)
        as Q.
      destruct (symbolic_step P T N k a env) as [| |sy t]; [destruct Q| |].
      { destruct (projected_ok_ok w s R w0 Cw k a env o' w1 d K S K1 K2 Io L) as [R1 [Ad [Td [l [g G]]]]].
        exists o', (Symbolic [] l false), 0. rewrite Td. cbn [new_values]. destruct G as [G1 [G2 G3]].
        split; [exact Io|]. split; [exact R1|]. split; [exact Ad|]. split; [exact G1|]. split; [reflexivity|].
        exists g. split; [exact G2|exact G3]. }
      destruct Q as [Q D].
      rewrite !andb_true_iff in L. destruct L as [[[L1 LX] LI] L2].
      destruct (simulated_ok w s R w0 Cw k K sy t o' w1 D K1 K2 L1 LX LI Io L2) as [R1 [Ad G]]. exists o', sy, t.
      pose proof (d_value _ _ _ _ D : describes_values w w1 (new_values sy)) as DV. tauto. }
    destruct Go as [o [sy [t [Io [R1 [Ad [D [Td [g [Gr Co]]]]]]]]]].
    destruct (IH _ _ _ _ _ H R1) as [ps [c [Pl [Le End]]]].
    assert (M : g == measure w1 - measure w + per_time P * d + per_step P).
    { unfold growth in Gr. unfold measure.
      destruct (symbolic_expression P N unchanged Undefined [] (metric P)) as [| |f] eqn:E0;
        destruct (symbolic_expression P N sy Undefined [] (metric P)) as [| |h] eqn:E1;
          cbn [plus_result] in Gr; try discriminate.
      pose proof (measure_changes w w1 s sy (metric P) f h R K2 D E0 E1) as X.
      pose proof (ev_plus_form w h (-1 # 1) f) as Y.
      destruct (plus_form h (-1 # 1) f) as [[|] z]; [|discriminate]. injection Gr as <-.
      rewrite ev_empty in Y. rewrite X, Y, Td. ring. }
    rewrite Qred_correct in Le.
    set (k := Zpos (cost_scale N) # 1) in *.
    assert (Sum : inject_Z (step_cost o + c) <= (measure w' + spent' - measure w - spent) * k).
    { rewrite inject_Z_plus. rewrite M in Co.
      setoid_replace ((measure w' + spent' - measure w - spent) * k) with
        ((measure w1 - measure w + per_time P * d + per_step P) * k +
          (measure w' + spent' - measure w1 - (spent + per_time P * d + per_step P)) * k) by ring.
      lra. }
    destruct o as [[o ch]|].
    + exists ((o, ch) :: ps), (amount (cost o) (slot_sizes o) ch + c)%Z.
      split; [destruct Ad; constructor; assumption|split; [exact Sum|exact End]].
    + exists ps, c. split; [exact Pl|split; [exact Sum|exact End]].
Qed.
End Simulation.
