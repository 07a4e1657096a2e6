(* Theorem [timed_optimal]: what [check_timed] accepts is true. *)
From Coq Require Import ZArith QArith List Bool FMapPositive Lia Lqa Setoid.
From Proved Require Import Task Check Proof Sound Derived Lifted Timed Faithful Symbolic Axioms Simulation Timeline.
Import ListNotations.
Open Scope Q_scope.

Lemma find_add : forall V (m : atom_map V) a x b,
  find_atom (add_atom a x m) b = if atom_eqb b a then Some x else find_atom m b.
Proof.
  intros V m a x b. unfold find_atom, add_atom, bucket_entries.
  destruct (Pos.eq_dec (bucket b) (bucket a)) as [e|e].
  - rewrite e, PositiveMap.gss. cbn [assoc]. destruct (atom_eqb b a); reflexivity.
  - rewrite PositiveMap.gso by exact e. destruct (atom_eqb b a) eqn:E; [|reflexivity].
    apply atom_eqb_eq in E. congruence.
Qed.

(* Times in order: the events that satisfy a condition of earlier times come first. *)
Section Lists.
Variables (p q : event -> bool).
Definition closed_down (vs : list event) : Prop :=
  ForallOrdPairs (fun u v => (p v = true -> p u = true) /\ (q v = true -> q u = true)) vs.
Lemma filter_none : forall (r : event -> bool) vs, (forall v, In v vs -> r v = false) -> filter r vs = [].
Proof.
  intros r. induction vs as [|v vs IH]; intro H; [reflexivity|]. cbn [filter]. rewrite (H v (or_introl eq_refl)).
  apply IH. intros u I. apply H. right. exact I.
Qed.
Lemma slice_filter : forall vs, closed_down vs -> (forall v, p v = true -> q v = true) ->
  filter (fun v => negb (p v) && q v) vs = skipn (length (filter p vs)) (firstn (length (filter q vs)) vs).
Proof.
  intros vs C S. induction C as [|v vs F C IH]; [reflexivity|]. rewrite Forall_forall in F. cbn [filter].
  destruct (p v) eqn:Ep.
  - rewrite (S v Ep). cbn [negb andb length firstn skipn]. exact IH.
  - assert (Np : filter p vs = []).
    { apply filter_none. intros u I. destruct (p u) eqn:E; [|reflexivity]. apply F in E; [congruence|exact I]. }
    rewrite Np in *. cbn [negb andb length skipn] in *. destruct (q v) eqn:Eq.
    + cbn [length firstn]. f_equal. exact IH.
    + assert (Nq : filter q vs = []).
      { apply filter_none. intros u I. destruct (q u) eqn:E; [|reflexivity]. apply F in E; [congruence|exact I]. }
      rewrite Nq. cbn [length firstn]. apply filter_none. intros u I. destruct (q u) eqn:E; [|apply andb_false_r].
      apply F in E; [congruence|exact I].
Qed.
End Lists.
Lemma filter_short : forall (r : event -> bool) vs, (length (filter r vs) <= length vs)%nat.
Proof. intros r. induction vs as [|v vs IH]; [reflexivity|]. cbn [filter length]. destruct (r v); cbn [length]; lia. Qed.
Lemma nth_filter : forall (p : event -> bool) vs, closed_down p p vs -> forall i v, nth_error vs i = Some v ->
  p v = Nat.ltb i (length (filter p vs)).
Proof.
  intros p vs C. induction C as [|u vs F C IH]; intros i v E; [destruct i; discriminate|].
  rewrite Forall_forall in F. cbn [filter]. destruct i as [|i]; cbn [nth_error] in E.
  - injection E as ->. destruct (p v) eqn:Ep; [reflexivity|]. rewrite (filter_none p vs); [reflexivity|].
    intros u I. destruct (p u) eqn:E; [|reflexivity]. apply F in E; [congruence|exact I].
  - rewrite (IH _ _ E). destruct (p u) eqn:Ep; [reflexivity|]. rewrite (filter_none p vs); [reflexivity|].
    intros x I. destruct (p x) eqn:Ex; [|reflexivity]. apply F in Ex; [congruence|exact I].
Qed.

Section Proof.
Variables (P : problem) (events : list event) (T : task) (N : names) (X : timeline).
Variables (case : nat -> list key -> passage -> case_tree) (wait_case : nat -> case_tree) (goal_case : case_tree).
Hypothesis task_ok : check_task T = true.
Hypothesis ok : timed_faithful P events T N X case wait_case goal_case = true.
Notation E := (extended P events X).
Notation added := (is_added X).
Notation phase := (phase X).
Notation up_to := (up_to events).
Notation before := (before events).

Lemma all_parts : strata P = [] /\ per_step P == 0 /\ faithful E T N (fun _ _ => Decided None) goal_case = true /\
  is_sorted events = true /\ (forall v, In v events -> on_grid X (time v) = true) /\
  (forall a b, In (a, b) (flat_map sets events) -> changing N (fst a) = true /\ added (fst a) = false) /\
  (forall p, added p = true -> changing N p = true) /\
  differ (waited X :: phase_atoms X) = true /\ length (phase_atoms X) = S (length events) /\
  (forall a, In a (waited X :: phase_atoms X) -> holds_in (initial P) a = false) /\
  formula_free X (goal_formula P) = true /\ expression_free X (metric P) = true /\
  (forall i v, nth_error events i = Some v -> wait_ok P events T N X wait_case i v = true) /\
  (forall i a, nth_error (actions P) i = Some a -> timed_action_ok P events T N X case i a = true).
Proof.
  assert (Cm : forall (A : Type) (f : nat * A -> bool) (l : list A) k, forallb f (combine (seq k (length l)) l) = true ->
    forall i v, nth_error l i = Some v -> f ((k + i)%nat, v) = true).
  { intros A f. induction l as [|x l IH]; intros k H i v Ev; [destruct i; discriminate|]. simpl in H.
    apply andb_true_iff in H. destruct H as [H1 H2]. destruct i as [|i]; simpl in Ev.
    - injection Ev as <-. rewrite Nat.add_0_r. exact H1.
    - specialize (IH _ H2 _ _ Ev). replace (k + S i)%nat with (S k + i)%nat by lia. exact IH. }
  unfold timed_faithful in ok. rewrite !andb_true_iff in ok.
  destruct ok as [[[[[[[[[[[[[A1 A2] A3] A4] A5] A6] A7] A8] A9] A10] A11] A12] A13] A14].
  rewrite forallb_forall in A5, A6, A7, A10.
  split; [destruct (strata P); [reflexivity|discriminate]|]. split; [apply Qeq_bool_iff, A2|].
  split; [exact A3|]. split; [exact A4|]. split; [exact A5|].
  split. { intros a b I. specialize (A6 _ I). cbn [fst] in A6. apply andb_true_iff in A6. destruct A6 as [B1 B2].
    split; [exact B1|]. apply negb_true_iff, B2. }
  split. { intros p I. unfold is_added in I. apply existsb_exists in I. destruct I as [q [I J]].
    apply Pos.eqb_eq in J. subst q. apply A7, I. }
  split; [exact A8|]. split; [apply Nat.eqb_eq, A9|].
  split. { intros a I. apply negb_true_iff, A10, I. }
  split; [exact A11|]. split; [exact A12|].
  split; [exact (Cm _ (fun iv => wait_ok P events T N X wait_case (fst iv) (snd iv)) _ 0%nat A13)|
    exact (Cm _ (fun ia => timed_action_ok P events T N X case (fst ia) (snd ia)) _ 0%nat A14)].
Qed.

(* Worlds that agree on everything that is not added *)
Definition same (w W : world) : Prop :=
  (forall a, added (fst a) = false -> holds_in W a = holds_in w a) /\
  (forall f, added (fst f) = false -> value_in W f = value_in w f).
Section Agreement.
Variables (w W : world).
Hypothesis S : same w W.
Lemma eval_agrees : forall d env e, expression_free X e = true -> eval W d env e = eval w d env e.
Proof.
  intros d env. induction e; cbn [expression_free eval]; intro F; try reflexivity;
    try (apply andb_true_iff in F; destruct F as [F1 F2]; rewrite IHe1, IHe2 by assumption; reflexivity).
  destruct (ground env ts); [|reflexivity]. apply S, negb_true_iff, F.
Qed.
Lemma truth_agrees : forall d f env, formula_free X f = true -> truth P W d env f = truth P w d env f.
Proof.
  intros d. induction f; intro env; cbn [formula_free truth]; intro F; try reflexivity.
  - destruct (ground env ts); [|reflexivity]. f_equal. apply S, negb_true_iff, F.
  - apply andb_true_iff in F. destruct F as [F1 F2]. rewrite !eval_agrees by assumption. reflexivity.
  - rewrite IHf by exact F. reflexivity.
  - apply andb_true_iff in F. destruct F as [F1 F2]. rewrite IHf1, IHf2 by assumption. reflexivity.
  - induction (objects P type) as [|o os IH]; [reflexivity|]. cbn [fold_right]. rewrite IH, IHf by exact F. reflexivity.
Qed.
Lemma changes_agrees : forall d e env, effect_free X e = true -> changes P W d env e = changes P w d env e.
Proof.
  intros d. induction e; intro env; cbn [effect_free changes]; intro F; try reflexivity.
  - apply andb_true_iff in F. destruct F as [F1 F2]. rewrite eval_agrees by exact F2. reflexivity.
  - apply andb_true_iff in F. destruct F as [F1 F2]. rewrite IHe1, IHe2 by assumption. reflexivity.
  - apply andb_true_iff in F. destruct F as [F1 F2]. rewrite truth_agrees, IHe by assumption. reflexivity.
  - induction (objects P type) as [|o os IH]; [reflexivity|]. cbn [fold_right]. rewrite IH, IHe by exact F. reflexivity.
Qed.
Lemma heads_free : forall e p, effect_free X e = true -> In p (effect_heads e) -> added p = false.
Proof.
  induction e; intros q F I; cbn [effect_free effect_heads] in *.
  - destruct I.
  - destruct I as [<-|[]]. apply negb_true_iff, F.
  - apply andb_true_iff in F. destruct F as [F _]. destruct I as [<-|[]]. apply negb_true_iff, F.
  - apply andb_true_iff in F. destruct F as [F1 F2]. apply in_app_or in I. destruct I; eauto.
  - apply andb_true_iff in F. destruct F as [F1 F2]. eauto.
  - eauto.
Qed.
Lemma updates_agrees : forall cs fs, (forall f, In f fs -> added (fst f) = false) -> updates W cs fs = updates w cs fs.
Proof.
  intros cs. induction fs as [|f fs IH]; intro F; [reflexivity|]. cbn [updates].
  rewrite IH by (intros g I; apply F; right; exact I). rewrite (proj2 S f) by (apply F; left; reflexivity). reflexivity.
Qed.
(* The same happening in both worlds *)
Lemma happening_agrees : forall d env f e w1, formula_free X f = true -> effect_free X e = true ->
  happening P w d env f e = Some w1 -> exists W1, happening E W d env f e = Some W1 /\ same w1 W1 /\
    (forall a, added (fst a) = true -> holds_in W1 a = holds_in W a) /\
    (forall g, added (fst g) = true -> value_in W1 g = value_in W g).
Proof.
  intros d env f e w1 F G H. change (happening E) with (happening P). unfold happening in *.
  rewrite truth_agrees by exact F. rewrite changes_agrees by exact G.
  destruct (truth P w d env f) as [[]|]; try discriminate.
  destruct (changes P w d env e) as [cs|] eqn:C; [|discriminate].
  assert (Hd : forall c, In c cs -> added (head c) = false).
  { intros c I. apply (heads_free e); [exact G|]. eapply changes_heads; eassumption. }
  rewrite updates_agrees.
  2: { intros g I. apply targets_In in I. destruct I as [b [q I]]. exact (Hd _ I). }
  destruct (updates w cs (changed_fluents cs)) as [l|] eqn:U; [|discriminate]. injection H as <-.
  eexists. split; [reflexivity|]. split; [|split]; cbn [holds_in value_in].
  - split; cbn [holds_in value_in].
    + intros a A. rewrite (proj1 S a A). reflexivity.
    + intros g A. rewrite (proj2 S g A). reflexivity.
  - intros a A. assert (Y : forall b, sets_atom cs a b = false).
    { intro b. destruct (sets_atom cs a b) eqn:Z; [|reflexivity]. unfold sets_atom in Z.
      apply existsb_exists in Z. destruct Z as [[a' b'|] [I Z]]; [|discriminate].
      apply andb_true_iff in Z. destruct Z as [Z _]. apply atom_eqb_eq in Z. subst a'. specialize (Hd _ I).
      simpl in Hd. congruence. }
    rewrite !Y. reflexivity.
  - intros g A. destruct (assoc g l) as [q|] eqn:Al; [|reflexivity]. exfalso.
    apply (updates_targets _ _ _ _ _ _ U) in Al. apply targets_In in Al.
    destruct Al as [b [q' I]]. specialize (Hd _ I). simpl in Hd. congruence.
Qed.
End Agreement.
Lemma occur_agrees : forall w W v, same w W -> same (occur w v) (occur W v).
Proof.
  intros w W v S. split; cbn [occur holds_in value_in].
  - intros a A. destruct (assoc a (sets v)); [reflexivity|apply S, A].
  - intros f A. apply S, A.
Qed.
Lemma occur_added : forall W v a, In v events -> added (fst a) = true -> holds_in (occur W v) a = holds_in W a.
Proof.
  intros W v a I A. cbn [occur holds_in]. destruct (assoc a (sets v)) as [b|] eqn:As; [|reflexivity]. exfalso.
  destruct all_parts as [_ [_ [_ [_ [_ [B _]]]]]]. destruct (B a b) as [_ B']; [|congruence].
  apply in_flat_map. exists v. split; [exact I|]. apply assoc_In, As.
Qed.

(* The order of the events *)
Lemma sorted_pairs : ForallOrdPairs (fun u v => time u < time v) events.
Proof.
  destruct all_parts as [_ [_ [_ [So _]]]]. revert So. generalize events as l. intro l.
  induction l as [|v r IH]; intro So; constructor.
  - simpl in So. apply andb_true_iff in So. destruct So as [F _]. rewrite forallb_forall in F. apply Forall_forall.
    intros u I. apply less_spec, F, I.
  - simpl in So. apply andb_true_iff in So. apply IH, So.
Qed.
Lemma downward : forall p q : event -> bool,
  (forall u v, time u < time v -> (p v = true -> p u = true) /\ (q v = true -> q u = true)) -> closed_down p q events.
Proof.
  intros p q H. unfold closed_down. pose proof sorted_pairs as S. revert S. generalize events as l. intros l S. induction S as [|v r F S IH]; constructor; [|exact IH].
  eapply Forall_impl; [|exact F]. intros u L. apply H, L.
Qed.
Lemma nth_up_to : forall t i v, nth_error events i = Some v -> Qle_bool (time v) t = Nat.ltb i (up_to t).
Proof.
  intros t i v Ev. apply (nth_filter (fun v => Qle_bool (time v) t)); [|exact Ev]. apply downward. intros x y L.
  rewrite !Qle_bool_iff. split; intro; lra.
Qed.
Lemma nth_before : forall t i v, nth_error events i = Some v -> less (time v) t = Nat.ltb i (before t).
Proof.
  intros t i v Ev. apply (nth_filter (fun v => less (time v) t)); [|exact Ev]. apply downward. intros x y L.
  rewrite !less_spec. split; intro; lra.
Qed.
Lemma after_until_slice : forall t u, t <= u -> after_until events t u = slice events (up_to t) (up_to u).
Proof.
  intros t u L. unfold after_until, slice, Timeline.up_to. rewrite <- (slice_filter (fun v => Qle_bool (time v) t) (fun v => Qle_bool (time v) u)).
  - reflexivity.
  - apply downward. intros x y M. rewrite !Qle_bool_iff. split; intro; lra.
  - intro v. rewrite !Qle_bool_iff. lra.
Qed.
Lemma between_slice : forall t u, t < u -> between events t u = slice events (up_to t) (before u).
Proof.
  intros t u L. unfold between, slice, Timeline.up_to, Timeline.before. rewrite <- (slice_filter (fun v => Qle_bool (time v) t) (fun v => less (time v) u)).
  - reflexivity.
  - apply downward. intros x y M. rewrite !Qle_bool_iff, !less_spec. split; intro; lra.
  - intro v. rewrite Qle_bool_iff, less_spec. lra.
Qed.
Lemma at_time_slice : forall t, at_time events t = slice events (before t) (up_to t).
Proof.
  intros t. unfold at_time, slice, Timeline.up_to, Timeline.before. rewrite <- (slice_filter (fun v => less (time v) t) (fun v => Qle_bool (time v) t)).
  - apply filter_ext. intro v. unfold less. rewrite negb_involutive. reflexivity.
  - apply downward. intros x y M. rewrite !Qle_bool_iff, !less_spec. split; intro; lra.
  - intro v. rewrite Qle_bool_iff, less_spec. lra.
Qed.
Lemma up_to_before : forall t, (up_to t = before t \/ up_to t = S (before t))%nat.
Proof.
  intro t. unfold Timeline.up_to, Timeline.before. pose proof sorted_pairs as S. revert S. generalize events as l. intros l S.
  induction S as [|v r F S IH]; [left; reflexivity|]. rewrite Forall_forall in F. cbn [filter].
  destruct (less (time v) t) eqn:L.
  - assert (Le : Qle_bool (time v) t = true) by (apply Qle_bool_iff; apply less_spec in L; lra). rewrite Le.
    cbn [length]. lia.
  - apply less_false in L. assert (N1 : filter (fun v => less (time v) t) r = []).
    { apply filter_none. intros u I. apply less_false. specialize (F u I). lra. }
    assert (N2 : filter (fun v => Qle_bool (time v) t) r = []).
    { apply filter_none. intros u I. apply le_false. specialize (F u I). lra. }
    rewrite N1, N2. destruct (Qle_bool (time v) t); cbn [length]; auto.
Qed.
Lemma up_to_length : forall t, (up_to t <= length events)%nat.
Proof. intro t. unfold Timeline.up_to. apply filter_short. Qed.
Lemma before_length : forall t, (before t <= length events)%nat.
Proof. intro t. unfold Timeline.before. apply filter_short. Qed.

(* The clock [c] represents the time [t]: no multiple of the unit is between them unless [c] is earlier. *)
Definition represents (c t : Q) : Prop := forall z : Z,
  (t <= inject_Z z * moment X -> c <= inject_Z z * moment X) /\ (t < inject_Z z * moment X -> c < inject_Z z * moment X).
Definition gridded (q : Q) : Prop := exists z, q == inject_Z z * moment X.
Lemma moment_positive : 0 < moment X.
Proof. reflexivity. Qed.
Lemma grid_ok : forall q, on_grid X q = true -> gridded q.
Proof.
  intros q H. unfold on_grid in H. apply Pos.eqb_eq in H. set (r := Qred (q * (Zpos (grid X) # 1))) in *.
  assert (Er : r == q * (Zpos (grid X) # 1)) by apply Qred_correct.
  assert (Ir : inject_Z (Qnum r) == r) by (unfold inject_Z; destruct r as [n d]; simpl in *; subst d; reflexivity).
  exists (Qnum r). rewrite Ir, Er. unfold moment. setoid_replace (q * (Zpos (grid X) # 1) * (1 # grid X)) with
    (q * ((Zpos (grid X) # 1) * (1 # grid X))) by ring.
  setoid_replace ((Zpos (grid X) # 1) * (1 # grid X)) with 1; [ring|]. unfold Qeq. simpl. lia.
Qed.
Lemma gridded_minus : forall a b, gridded a -> gridded b -> gridded (a - b).
Proof. intros a b [x A] [y B]. exists (x - y)%Z. rewrite A, B. unfold Z.sub. rewrite inject_Z_plus, inject_Z_opp. ring. Qed.
Lemma represents_limit : forall c t q, represents c t -> gridded q -> (t <= q -> c <= q) /\ (t < q -> c < q).
Proof. intros c t q R [z Z]. destruct (R z) as [A B]. split; intro H; [assert (t <= inject_Z z * moment X) by lra|
  assert (t < inject_Z z * moment X) by lra]; [apply A in H0|apply B in H0]; lra. Qed.
Lemma represents_comp : forall c t c' t', c == c' -> t == t' -> represents c t -> represents c' t'.
Proof. intros c t c' t' C D R z. destruct (R z) as [A B]. split; intro H; [assert (c <= inject_Z z * moment X) by (apply A; lra)|
  assert (c < inject_Z z * moment X) by (apply B; lra)]; lra. Qed.
Lemma represents_later : forall c t u, represents c t -> t <= u -> represents c u.
Proof. intros c t u R L z. destruct (R z) as [A B]. split; intro H; [apply A|apply B]; lra. Qed.
Lemma represents_plus : forall c t d, represents c t -> gridded d -> represents (c + d) (t + d).
Proof.
  intros c t d R [y D] z. destruct (R (z - y)%Z) as [A B].
  assert (M : inject_Z (z - y) * moment X == inject_Z z * moment X - d).
  { unfold Z.sub. rewrite inject_Z_plus, inject_Z_opp, D. ring. }
  split; intro H; [assert (c <= inject_Z (z - y) * moment X) by (apply A; lra)|
    assert (c < inject_Z (z - y) * moment X) by (apply B; lra)]; lra.
Qed.
Lemma represents_earlier : forall k t, k <= t -> represents k t.
Proof. intros k t L z. split; intro; lra. Qed.
Lemma represents_moment : forall k l t, gridded l -> l < t -> k < l + moment X -> represents k t.
Proof.
  intros k l t [y G] L K z.
  assert (M : l < inject_Z z * moment X -> k < inject_Z z * moment X).
  { intro H. rewrite G in H. apply Qmult_lt_r in H; [|exact moment_positive]. rewrite <- Zlt_Qlt in H.
    assert (S : inject_Z (y + 1) <= inject_Z z) by (rewrite <- Zle_Qle; lia).
    apply (Qmult_le_compat_r _ _ (moment X)) in S; [|discriminate]. rewrite inject_Z_plus in S.
    assert (Ex : (inject_Z y + inject_Z 1) * moment X == l + moment X) by (rewrite G; change (inject_Z 1) with 1; ring).
    lra. }
  split; intro H; [assert (k < inject_Z z * moment X) by (apply M; lra); lra|apply M; lra].
Qed.
Definition within (t : Q) (low : bool) (end_ : Q * bool) : Prop :=
  if low then (if snd end_ then fst end_ < t else fst end_ <= t) else (if snd end_ then t < fst end_ else t <= fst end_).
Lemma clock_represents : forall W g starts d d0 t c, value_in W (clock X) = Some c -> represents c t ->
  (forall l, In l starts -> within t true l) -> gridded d0 -> d == d0 -> 0 <= d -> clock_ok X g starts d0 = true ->
  represents (ev W g) (t + d).
Proof.
  intros W g starts d d0 t c V R S G D Nn H. unfold clock_ok in H. destruct g as [[|[a q] [|x l]] k]; [| |discriminate].
  - apply existsb_exists in H. destruct H as [[l st] [I H]]. specialize (S _ I). cbn [within fst snd] in *.
    apply orb_true_iff in H. destruct H as [H|H].
    + apply Qle_bool_iff in H. apply represents_earlier. rewrite ev_empty. destruct st; lra.
    + rewrite !andb_true_iff in H. destruct H as [[-> H1] H2]. apply grid_ok in H1. apply less_spec in H2.
      apply (represents_moment _ (l + d0)); [exact H1|lra|rewrite ev_empty; exact H2].
  - rewrite !andb_true_iff in H. destruct H as [[H1 H2] H3]. apply atom_eqb_eq in H1. subst a.
    apply Qeq_bool_iff in H2. assert (Ee : ev W ([(clock X, q)], k) == c + k).
    { rewrite ev_cons, ev_empty. cbn [fst snd]. rewrite V. cbn [default]. rewrite H2. ring. }
    apply orb_true_iff in H3. destruct H3 as [H3|H3]; apply Qeq_bool_iff in H3.
    + apply (represents_comp (c + d0) (t + d0)); [rewrite Ee, H3; reflexivity|rewrite D; reflexivity|].
      apply represents_plus; assumption.
    + apply (represents_comp c (t + d)); [rewrite Ee, H3; ring|reflexivity|]. apply (represents_later _ t); [exact R|lra].
Qed.

(* The range of start times of a passage *)
Definition passage_of (s d : Q) : passage := (before s, up_to s, before (s + d), up_to (s + d)).
Lemma before_comp : forall t u, t == u -> before t = before u.
Proof. intros t u H. unfold Timeline.before. f_equal. apply filter_ext. intro v. unfold less. f_equal.
apply Qleb_comp; [exact H|reflexivity]. Qed.
Lemma lower_within : forall s d l, 0 <= s -> In l (lower events (passage_of s d) d) -> within s true l.
Proof.
  intros s d l Z I. unfold lower, passage_of in I. destruct I as [<-|I]; [exact Z|].
  assert (L : forall x i v, (i < up_to x)%nat -> nth_error events i = Some v ->
    if Nat.eqb (before x) (up_to x) then time v < x else time v <= x).
  { intros x i v B Ev. pose proof (nth_up_to x i v Ev) as U. pose proof (nth_before x i v Ev) as V.
    destruct (Nat.eqb (before x) (up_to x)) eqn:Eq.
    - apply Nat.eqb_eq in Eq. apply less_spec. rewrite V. apply Nat.ltb_lt. lia.
    - apply Qle_bool_iff. rewrite U. apply Nat.ltb_lt. exact B. }
  apply in_app_or in I. destruct I as [I|I]; apply in_map_iff in I; destruct I as [t [<- I]]; unfold last_time, time_at in I.
  - destruct (up_to s) as [|j] eqn:U; [destruct I|]. destruct (nth_error events j) as [v|] eqn:Ev; [|destruct I].
    destruct I as [<-|[]]. specialize (L s j v). rewrite U in L. specialize (L (Nat.lt_succ_diag_r j) Ev).
    cbn [within fst snd]. exact L.
  - destruct (up_to (s + d)) as [|j] eqn:U; [destruct I|]. destruct (nth_error events j) as [v|] eqn:Ev; [|destruct I].
    destruct I as [<-|[]]. specialize (L (s + d) j v). rewrite U in L. specialize (L (Nat.lt_succ_diag_r j) Ev).
    cbn [within fst snd]. destruct (Nat.eqb (before (s + d)) (S j)); lra.
Qed.
Lemma upper_within : forall s d l, In l (upper events (passage_of s d) d) -> within s false l.
Proof.
  intros s d l I. unfold upper, passage_of in I.
  assert (L : forall x v, nth_error events (before x) = Some v ->
    if Nat.eqb (before x) (up_to x) then x < time v else x <= time v).
  { intros x v Ev. pose proof (nth_up_to x _ v Ev) as U. pose proof (nth_before x _ v Ev) as V.
    rewrite Nat.ltb_irrefl in V. apply less_false in V. destruct (Nat.eqb (before x) (up_to x)) eqn:Eq; [|exact V].
    apply Nat.eqb_eq in Eq. rewrite <- Eq, Nat.ltb_irrefl in U. apply le_false, U. }
  apply in_app_or in I. destruct I as [I|I]; apply in_map_iff in I; destruct I as [t [<- I]]; unfold time_at in I.
  - destruct (nth_error events (before s)) as [v|] eqn:Ev; [|destruct I]. destruct I as [<-|[]].
    exact (L _ _ Ev).
  - destruct (nth_error events (before (s + d))) as [v|] eqn:Ev; [|destruct I]. destruct I as [<-|[]].
    specialize (L _ _ Ev). cbn [within fst snd]. destruct (Nat.eqb (before (s + d)) (up_to (s + d))); lra.
Qed.
Lemma upper_gridded : forall g d l, gridded d -> In l (upper events g d) -> gridded (fst l).
Proof.
  intros [[[a b] c] e] d l D I. unfold upper in I.
  assert (L : forall i t, In t (time_at events i) -> gridded t).
  { intros i t J. unfold time_at in J. destruct (nth_error events i) as [v|] eqn:Ev; [|destruct J]. destruct J as [<-|[]].
    apply grid_ok. destruct all_parts as [_ [_ [_ [_ [G _]]]]]. apply G. eapply nth_error_In, Ev. }
  apply in_app_or in I. destruct I as [I|I]; apply in_map_iff in I; destruct I as [t [<- I]]; cbn [fst];
    [apply (L _ _ I)|apply gridded_minus; [apply (L _ _ I)|exact D]].
Qed.
Lemma feasible_passage : forall s d, 0 <= s -> feasible events (passage_of s d) d = true.
Proof.
  intros s d Z. unfold feasible. apply forallb_forall. intros l I. apply forallb_forall. intros u J.
  apply (lower_within s d l Z) in I. apply (upper_within s d u) in J. unfold within in *.
  destruct (snd l), (snd u); simpl; rewrite ?less_spec, ?Qle_bool_iff; lra.
Qed.
Lemma in_passages : forall s d, 0 <= d -> In (passage_of s d) (passages events).
Proof.
  intros s d Z. unfold passages, passage_of. cbv zeta.
  assert (M : (before s <= before (s + d))%nat).
  { unfold Timeline.before. generalize events as l. induction l as [|v l IH]; [reflexivity|]. cbn [filter].
    destruct (less (time v) s) eqn:A, (less (time v) (s + d)) eqn:B; cbn [length]; try lia. exfalso.
    apply less_spec in A. apply less_false in B. lra. }
  assert (Nx : forall t, In (up_to t) (filter (fun b => Nat.leb b (length events)) [before t; S (before t)])).
  { intro t. apply filter_In. split; [destruct (up_to_before t) as [->| ->]; [left|right; left]; reflexivity|].
    apply Nat.leb_le, up_to_length. }
  apply in_flat_map. exists (before s). split; [apply in_seq; pose proof (before_length s); lia|].
  apply in_flat_map. exists (up_to s). split; [apply Nx|].
  apply in_flat_map. exists (before (s + d)). split; [apply in_seq; pose proof (before_length (s + d)); lia|].
  apply in_map, Nx.
Qed.

(* The worlds and states that belong together after [i] events at time [t] *)
Record Related (w W : world) (i : nat) (t : Q) (s : state) : Prop := {
  g_base : Base E T N W s;
  g_same : same w W;
  g_phase : forall j, (j <= length events)%nat -> holds_in W (phase j) = Nat.eqb i j;
  g_clock : exists c, value_in W (clock X) = Some c /\ represents c t }.
Lemma added_phase : forall j, added (fst (phase j)) = true.
Proof.
  intro j. unfold Timeline.phase, is_added. apply existsb_exists. exists (fst (nth j (phase_atoms X) (waited X))).
  split; [|apply Pos.eqb_refl]. destruct (nth_in_or_default j (phase_atoms X) (waited X)) as [I| ->].
  - right. right. apply in_map, I.
  - left. reflexivity.
Qed.
Lemma added_waited : added (fst (waited X)) = true.
Proof. unfold is_added. cbn [existsb]. rewrite Pos.eqb_refl. reflexivity. Qed.
Lemma added_clock : added (fst (clock X)) = true.
Proof. unfold is_added. cbn [existsb]. rewrite Pos.eqb_refl, orb_true_r. reflexivity. Qed.
Lemma differ_nth : forall l d, differ l = true -> forall i j, (i < length l)%nat -> (j < length l)%nat ->
  atom_eqb (nth i l d) (nth j l d) = Nat.eqb i j.
Proof.
  induction l as [|a l IH]; intros d D i j I J; [inversion I|]. simpl in D. apply andb_true_iff in D.
  destruct D as [D1 D2]. apply negb_true_iff in D1.
  assert (Nm : forall i, (i < length l)%nat -> atom_eqb a (nth i l d) = false).
  { intros x Lx. destruct (atom_eqb a (nth x l d)) eqn:Eq; [|reflexivity].
    assert (existsb (atom_eqb a) l = true) by (apply existsb_exists; exists (nth x l d); split; [apply nth_In, Lx|exact Eq]).
    congruence. }
  destruct i as [|i], j as [|j]; cbn [nth length] in *.
  - apply atom_eqb_refl.
  - rewrite Nm by lia. reflexivity.
  - destruct (atom_eqb (nth i l d) a) eqn:Eq; [|reflexivity]. apply atom_eqb_eq in Eq.
    specialize (Nm i). rewrite Eq, atom_eqb_refl in Nm. discriminate Nm. lia.
  - apply (IH d D2 i j); lia.
Qed.
Lemma phase_eq : forall i j, (i <= length events)%nat -> (j <= length events)%nat -> atom_eqb (phase i) (phase j) = Nat.eqb i j.
Proof.
  intros i j I J. destruct all_parts as [_ [_ [_ [_ [_ [_ [_ [D [L _]]]]]]]]].
  apply (differ_nth (waited X :: phase_atoms X) (waited X) D (S i) (S j)); cbn [length]; lia.
Qed.
Lemma waited_eq : forall j, (j <= length events)%nat -> atom_eqb (phase j) (waited X) = false.
Proof.
  intros j J. destruct all_parts as [_ [_ [_ [_ [_ [_ [_ [D [L _]]]]]]]]].
  apply (differ_nth (waited X :: phase_atoms X) (waited X) D (S j) 0%nat); cbn [length]; lia.
Qed.
Lemma derived_nothing : forall W, W = derived_world E W.
Proof. intros [h v]. reflexivity. Qed.
Lemma faithful_part : faithful E T N (fun _ _ => Decided None) goal_case = true.
Proof. apply all_parts. Qed.
Lemma related_rel : forall W s, Base E T N W s -> Rel E T N W s.
Proof.
  intros W s B. pose proof (derived_related E T N _ goal_case task_ok faithful_part W s B) as R.
  rewrite <- derived_nothing in R. exact R.
Qed.

(* A world with other values of added atoms and of the clock *)
Definition mark (marks : list (atom * bool)) (q : Q) (W : world) : world :=
  World (fun a => match assoc a marks with Some b => b | None => holds_in W a end)
        (fun f => if atom_eqb f (clock X) then Some q else value_in W f).
Lemma mark_same : forall w W marks q, (forall a b, In (a, b) marks -> added (fst a) = true) -> same w W ->
  same w (mark marks q W).
Proof.
  intros w W marks q M S. split; cbn [mark holds_in value_in].
  - intros a A. destruct (assoc a marks) as [b|] eqn:As; [|apply S, A]. apply assoc_In, M in As. congruence.
  - intros f A. destruct (atom_eqb f (clock X)) eqn:Eq; [|apply S, A]. apply atom_eqb_eq in Eq. subst f.
    rewrite added_clock in A. discriminate.
Qed.
(* Plans of the ground task that begin with the operators of a step *)
Definition leads (s s' : state) (gain : Q) : Prop := forall ps c, Task.plan T s' ps c ->
  exists ps' c', Task.plan T s ps' c' /\ inject_Z c' <= inject_Z c + gain * (Zpos (cost_scale N) # 1).
Lemma leads_trans : forall a b c x y, leads a b x -> leads b c y -> leads a c (x + y).
Proof.
  intros a b c x y A B ps n Pl. destruct (B _ _ Pl) as [ps1 [n1 [P1 L1]]]. destruct (A _ _ P1) as [ps2 [n2 [P2 L2]]].
  exists ps2, n2. split; [exact P2|]. setoid_replace ((x + y) * (Zpos (cost_scale N) # 1)) with
    (x * (Zpos (cost_scale N) # 1) + y * (Zpos (cost_scale N) # 1)) by ring. lra.
Qed.
Lemma closing : forall W W1 s k sy t marks starts d o, Base E T N W s -> Knows W k -> DescribesIn E W W1 sy ->
  keeps_statics N W W1 -> (forall a b, In (a, b) marks -> added (fst a) = true) ->
  with_operator T (closes P events T N X k sy t marks starts d) o = true ->
  exists g s2, let W2 := mark marks (ev W g) W1 in
    Base E T N W2 s2 /\ clock_ok X g starts d = true /\
    leads s s2 (measure E N W2 - measure E N W + per_time P * t).
Proof.
  intros W W1 s k sy t marks starts d o B K D Ks M H. pose proof (related_rel W s B) as R.
  assert (H' : exists o, match o with Some (o, _) => In o (operators T) | None => True end /\
    closes P events T N X k sy t marks starts d o = true).
  { unfold with_operator in H. destruct o as [[j ch]|]; [|exists None; split; [exact Logic.I|exact H]].
    destruct (nth_error (operators T) j) as [o|] eqn:Nj; [|discriminate]. exists (Some (o, ch)).
    split; [eapply nth_error_In, Nj|exact H]. }
  clear H o. destruct H' as [o [Io H]]. unfold closes in H. destruct (new_clock N X o) as [g|]; [|discriminate].
  set (sy2 := Symbolic (marks ++ new_truths sy) ((clock X, g) :: new_values sy) (stale sy)) in *.
  rewrite !andb_true_iff in H. destruct H as [[[[H1 H2] H3] H4] H5].
  assert (Ch : forall p, added p = true -> changing N p = true) by apply all_parts.
  assert (D2 : DescribesIn E W (mark marks (ev W g) W1) sy2).
  { split.
    - intros a St. cbn [mark holds_in sy2 new_truths]. rewrite assoc_app. destruct (assoc a marks); [reflexivity|].
      apply (d_fact _ _ _ _ D). exact St.
    - intro f. cbn [mark value_in sy2 new_values assoc]. destruct (atom_eqb f (clock X)).
      + exists (ev W g). split; reflexivity.
      + apply (d_value _ _ _ _ D). }
  assert (Sf : forall p os, changing N p = false -> holds_in (mark marks (ev W g) W1) (p, os) = holds_in W (p, os)).
  { intros p os C. cbn [mark holds_in]. destruct (assoc (p, os) marks) as [b|] eqn:As.
    - apply assoc_In, M, Ch in As. cbn [fst] in As. congruence.
    - apply Ks, C. }
  assert (Sv : forall f, changing N (fst f) = false -> value_in (mark marks (ev W g) W1) f = value_in W f).
  { intros f C. cbn [mark value_in]. destruct (atom_eqb f (clock X)) eqn:Eq.
    - apply atom_eqb_eq in Eq. subst f. rewrite (Ch _ added_clock) in C. discriminate.
    - apply Ks, C. }
  destruct (simulated_ok E T N _ goal_case task_ok faithful_part W s R W (derived_nothing W) k K sy2 t o
    (mark marks (ev W g) W1) D2 Sf Sv H2 H3 H4 Io H5) as [B2 [Ad [gr [G1 G2]]]].
  exists g, (after_of T s o). cbv zeta. split; [exact B2|]. split; [exact H1|].
  assert (Mg : gr == measure E N (mark marks (ev W g) W1) - measure E N W + per_time P * t).
  { unfold growth in G1. unfold measure.
    destruct (symbolic_expression E N unchanged Undefined [] (metric E)) as [| |f] eqn:E0;
      destruct (symbolic_expression E N sy2 Undefined [] (metric E)) as [| |h] eqn:E1;
        cbn [plus_result] in G1; try discriminate.
    pose proof (measure_changes E T N W _ s sy2 (metric E) f h R Sv (d_value _ _ _ _ D2) E0 E1) as Y1.
    pose proof (ev_plus_form W h (-1 # 1) f) as Y.
    destruct (plus_form h (-1 # 1) f) as [[|] z]; [|discriminate]. injection G1 as <-.
    rewrite ev_empty in Y. rewrite Y1, Y. cbn [extended per_time per_step]. ring. }
  intros ps c Pl. rewrite Mg in G2. destruct o as [[o ch]|]; cbn [after_of step_cost] in *.
  - exists ((o, ch) :: ps), (amount (cost o) (slot_sizes o) ch + c)%Z. destruct Ad as [Ad1 Ad2].
    split; [constructor; assumption|]. rewrite inject_Z_plus. lra.
  - exists ps, c. split; [exact Pl|]. change (inject_Z 0) with 0 in G2. lra.
Qed.

(* Events *)
Lemma event_sets : forall v a b, In v events -> assoc a (sets v) = Some b -> changing N (fst a) = true /\ added (fst a) = false.
Proof.
  intros v a b I As. destruct all_parts as [_ [_ [_ [_ [_ [B _]]]]]]. apply (B a b). apply in_flat_map. exists v.
  split; [exact I|]. apply assoc_In, As.
Qed.
Lemma statics_trans : forall a b c, keeps_statics N a b -> keeps_statics N b c -> keeps_statics N a c.
Proof. intros a b c [A1 A2] [B1 B2]. split; intros; [rewrite B1, A1 by assumption|rewrite B2, A2 by assumption]; reflexivity. Qed.
Lemma elapse_all : forall vs, (forall v, In v vs -> In v events) -> forall w W1 W0 sy, same w W1 -> DescribesIn E W0 W1 sy ->
  same (elapse w vs) (elapse W1 vs) /\ DescribesIn E W0 (elapse W1 vs) (fold_left put_sets vs sy) /\
  keeps_statics N W1 (elapse W1 vs) /\ (forall a, added (fst a) = true -> holds_in (elapse W1 vs) a = holds_in W1 a) /\
  value_in (elapse W1 vs) = value_in W1.
Proof.
  unfold elapse. induction vs as [|v vs IH]; intros Iv w W1 W0 sy S D; cbn [fold_left].
  - split; [exact S|]. split; [exact D|]. split; [split; reflexivity|]. split; reflexivity.
  - pose proof (Iv v (or_introl eq_refl)) as I.
    destruct (IH (fun u J => Iv u (or_intror J)) (occur w v) (occur W1 v) W0 (put_sets sy v)) as [A1 [A2 [A3 [A4 A5]]]].
    + apply occur_agrees, S.
    + split; [|exact (d_value _ _ _ _ D)]. intros a St. cbn [put_sets new_truths occur holds_in]. rewrite assoc_app.
      destruct (assoc a (sets v)); [reflexivity|]. apply (d_fact _ _ _ _ D), St.
    + split; [exact A1|]. split; [exact A2|]. split; [|split].
      * apply (statics_trans _ (occur W1 v)); [|exact A3]. split; [|reflexivity]. intros p os C. cbn [occur holds_in].
        destruct (assoc (p, os) (sets v)) as [b|] eqn:As; [|reflexivity]. apply (event_sets _ _ _ I) in As.
        destruct As as [As _]. cbn [fst] in As. congruence.
      * intros a Aa. rewrite A4 by exact Aa. apply occur_added; assumption.
      * rewrite A5. reflexivity.
Qed.
Lemma slice_in : forall i j v, In v (slice events i j) -> In v events.
Proof.
  intros i j v I. unfold slice in I. rewrite <- (firstn_skipn j events). apply in_or_app. left.
  rewrite <- (firstn_skipn i (firstn j events)). apply in_or_app. right. exact I.
Qed.
Lemma slice_cons : forall (l : list event) i j v, nth_error l i = Some v -> (i < j)%nat ->
  skipn i (firstn j l) = v :: skipn (S i) (firstn j l).
Proof.
  induction l as [|u l IH]; intros i j v Ev L; [destruct i; discriminate|]. destruct j as [|j]; [lia|].
  destruct i as [|i]; cbn [nth_error firstn skipn] in *; [injection Ev as ->; reflexivity|]. apply IH; [exact Ev|lia].
Qed.
Lemma related_later : forall w W i t u s, Related w W i t s -> t <= u -> Related w W i u s.
Proof. intros w W i t u s [B Sm Ph [c [V R]]] L. split; auto. exists c. split; [exact V|]. eapply represents_later; eassumption. Qed.
Lemma wait_step : forall w W i t s v, Related w W i t s -> nth_error events i = Some v -> t <= time v ->
  exists W' s', Related (occur w v) W' (S i) (time v) s' /\ leads s s' (measure E N W' - measure E N W).
Proof.
  intros w W i t s v [B Sm Ph [c [V R]]] Ev L. pose proof (related_rel W s B) as Rl.
  assert (Li : (i < length events)%nat) by (apply nth_error_Some; congruence).
  destruct all_parts as [_ [_ [_ [_ [_ [_ [_ [_ [_ [_ [_ [_ [Wo _]]]]]]]]]]]]]. specialize (Wo _ _ Ev). unfold wait_ok in Wo.
  refine (tree_cases E T N _ goal_case task_ok faithful_part W s Rl W (derived_nothing W) _ _ _ _ _ _ Wo).
  2: { apply (knows_invariants E T N W s Rl). split; [|intros st f []]. intros a b I. destruct I as [I|[]].
    injection I as <- <-. rewrite Ph by lia. apply Nat.eqb_refl. }
  intros k o K H. unfold wait_leaf in H.
  assert (Iv : forall u, In u [v] -> In u events) by (intros u [<-|[]]; eapply nth_error_In, Ev).
  destruct (elapse_all [v] Iv w W W unchanged Sm (describes_itself E W)) as [A1 [A2 [A3 [A4 A5]]]].
  set (marks := [(phase (S i), true); (phase i, false); (waited X, true)]) in *.
  assert (M : forall a b, In (a, b) marks -> added (fst a) = true).
  { intros a b [I|[I|[I|[]]]]; injection I as <- <-; auto using added_phase, added_waited. }
  destruct (closing W (elapse W [v]) s k (put_sets unchanged v) 0 marks [(time v, false)] 0 o B K A2 A3 M H)
    as [g [s2 [B2 [Co Le]]]].
  exists (mark marks (ev W g) (elapse W [v])), s2. split.
  - split; [exact B2|apply mark_same; assumption| |].
    + intros j Lj. cbn [mark holds_in marks assoc]. rewrite !phase_eq by lia. rewrite waited_eq by exact Lj.
      destruct (Nat.eqb j (S i)) eqn:E1; [apply Nat.eqb_eq in E1; subst j; symmetry; apply Nat.eqb_refl|].
      apply Nat.eqb_neq in E1. assert (Nj : Nat.eqb (S i) j = false) by (apply Nat.eqb_neq; lia).
      rewrite Nj. destruct (Nat.eqb j i) eqn:E2; [reflexivity|]. apply Nat.eqb_neq in E2.
      rewrite A4 by apply added_phase. rewrite Ph by exact Lj. apply Nat.eqb_neq. lia.
    + exists (ev W g). split; [cbn [mark value_in]; rewrite atom_eqb_refl; reflexivity|].
      apply (represents_comp (ev W g) (time v + 0)); [reflexivity|ring|].
      apply (clock_represents W g [(time v, false)] 0 0 (time v) c V); auto.
      * eapply represents_later; eassumption.
      * intros l [<-|[]]. cbn [within fst snd]. lra.
      * exists 0%Z. ring.
      * reflexivity.
      * lra.
  - intros ps n Pl. destruct (Le ps n Pl) as [ps' [n' [P1 P2]]]. exists ps', n'. split; [exact P1|].
    setoid_replace (measure E N (mark marks (ev W g) (elapse W [v])) - measure E N W + per_time P * 0) with
      (measure E N (mark marks (ev W g) (elapse W [v])) - measure E N W) in P2 by ring. exact P2.
Qed.
Lemma waits : forall n w W i t b s, Related w W i t s -> (i + n <= length events)%nat -> t <= b ->
  (forall v, nth_error events i = Some v -> t <= time v) ->
  (forall j v, (j < i + n)%nat -> nth_error events j = Some v -> time v <= b) ->
  exists W' s', Related (elapse w (slice events i (i + n))) W' (i + n) b s' /\ leads s s' (measure E N W' - measure E N W).
Proof.
  induction n as [|n IH]; intros w W i t b s Re Ln Lb Lt Lj.
  - exists W, s. rewrite Nat.add_0_r. unfold slice. rewrite skipn_all2 by apply firstn_le_length. split; [exact (related_later _ _ _ _ _ _ Re Lb)|].
    intros ps c Pl. exists ps, c. split; [exact Pl|]. setoid_replace ((measure E N W - measure E N W) * (Zpos (cost_scale N) # 1)) with 0 by ring. lra.
  - destruct (nth_error events i) as [v|] eqn:Ev; [|apply nth_error_None in Ev; lia].
    destruct (wait_step w W i t s v Re Ev (Lt v eq_refl)) as [W1 [s1 [Re1 Le1]]].
    destruct (IH (occur w v) W1 (S i) (time v) b s1 Re1) as [W2 [s2 [Re2 Le2]]]; [lia|apply (Lj i); [lia|exact Ev]| |intros j u Lu; apply Lj; lia|].
    + intros u Eu. destruct (Qlt_le_dec (time u) (time v)) as [L|L]; [|exact L]. exfalso.
      apply less_spec in L. rewrite (nth_before _ _ _ Eu) in L. apply Nat.ltb_lt in L.
      pose proof (nth_before (time v) i v Ev) as U. assert (X1 : less (time v) (time v) = true) by (rewrite U; apply Nat.ltb_lt; lia).
      apply less_spec in X1. lra.
    + exists W2, s2. unfold slice in *. rewrite (slice_cons _ _ _ _ Ev) by lia. replace (i + S n)%nat with (S i + n)%nat by lia.
      split; [exact Re2|]. intros ps c Pl. destruct (leads_trans _ _ _ _ _ Le1 Le2 ps c Pl) as [ps' [c' [P1 P2]]].
      exists ps', c'. split; [exact P1|]. setoid_replace ((measure E N W2 - measure E N W) * (Zpos (cost_scale N) # 1)) with
        ((measure E N W1 - measure E N W + (measure E N W2 - measure E N W1)) * (Zpos (cost_scale N) # 1)) by ring. exact P2.
Qed.

(* The symbolic evaluation of a step that starts in [W0] *)
Section Step.
Variables (W0 : world) (s0 : state) (k : knowledge).
Hypothesis B0 : Base E T N W0 s0.
Hypothesis K : Knows W0 k.
Lemma knows_base : forall a b, base_truth E T N k a = Some b -> holds_in W0 a = b.
Proof. exact (base_truth_ok E T N _ goal_case task_ok faithful_part W0 s0 (related_rel _ _ B0) k K). Qed.
Lemma knows_values : forall f, changing N (fst f) = false -> value_in W0 f = value_in (initial E) f.
Proof. exact (static_value E T N W0 s0 (related_rel _ _ B0)). Qed.
Lemma happens_ok : forall W1 sy d r t env f e W2, DescribesIn E W0 W1 sy -> agrees W0 d r ->
  happening E W1 d env f e = Some W2 ->
  match symbolic_happening E T N k sy r t env f e with Never => False | Unclear => True
    | After s' t' => t' = t /\ DescribesIn E W0 W2 s' end.
Proof. exact (symbolic_happening_ok E T N W0 k knows_base knows_values K). Qed.
Lemma interferes_ok : forall w1 W1 sy d r env f e t, DescribesIn E W0 W1 sy -> agrees W0 d r -> same w1 W1 ->
  effect_free X e = true -> (exists cs, changes P w1 d env e = Some cs) -> interferes P events w1 d env f e t = false ->
  surely_interferes P events T N X k sy r env f e (slice events (before t) (up_to t)) = false.
Proof.
  intros w1 W1 sy d r env f e t D A Sm F [cs Cs] H. destruct (surely_interferes P events T N X k sy r env f e _) eqn:Si; [|reflexivity].
  rewrite <- H. symmetry. unfold surely_interferes in Si. apply existsb_exists in Si. destruct Si as [[a b] [I Si]].
  unfold interferes. apply existsb_exists. exists (a, b). rewrite at_time_slice. split; [exact I|]. cbn [fst snd] in *.
  apply orb_true_iff in Si. apply orb_true_iff. destruct Si as [Si|Si]; [left; exact Si|right]. rewrite Cs.
  destruct (symbolic_changes E T N k sy r env e) as [ss|] eqn:Sc; [|discriminate].
  rewrite <- (changes_agrees w1 W1 Sm d e env F) in Cs.
  pose proof (symbolic_changes_ok E T N W0 k knows_base knows_values K W1 sy d r D A e env cs ss Cs Sc) as Fm.
  rewrite (truths_ok _ _ _ _ _ Fm) in Si. destruct (sets_atom cs a (negb b)); [reflexivity|discriminate].
Qed.
Lemma pass_ok : forall vs, (forall v, In v vs -> In v events) -> forall w1 W1 sy d r env f w2, DescribesIn E W0 W1 sy -> agrees W0 d r ->
  same w1 W1 -> formula_free X f = true -> pass P w1 d env f vs = Some w2 ->
  w2 = elapse w1 vs /\ symbolic_pass P events T N X k sy r env f vs = Some (fold_left put_sets vs sy).
Proof.
  induction vs as [|v vs IH]; intros Iv w1 W1 sy d r env f w2 D A Sm F H; cbn [pass symbolic_pass] in *.
  - injection H as <-. split; reflexivity.
  - destruct (truth P w1 d env f) as [[]|] eqn:Tr; try discriminate.
    assert (I1 : forall u, In u [v] -> In u events) by (intros u [<-|[]]; apply Iv; left; reflexivity).
    destruct (elapse_all [v] I1 w1 W1 W0 sy Sm D) as [A1 [A2 _]].
    destruct (IH (fun u J => Iv u (or_intror J)) (occur w1 v) (occur W1 v) (put_sets sy v) d r env f w2 A2 A A1 F H) as [C1 C2].
    split; [exact C1|]. cbn [fold_left]. rewrite C2.
    destruct (symbolic_truth E T N k sy r env f) as [[]|] eqn:St; try reflexivity. exfalso.
    apply (symbolic_truth_ok E T N W0 k knows_base knows_values K W1 sy d r D A) in St. apply St.
    change (truth E) with (truth P). rewrite (truth_agrees w1 W1 Sm d f env F). exact Tr.
Qed.
End Step.

(* A step without the events before it *)
Definition inner (w : world) (s : Q) (a : action) (env : list key) : option (world * Q) :=
  match duration a with
  | None => if interferes P events w None env (at_start a) (start_effect a) s then None
            else option_map (fun w => (w, 0)) (happening P w None env (at_start a) (start_effect a))
  | Some x =>
      match eval w None env x with
      | None => None
      | Some d =>
          if less d 0 then None
          else if Qeq_bool d 0 then
            let f := And (at_start a) (at_end a) in let e := Both (start_effect a) (end_effect a) in
            if negb true || interferes P events w (Some d) env f e s then None
            else option_map (fun w => (w, d)) (happening P w (Some d) env f e)
          else if interferes P events w (Some d) env (at_start a) (start_effect a) s then None
          else match happening P w (Some d) env (at_start a) (start_effect a) with
          | None => None
          | Some w1 =>
              match pass P w1 (Some d) env (over_all a) (between events s (s + d)) with
              | None => None
              | Some w2 =>
                  if interferes P events w2 (Some d) env (at_end a) (end_effect a) (s + d) then None
                  else option_map (fun w => (elapse w (at_time events (s + d)), d))
                    (happening P w2 (Some d) env (And (over_all a) (at_end a)) (end_effect a))
              end
          end
      end
  end.
Definition runs (W0 W3 : world) (s d : Q) (dd : option Q) (a : action) (env : list key) : Prop :=
  forall st k r q, Base E T N W0 st -> Knows W0 k -> agrees W0 dd r -> d == q ->
    match symbolic_timed_step P events T N X k a env (passage_of s d) r q with
    | Never => False | Unclear => True | After sy t => t == d /\ DescribesIn E W0 W3 sy end.
Lemma happening_changes_some : forall w d env f e w1, happening P w d env f e = Some w1 -> exists cs, changes P w d env e = Some cs.
Proof.
  intros w d env f e w1 H. unfold happening in H. destruct (truth P w d env f) as [[]|]; try discriminate.
  destruct (changes P w d env e) as [cs|]; [|discriminate]. exists cs. reflexivity.
Qed.
Lemma inner_runs : forall w0 W0 s a env w' d, inner w0 s a env = Some (w', d) -> same w0 W0 -> action_free X a = true ->
  forallb (changing N) (effect_heads (start_effect a) ++ effect_heads (end_effect a)) = true ->
  exists W3 dd, same w' W3 /\ keeps_statics N W0 W3 /\
    (forall x, added (fst x) = true -> holds_in W3 x = holds_in W0 x) /\
    (forall x, added (fst x) = true -> value_in W3 x = value_in W0 x) /\ 0 <= d /\
    truth P W0 dd env (at_start a) = Some true /\
    match duration a with None => dd = None /\ d = 0 | Some x => eval w0 None env x = Some d /\ dd = Some d end /\
    runs W0 W3 s d dd a env.
Proof.
  intros w0 W0 s a env w' d H Sm F C. unfold action_free in F. rewrite !andb_true_iff in F.
  destruct F as [[[[[F1 F2] F3] F4] F5] F6]. pose proof C as C0. rewrite forallb_app in C. apply andb_true_iff in C. destruct C as [C1 C2].
  unfold inner in H. unfold runs, symbolic_timed_step, passage_of. destruct (duration a) as [x|] eqn:Du.
  2: { destruct (interferes _ _ _ _ _ _ _ _) eqn:If; [discriminate|].
    destruct (happening P w0 None env (at_start a) (start_effect a)) as [w1|] eqn:Hp; [|discriminate]. injection H as <- <-.
    destruct (happening_agrees w0 W0 Sm None env _ _ w1 F1 F2 Hp) as [W1 [H1 [S1 [A1 V1]]]].
    exists W1, None. split; [exact S1|]. split; [exact (happening_statics E N _ _ _ _ _ _ C1 H1)|].
    split; [exact A1|]. split; [exact V1|]. split; [lra|]. split; [exact (happening_holds E _ _ _ _ _ _ H1)|].
    split; [split; reflexivity|]. intros st k r q B K A Eq.
    rewrite (interferes_ok W0 st k B K w0 W0 unchanged None r env _ _ s (describes_itself E W0) A Sm F2 (happening_changes_some _ _ _ _ _ _ Hp) If).
    pose proof (happens_ok W0 st k B K W0 unchanged None r 0 env _ _ W1 (describes_itself E W0) A H1) as Q.
    destruct (symbolic_happening _ _ _ _ _ _ _ _ _ _); [exact Q|exact Q|]. destruct Q as [-> Q]. split; [reflexivity|exact Q]. }
  destruct (eval w0 None env x) as [d0|] eqn:Ev; [|discriminate]. destruct (less d0 0) eqn:Ls; [discriminate|]. apply less_false in Ls.
  destruct (Qeq_bool d0 0) eqn:Z.
  - cbv zeta in H. cbn [negb orb] in H. destruct (interferes _ _ _ _ _ _ _ _) eqn:If; [discriminate|].
    destruct (happening P w0 (Some d0) env (And (at_start a) (at_end a)) (Both (start_effect a) (end_effect a))) as [w1|] eqn:Hp; [|discriminate].
    injection H as <- <-.
    assert (Fa : formula_free X (And (at_start a) (at_end a)) = true) by (cbn [formula_free]; rewrite F1, F4; reflexivity).
    assert (Fe : effect_free X (Both (start_effect a) (end_effect a)) = true) by (cbn [effect_free]; rewrite F2, F5; reflexivity).
    destruct (happening_agrees w0 W0 Sm (Some d0) env _ _ w1 Fa Fe Hp) as [W1 [H1 [S1 [A1 V1]]]].
    exists W1, (Some d0). split; [exact S1|].
    split; [refine (happening_statics E N _ _ _ _ _ _ _ H1); cbn [effect_heads]; exact C0|].
    split; [exact A1|]. split; [exact V1|]. split; [exact Ls|].
    split. { pose proof (happening_holds E _ _ _ _ _ _ H1) as Tr. change (truth E) with (truth P) in Tr. cbn [truth] in Tr.
      destruct (truth P W0 (Some d0) env (at_start a)) as [[]|], (truth P W0 (Some d0) env (at_end a)) as [[]|]; simpl in Tr; congruence. }
    split; [split; reflexivity|]. intros st k r q B K A Eq. rewrite <- (Qeqb_comp d0 q Eq 0 0 (Qeq_refl 0)), Z. cbv zeta.
    rewrite (interferes_ok W0 st k B K w0 W0 unchanged (Some d0) r env _ _ s (describes_itself E W0) A Sm Fe (happening_changes_some _ _ _ _ _ _ Hp) If).
    pose proof (happens_ok W0 st k B K W0 unchanged (Some d0) r q env _ _ W1 (describes_itself E W0) A H1) as Q.
    destruct (symbolic_happening _ _ _ _ _ _ _ _ _ _); [exact Q|exact Q|]. destruct Q as [-> Q]. split; [symmetry; exact Eq|exact Q].
  - assert (Pd : 0 < d0).
    { destruct (Qlt_le_dec 0 d0) as [L|L]; [exact L|]. exfalso. assert (Ez : d0 == 0) by lra. apply Qeq_bool_iff in Ez. congruence. }
    destruct (interferes _ _ w0 _ _ _ _ _) eqn:If; [discriminate|].
    destruct (happening P w0 (Some d0) env (at_start a) (start_effect a)) as [w1|] eqn:Hp; [|discriminate].
    destruct (pass P w1 (Some d0) env (over_all a) (between events s (s + d0))) as [w2|] eqn:Pa; [|discriminate].
    destruct (interferes _ _ w2 _ _ _ _ _) eqn:If2; [discriminate|].
    destruct (happening P w2 (Some d0) env (And (over_all a) (at_end a)) (end_effect a)) as [w3|] eqn:Hp2; [|discriminate].
    injection H as <- <-. rewrite between_slice in Pa by lra. rewrite at_time_slice.
    destruct (happening_agrees w0 W0 Sm (Some d0) env _ _ w1 F1 F2 Hp) as [W1 [H1 [S1 [A1 V1]]]].
    set (mid := slice events (up_to s) (before (s + d0))) in *. set (last := slice events (before (s + d0)) (up_to (s + d0))) in *.
    assert (Im : forall v, In v mid -> In v events) by (intros v; apply slice_in).
    assert (Il : forall v, In v last -> In v events) by (intros v; apply slice_in).
    assert (Fa : formula_free X (And (over_all a) (at_end a)) = true) by (cbn [formula_free]; rewrite F3, F4; reflexivity).
    assert (W2e : w2 = elapse w1 mid).
    { clear - Pa. revert w1 Pa. induction mid as [|v vs IH]; intros w1 Pa; cbn [pass] in Pa; [injection Pa as <-; reflexivity|].
      destruct (truth P w1 (Some d0) env (over_all a)) as [[]|]; try discriminate. apply IH, Pa. }
    pose proof (elapse_all mid Im w1 W1 W1 unchanged S1 (describes_itself E W1)) as [S2 [_ [K2 [A2 V2]]]]. rewrite <- W2e in S2.
    destruct (happening_agrees w2 (elapse W1 mid) S2 (Some d0) env _ _ w3 Fa F5 Hp2) as [W3 [H3 [S3 [A3 V3]]]].
    pose proof (elapse_all last Il w3 W3 W3 unchanged S3 (describes_itself E W3)) as [S4 [_ [K4 [A4 V4]]]].
    exists (elapse W3 last), (Some d0). split; [exact S4|].
    split. { apply (statics_trans _ W1); [exact (happening_statics E N _ _ _ _ _ _ C1 H1)|]. apply (statics_trans _ (elapse W1 mid)); [exact K2|].
      apply (statics_trans _ W3); [exact (happening_statics E N _ _ _ _ _ _ C2 H3)|exact K4]. }
    split; [intros y Ay; rewrite A4, A3, A2, A1 by exact Ay; reflexivity|].
    split; [intros y Ay; rewrite V4, V3, V2, V1 by exact Ay; reflexivity|].
    split; [exact Ls|]. split; [exact (happening_holds E _ _ _ _ _ _ H1)|]. split; [split; reflexivity|].
    intros st k r q B K A Eq. rewrite <- (Qeqb_comp d0 q Eq 0 0 (Qeq_refl 0)), Z.
    rewrite (interferes_ok W0 st k B K w0 W0 unchanged (Some d0) r env _ _ s (describes_itself E W0) A Sm F2 (happening_changes_some _ _ _ _ _ _ Hp) If).
    pose proof (happens_ok W0 st k B K W0 unchanged (Some d0) r q env _ _ W1 (describes_itself E W0) A H1) as Q.
    destruct (symbolic_happening E T N k unchanged r q env (at_start a) (start_effect a)) as [| |sy1 t1]; [exact Q|exact Q|].
    destruct Q as [_ D1].
    destruct (pass_ok W0 st k B K mid Im w1 W1 sy1 (Some d0) r env (over_all a) w2 D1 A S1 F3 Pa) as [_ Sp]. rewrite Sp.
    pose proof (elapse_all mid Im w1 W1 W0 sy1 S1 D1) as [_ [D2 _]].
    pose proof (interferes_ok W0 st k B K w2 (elapse W1 mid) _ (Some d0) r env _ _ (s + d0) D2 A S2 F5 (happening_changes_some _ _ _ _ _ _ Hp2) If2) as I2.
    fold last in I2. rewrite I2.
    pose proof (happens_ok W0 st k B K (elapse W1 mid) _ (Some d0) r q env _ _ W3 D2 A H3) as Q.
    destruct (symbolic_happening E T N k (fold_left put_sets mid sy1) r q env (And (over_all a) (at_end a)) (end_effect a)) as [| |sy3 t3];
      [exact Q|exact Q|].
    destruct Q as [-> D3]. split; [symmetry; exact Eq|]. apply (elapse_all last Il w3 W3 W0 sy3 S3 D3).
Qed.
Lemma up_to_comp : forall t u, t == u -> up_to t = up_to u.
Proof. intros t u H. unfold Timeline.up_to. f_equal. apply filter_ext. intro v. apply Qleb_comp; [reflexivity|exact H]. Qed.
Lemma passage_comp : forall s d q, d == q -> passage_of s d = passage_of s q.
Proof. intros s d q H. unfold passage_of. assert (S : s + d == s + q) by (rewrite H; reflexivity).
rewrite (before_comp _ _ S), (up_to_comp _ _ S). reflexivity. Qed.

Lemma action_step : forall w W now s i a env s0 w' d, nth_error (actions P) i = Some a ->
  timed_step P events true w now s0 a env = Some (w', d) -> Related w W (up_to now) now s -> 0 <= now ->
  exists W' s', Related w' W' (up_to (s0 + d)) (s0 + d) s' /\ holds_in W' (waited X) = false /\ 0 <= s0 + d /\
    leads s s' (measure E N W' - measure E N W + per_time P * d).
Proof.
  intros w W now s i a env s0 w' d Ni H Re Zn. unfold timed_step in H.
  destruct (less s0 now || _) eqn:Ok; [discriminate|]. apply orb_false_iff in Ok. destruct Ok as [Ls Ar].
  apply less_false in Ls. apply negb_false_iff in Ar. apply andb_true_iff in Ar. destruct Ar as [Ar1 Ar2].
  cbv zeta in H. change (inner (elapse w (after_until events now s0)) s0 a env = Some (w', d)) in H.
  rewrite after_until_slice in H by exact Ls.
  assert (Mono : (up_to now <= up_to s0)%nat).
  { unfold Timeline.up_to. generalize events as l. induction l as [|v l IH]; [reflexivity|]. cbn [filter].
    destruct (Qle_bool (time v) now) eqn:A, (Qle_bool (time v) s0) eqn:B; cbn [length]; try lia. exfalso.
    apply Qle_bool_iff in A. apply le_false in B. lra. }
  destruct (waits (up_to s0 - up_to now) w W (up_to now) now s0 s Re) as [W0 [st [Re0 Le0]]].
  { pose proof (up_to_length s0). lia. } { exact Ls. }
  { intros v Ev. pose proof (nth_up_to now _ v Ev) as U. rewrite Nat.ltb_irrefl in U. apply le_false in U. lra. }
  { intros j v Lj Ev. apply Qle_bool_iff. rewrite (nth_up_to s0 j v Ev). apply Nat.ltb_lt. lia. }
  replace (up_to now + (up_to s0 - up_to now))%nat with (up_to s0) in Re0 by lia.
  set (w0 := elapse w (slice events (up_to now) (up_to s0))) in *.
  destruct Re0 as [B0 Sm Ph [c [V R]]]. pose proof (related_rel W0 st B0) as Rl.
  destruct all_parts as [_ [_ [_ [_ [_ [_ [_ [_ [_ [_ [_ [_ [_ Ac]]]]]]]]]]]]]. specialize (Ac _ _ Ni). unfold timed_action_ok in Ac.
  rewrite !andb_true_iff in Ac. destruct Ac as [[Fr Ch] Ac]. rewrite forallb_forall in Ac.
  destruct (inner_runs w0 W0 s0 a env w' d H Sm Fr Ch) as [W3 [dd [S3 [K3 [A3 [V3 [Zd [Tr [Du Run]]]]]]]]].
  assert (Ie : In env (instances E (fun env => static_false E N env (at_start a)) (parameters a) [])).
  { apply (instances_ok E _ env (parameters a) [] env); [reflexivity| |apply Nat.eqb_eq, Ar1|exact Ar2].
    intros e more Ee. destruct (static_false E N e (at_start a)) eqn:Sf; [|reflexivity]. exfalso. rewrite Ee in Tr.
    refine (static_false_ok E N W0 dd e more (at_start a) _ Sf Tr). exact (r_fact _ _ _ _ _ Rl). }
  specialize (Ac _ Ie). unfold timed_instance_ok in Ac.
  assert (Fx : exists r q, fixed_duration P events N X a env = Some (Some (r, q)) /\ agrees W0 dd r /\ d == q).
  { unfold fixed_duration in *. unfold action_free in Fr. rewrite !andb_true_iff in Fr. destruct Fr as [_ Fd].
    destruct (duration a) as [x|] eqn:Dx.
    2: { destruct Du as [-> ->]. exists Undefined, 0. split; [reflexivity|]. split; reflexivity. }
    destruct Du as [Ev ->]. rewrite <- (eval_agrees w0 W0 Sm None env x Fd) in Ev.
    pose proof (symbolic_expression_ok E N W0 (static_value E T N W0 st Rl) W0 unchanged None Undefined
      (describes_itself E W0) eq_refl env x) as Sx. rewrite Ev in Sx.
    destruct (symbolic_expression E N unchanged Undefined env x) as [| |[[|t l] q]];
      [discriminate Sx|discriminate Ac| |discriminate Ac].
    specialize (Sx d eq_refl). rewrite ev_empty in Sx. exists (Is (constant q)), q. split; [reflexivity|]. split; [|exact Sx].
    intros y Y. injection Y as <-. rewrite ev_constant. exact Sx. }
  destruct Fx as [r [q [Fx [Ag Dq]]]]. rewrite Fx in Ac.
  assert (Zq : 0 <= q) by lra. assert (Nq : less q 0 = false) by (apply less_false; exact Zq). rewrite Nq in Ac. cbn [orb] in Ac.
  apply andb_true_iff in Ac. destruct Ac as [Gq Ac]. pose proof (grid_ok _ Gq) as Gd. rewrite forallb_forall in Ac.
  assert (Zs : 0 <= s0) by lra. specialize (Ac (passage_of s0 q) (in_passages s0 q Zq)). rewrite (feasible_passage s0 q Zs) in Ac.
  cbn [negb orb] in Ac.
  refine (tree_cases E T N _ goal_case task_ok faithful_part W0 st Rl W0 (derived_nothing W0) _ _ _ _ _ _ Ac).
  2: { unfold start_knowledge. pose proof (conjuncts_ok E T N W0 st Rl W0 unchanged dd r (describes_itself E W0) Ag env (at_start a) Tr) as [Kl Kb].
    change (passage_of s0 q) with (before s0, up_to s0, before (s0 + q), up_to (s0 + q)). cbv beta iota.
    apply (knows_invariants E T N W0 st Rl). split; cbn [literals bounds].
    - intros x b J. destruct J as [J|J]; [|exact (Kl _ _ J)]. injection J as <- <-. rewrite Ph by apply up_to_length. apply Nat.eqb_refl.
    - intros sg f J. apply in_app_or in J. destruct J as [J|J]; [|exact (Kb _ _ J)]. apply in_map_iff in J. destruct J as [u [Eu J]].
      injection Eu as <- <-. change (before s0, up_to s0, before (s0 + q), up_to (s0 + q)) with (passage_of s0 q) in J.
      pose proof (represents_limit c s0 (fst u) R (upper_gridded _ _ _ Gd J)) as [L1 L2].
      apply (upper_within s0 q u) in J. unfold within in J.
      assert (Ee : ev W0 ([(clock X, -1 # 1)], fst u) == fst u - c).
      { rewrite ev_cons, ev_empty. cbn [fst snd]. rewrite V. cbn [default]. ring. }
      destruct (snd u); [apply L2 in J|apply L1 in J]; rewrite Ee; lra. }
  intros k o K L. unfold timed_leaf in L. specialize (Run st k r q B0 K Ag Dq). rewrite (passage_comp s0 d q Dq) in Run.
  destruct (symbolic_timed_step P events T N X k a env (passage_of s0 q) r q) as [| |sy t]; [destruct Run|discriminate|].
  destruct Run as [Td D3]. 
  change (passage_of s0 q) with (before s0, up_to s0, before (s0 + q), up_to (s0 + q)) in L. cbv beta iota in L.
  change (before s0, up_to s0, before (s0 + q), up_to (s0 + q)) with (passage_of s0 q) in L.
  set (marks := [(phase (up_to (s0 + q)), true); (phase (up_to s0), false); (waited X, false)]) in *.
  assert (M : forall x b, In (x, b) marks -> added (fst x) = true).
  { intros x b [I|[I|[I|[]]]]; injection I as <- <-; auto using added_phase, added_waited. }
  destruct (closing W0 W3 st k sy t marks _ q o B0 K D3 K3 M L) as [g [s2 [B2 [Co Le]]]].
  assert (Sq : s0 + d == s0 + q) by (rewrite Dq; reflexivity).
  exists (mark marks (ev W0 g) W3), s2. split; [|split; [|split]].
  - rewrite (up_to_comp _ _ Sq). split; [exact B2|apply mark_same; assumption| |].
    + intros j Lj. cbn [mark holds_in marks assoc].
      pose proof (up_to_length s0) as L1. pose proof (up_to_length (s0 + q)) as L2.
      rewrite !phase_eq, waited_eq by assumption.
      destruct (Nat.eqb j (up_to (s0 + q))) eqn:E1; [apply Nat.eqb_eq in E1; rewrite E1; symmetry; apply Nat.eqb_refl|].
      rewrite Nat.eqb_sym in E1. rewrite E1. destruct (Nat.eqb j (up_to s0)) eqn:E2; [reflexivity|].
      rewrite A3 by apply added_phase. rewrite Ph by exact Lj. rewrite Nat.eqb_sym. exact E2.
    + exists (ev W0 g). split; [cbn [mark value_in]; rewrite atom_eqb_refl; reflexivity|].
      apply (clock_represents W0 g (lower events (passage_of s0 q) q) d q s0 c V R); auto.
      intros l I. apply (lower_within s0 q l Zs I).
  - cbn [mark holds_in marks assoc]. rewrite atom_eqb_refl.
    pose proof (up_to_length s0) as L1. pose proof (up_to_length (s0 + q)) as L2.
    destruct (atom_eqb (waited X) (phase (up_to (s0 + q)))) eqn:E1; [apply atom_eqb_eq in E1; pose proof (waited_eq _ L2) as Y; rewrite <- E1, atom_eqb_refl in Y; discriminate|].
    destruct (atom_eqb (waited X) (phase (up_to s0))); reflexivity.
  - lra.
  - intros ps n Pl. destruct (leads_trans _ _ _ _ _ Le0 Le ps n Pl) as [ps' [n' [P1 P2]]]. exists ps', n'. split; [exact P1|].
    rewrite Td in P2.
    setoid_replace (measure E N (mark marks (ev W0 g) W3) - measure E N W + per_time P * d) with
      (measure E N W0 - measure E N W + (measure E N (mark marks (ev W0 g) W3) - measure E N W0 + per_time P * d)) by ring. exact P2.
Qed.

Lemma ground_objects : forall l, ground [] (map Object l) = Some l.
Proof. induction l as [|o l IH]; [reflexivity|]. cbn [map ground object_of]. rewrite IH. reflexivity. Qed.
Lemma execution : forall plan w W now spent s w' spent', timed_execute P events true w now spent plan = Some (w', spent') ->
  Related w W (up_to now) now s -> holds_in W (waited X) = false -> 0 <= now ->
  exists ps c W', Task.plan T s ps c /\
    inject_Z c <= (measure E N W' + spent' - measure E N W - spent) * (Zpos (cost_scale N) # 1) /\
    same w' W' /\ exists s', Base E T N W' s'.
Proof.
  induction plan as [|[s0 [i env]] plan IH]; intros w W now spent s w' spent' H Re Wt Zn; cbn [timed_execute] in H.
  - destruct (truth P w None [] (goal_formula P)) as [[]|] eqn:G; try discriminate. injection H as <- <-.
    destruct Re as [B Sm Ph Cl]. pose proof (related_rel W s B) as R. exists [], 0%Z, W.
    split; [|split; [change (inject_Z 0) with 0; setoid_replace (measure E N W + spent - measure E N W - spent) with 0 by ring; lra|
      split; [exact Sm|exists s; exact B]]].
    constructor. destruct (parts E T N _ goal_case faithful_part) as [_ [_ [_ [_ [Bg _]]]]].
    assert (Gt : truth E W None [] (goal_formula E) = Some true).
    { cbn [extended goal_formula truth]. rewrite ground_objects. destruct (waited X) as [pw lw] eqn:Ew. cbn [fst snd]. rewrite Wt.
      change (truth E) with (truth P). rewrite (truth_agrees w W Sm None (goal_formula P) []); [rewrite G; reflexivity|]. apply all_parts. }
    refine (tree_cases E T N _ goal_case task_ok faithful_part W s R W (derived_nothing W) _ _ _ _ _ _ Bg).
    2: { apply (knows_invariants E T N W s R), (conjuncts_ok E T N W s R W unchanged None Undefined);
      [apply describes_itself|exact eq_refl|exact Gt]. }
    intros k o K L. unfold goal_leaf in L.
    destruct (symbolic_truth E T N k unchanged Undefined [] (goal_formula E)) as [[]|] eqn:Eg.
    2: { exfalso. apply (symbolic_truth_ok E T N W k (knows_base W s k B K) (knows_values W s B) K W
           unchanged None Undefined (describes_itself E W) eq_refl) in Eg. apply Eg. exact Gt. }
    all: exact (known_condition_ok E T N _ goal_case task_ok faithful_part W s R k K _
      (lower_holds E T N _ goal_case task_ok faithful_part W s R W (derived_nothing W)) _ _ _ L).
  - destruct (nth_error (actions P) i) as [a|] eqn:Ni; [|discriminate].
    destruct (timed_step P events true w now s0 a env) as [[w1 d]|] eqn:St; [|discriminate].
    destruct (action_step w W now s i a env s0 w1 d Ni St Re Zn) as [W1 [s1 [Re1 [Wt1 [Zs Le]]]]].
    destruct (IH _ _ _ _ _ _ _ H Re1 Wt1 Zs) as [ps [c [W' [Pl [Lc [Sm Bs]]]]]].
    destruct (Le ps c Pl) as [ps' [c' [P1 P2]]]. exists ps', c', W'. split; [exact P1|]. split; [|split; assumption].
    rewrite Qred_correct in Lc. assert (Ps : per_step P == 0) by apply all_parts. rewrite Ps in Lc.
    set (kk := Zpos (cost_scale N) # 1) in *.
    setoid_replace ((measure E N W' + spent' - measure E N W - spent) * kk) with
      ((measure E N W1 - measure E N W + per_time P * d) * kk + (measure E N W' + spent' - measure E N W1 - (spent + per_time P * d + 0)) * kk) by ring.
    lra.
Qed.
Lemma begins : Related (initial P) (initial E) (up_to 0) 0 (init T) /\ holds_in (initial E) (waited X) = false.
Proof.
  assert (Hi : forall a, holds_in (initial E) a = atom_eqb a (phase (up_to 0)) || holds_in (initial P) a).
  { intro a. cbn [initial holds_in extended initial_atoms]. rewrite find_add. destruct (atom_eqb a (phase (up_to 0))); reflexivity. }
  assert (Vi : forall f, value_in (initial E) f = if atom_eqb f (clock X) then Some 0 else value_in (initial P) f).
  { intro f. cbn [initial value_in extended initial_values]. apply find_add. }
  destruct all_parts as [_ [_ [_ [_ [_ [_ [_ [_ [Len [Ini _]]]]]]]]]]. split.
  - split.
    + exact (initially E T N _ goal_case task_ok faithful_part).
    + split; [intros a A; rewrite Hi|intros f A; rewrite Vi].
      * destruct (atom_eqb a (phase (up_to 0))) eqn:Eq; [|reflexivity]. apply atom_eqb_eq in Eq. subst a. rewrite added_phase in A. discriminate.
      * destruct (atom_eqb f (clock X)) eqn:Eq; [|reflexivity]. apply atom_eqb_eq in Eq. subst f. rewrite added_clock in A. discriminate.
    + intros j Lj. rewrite Hi. rewrite (Ini (phase j)).
      * rewrite phase_eq by (exact Lj || apply up_to_length). rewrite orb_false_r. apply Nat.eqb_sym.
      * right. unfold Timeline.phase. apply nth_In. rewrite Len. lia.
    + exists 0. split; [rewrite Vi, atom_eqb_refl; reflexivity|]. apply represents_earlier. lra.
  - rewrite Hi, (Ini (waited X)) by (left; reflexivity). rewrite orb_false_r.
    destruct (atom_eqb (waited X) (phase (up_to 0))) eqn:Eq; [|reflexivity]. apply atom_eqb_eq in Eq.
    pose proof (waited_eq _ (up_to_length 0)) as Y. rewrite <- Eq, atom_eqb_refl in Y. discriminate.
Qed.
Lemma measured : forall w W s v, same w W -> Base E T N W s -> eval w None [] (metric P) = Some v -> is_linear E N = true ->
  measure E N W == v.
Proof.
  intros w W s v Sm B Ev Li. rewrite <- (eval_agrees w W Sm None []) in Ev by apply all_parts.
  pose proof (symbolic_expression_ok E N W (knows_values W s B) W unchanged None Undefined (describes_itself E W) eq_refl [] (metric E)) as L.
  unfold measure. unfold is_linear in Li. destruct (symbolic_expression E N unchanged Undefined [] (metric E)) as [| |f]; try discriminate.
  symmetry. apply L. exact Ev.
Qed.
End Proof.

(* What the checker accepts is true. Nothing is assumed of the ground task [T], the names [N], the
   timeline [X], the case trees, the argument [A] and the oracle. *)
Theorem timed_optimal : forall P events T N X case wait_case goal_case A oracle plan claim,
  check_timed P events T N X case wait_case goal_case A oracle plan claim = true -> is_timed_optimal P events plan claim.
Proof.
  intros P events T N X case wait_case goal_case A oracle plan claim H. unfold check_timed in H.
  rewrite !andb_true_iff in H. destruct H as [[C F] H].
  destruct (begins P events T N X case wait_case goal_case C F) as [R0 W0].
  destruct claim as [m|].
  - destruct (eval (initial P) None [] (metric P)) as [first|] eqn:E0; [|discriminate].
    rewrite !andb_true_iff in H. destruct H as [[H0 H1] [H2 H3]].
    destruct (timed_execute P events false (initial P) 0 0 plan) as [[w spent]|] eqn:Ex; [|discriminate].
    destruct (final_metric P w spent) as [m'|] eqn:Fm; [|discriminate]. apply Qeq_bool_iff in H1.
    apply Pos.eqb_eq in H2. split.
    + exists w, spent, m'. auto.
    + intros other w2 spent2 m2 X2 F2.
      destruct (execution P events T N X case wait_case goal_case C F other _ _ _ _ _ _ _ X2 R0 W0 (Qle_refl 0)) as [ps [c [W2 [Pl [Le [Sm [s2 B2]]]]]]].
      pose proof (sound T A _ oracle H3 ps c Pl) as B. cbn beta iota in B. rewrite Zle_Qle in B.
      set (q := Qred ((m - first) * (Zpos (cost_scale N) # 1))) in *.
      assert (Iq : inject_Z (Qnum q) == q) by (unfold inject_Z; destruct q as [n d]; simpl in *; subst d; reflexivity).
      rewrite Iq in B. unfold q in B. rewrite Qred_correct in B.
      unfold final_metric in F2. destruct (eval w2 None [] (metric P)) as [x|] eqn:E2; [|discriminate]. injection F2 as <-.
      rewrite (measured P events T N X case wait_case goal_case C F _ _ _ _ (g_same _ _ _ _ _ _ _ _ _ _ R0) (g_base _ _ _ _ _ _ _ _ _ _ R0) E0 H0) in Le.
      rewrite (measured P events T N X case wait_case goal_case C F _ _ _ _ Sm B2 E2 H0) in Le.
      assert (Kp : 0 < (Zpos (cost_scale N) # 1)) by reflexivity.
      assert (Y : (m - first) * (Zpos (cost_scale N) # 1) <= (x + spent2 - first - 0) * (Zpos (cost_scale N) # 1)) by lra.
      apply Qmult_lt_0_le_reg_r in Y; [lra|exact Kp].
  - intro other. destruct (timed_execute P events true (initial P) 0 0 other) as [[w spent]|] eqn:Ex; [|reflexivity]. exfalso.
    destruct (execution P events T N X case wait_case goal_case C F other _ _ _ _ _ _ _ Ex R0 W0 (Qle_refl 0)) as [ps [c [W2 [Pl _]]]].
    assert (H' : check T A None oracle = true) by (destruct (eval (initial P) None [] (metric P)); exact H).
    exact (sound T A None oracle H' ps c Pl).
Qed.
