(* Lemmas for theorem [sound]: potentials and needs are admissible, and a state that is no worse has
   successors that are no worse. *)
From Coq Require Import ZArith List Bool FMapPositive Lia.
From Proved Require Import Task Check.
Import ListNotations.
Open Scope Z_scope.

(* Maps and lists *)
Lemma get_add : forall m k x j, get (M.add k x m) j = if Pos.eqb k j then x else get m j.
Proof.
  intros. unfold get. destruct (Pos.eqb_spec k j).
  - subst. rewrite M.gss. reflexivity.
  - rewrite M.gso by congruence. reflexivity.
Qed.
Lemma get_puts : forall fs m v, get (put_all fs m) v = last_put fs v (get m v).
Proof.
  induction fs as [|f fs IH]; intros; simpl; [reflexivity|].
  unfold put_all in *. simpl. rewrite IH, get_add. reflexivity.
Qed.
Lemma last_put_app : forall a b v x, last_put (a ++ b) v x = last_put b v (last_put a v x).
Proof. induction a; intros; simpl; auto. Qed.
Lemma last_put_none : forall fs v x, (forall f, In f fs -> fst f <> v) -> last_put fs v x = x.
Proof.
  induction fs as [|f fs IH]; intros v x H; simpl; [reflexivity|].
  destruct (Pos.eqb_spec (fst f) v) as [e|e].
  - exfalso. apply (H f); [left; reflexivity|exact e].
  - apply IH. intros g G. apply H. right. exact G.
Qed.
Lemma last_put_in : forall fs v x, last_put fs v x = x \/ In (v, last_put fs v x) fs.
Proof.
  induction fs as [|[w y] fs IH]; intros v x; simpl; [left; reflexivity|].
  destruct (Pos.eqb_spec w v) as [e|e].
  - subst. destruct (IH v y) as [H|H]; [right; left; congruence|right; right; exact H].
  - destruct (IH v x) as [H|H]; [left; exact H|right; right; exact H].
Qed.
Lemma last_put_copy : forall (g : key -> Z) ks v x,
  last_put (map (fun k => (k, g k)) ks) v x = if mem_key v ks then g v else x.
Proof.
  intros g. induction ks as [|k ks IH]; intros v x; simpl; [reflexivity|].
  rewrite IH. unfold mem_key. simpl. rewrite (Pos.eqb_sym v k).
  destruct (Pos.eqb_spec k v); simpl; [subst; destruct (existsb _ _); reflexivity|reflexivity].
Qed.
Lemma memb_In : forall v ks, mem_key v ks = true <-> In v ks.
Proof.
  intros. unfold mem_key. rewrite existsb_exists. split.
  - intros [x [H e]]. apply Pos.eqb_eq in e. subst. exact H.
  - intros H. exists v. split; [exact H|apply Pos.eqb_refl].
Qed.
Lemma upto_In : forall k a x, a <= x < a + Z.of_nat k -> In x (count_up k a).
Proof.
  induction k; intros a x H; [lia|]. simpl. destruct (Z.eq_dec a x); [left; assumption|right; apply IHk; lia].
Qed.
Lemma range_In : forall x n, 0 <= x < n -> In x (range n).
Proof. intros. unfold range. apply upto_In. lia. Qed.
Lemma combos_In : forall ns ch, Forall2 (fun x n => 0 <= x < n) ch ns -> In ch (combinations ns).
Proof.
  intros ns ch H. induction H; simpl; [left; reflexivity|].
  apply in_flat_map. exists x. split; [apply range_In; assumption|apply in_map; assumption].
Qed.
Lemma choices_In : forall o ch, admitted o ch -> In ch (choices o).
Proof.
  intros o ch [H1 H2]. unfold choices. apply filter_In. split; [apply combos_In; assumption|].
  unfold admits. apply forallb_forall. intros [slots bad] H. simpl.
  apply negb_true_iff. destruct (existsb _ bad) eqn:E; [|reflexivity].
  exfalso. apply existsb_exists in E. destruct E as [b [B e]].
  unfold equal_lists in e. destruct (list_eq_dec _ _ _); [|discriminate].
  apply (H2 slots bad H). subst. exact B.
Qed.
Lemma minimum_le : forall xs x, In x xs -> exists m, minimum xs = Some m /\ m <= x.
Proof.
  induction xs as [|y xs IH]; intros x H; [destruct H|]. simpl.
  destruct H as [H|H].
  - subst. destruct (minimum xs) as [m|]; [exists (Z.min x m)|exists x]; split; auto; lia.
  - destruct (IH x H) as [m [E L]]. unfold minimum in *. rewrite E.
    exists (Z.min y m). split; [reflexivity|lia].
Qed.

Section Soundness.
Variable T : task.
Notation bas v := (is_basic T v = true).

(* Derived variables *)
Hypothesis heads_derived :
  forallb (forallb (fun r : fact * condition => negb (is_basic T (fst (fst r))))) (layers T) = true.
Hypothesis derived_derived : forallb (fun d : key * Z => negb (is_basic T (fst d))) (derived T) = true.

Lemma basics_In : forall v, bas v -> In v (basics T).
Proof.
  intros v H. unfold is_basic in H. apply Z.leb_le in H.
  unfold basics. apply in_map_iff. exists (Pos.to_nat v). split; [apply Pos2Nat.id|].
  apply in_seq. lia.
Qed.
Lemma reset_val : forall s v, bas v -> var_value (reset_derived T s) v = var_value s v.
Proof.
  intros s v H. unfold reset_derived, var_value at 1. simpl. rewrite get_puts.
  rewrite last_put_none.
  - rewrite get_puts, (last_put_copy (var_value s)).
    assert (I : mem_key v (basics T) = true) by (apply memb_In, basics_In, H).
    rewrite I. reflexivity.
  - intros f F e. rewrite forallb_forall in derived_derived. apply derived_derived in F.
    rewrite e, H in F. discriminate.
Qed.
Lemma reset_num : forall s n, num_value (reset_derived T s) n = if mem_key n (numbers T)
  then num_value s n else 0.
Proof.
  intros. unfold reset_derived, num_value at 1. simpl. rewrite get_puts, (last_put_copy (num_value s)).
  unfold get.
  rewrite M.gempty. reflexivity.
Qed.
Lemma layer_num : forall fuel rules s n, num_value (evaluate_layer fuel rules s) n = num_value s n.
Proof.
  induction fuel; intros; simpl; [reflexivity|]. destruct (new_facts rules s); [reflexivity|].
  rewrite IHfuel. reflexivity.
Qed.
Lemma layer_val : forall rules, forallb (fun r : fact * condition =>
  negb (is_basic T (fst (fst r)))) rules = true ->
  forall fuel s v, bas v -> var_value (evaluate_layer fuel rules s) v = var_value s v.
Proof.
  intros rules R. induction fuel; intros s v B; cbn [evaluate_layer]; [reflexivity|].
  destruct (new_facts rules s) as [|f fs] eqn:N; [reflexivity|]. rewrite IHfuel by exact B.
  unfold var_value. cbn [var_values]. rewrite get_puts. apply last_put_none.
  intros g G e. rewrite <- N in G. unfold new_facts in G. apply in_map_iff in G.
  destruct G as [r [E G]]. apply filter_In in G. destruct G as [G _].
  rewrite forallb_forall in R. apply R in G. rewrite E, e, B in G. discriminate.
Qed.
Lemma derive_val : forall s v, bas v -> var_value (derive T s) v = var_value s v.
Proof.
  intros s v B. unfold derive. rewrite <- (reset_val s v B). generalize (reset_derived T s) as t.
  revert heads_derived. generalize (layers T) as ls.
  induction ls as [|l ls IH]; intros H t; cbn [fold_left]; [reflexivity|].
  simpl in H. apply andb_true_iff in H. destruct H as [H1 H2].
  rewrite IH by exact H2. apply layer_val; assumption.
Qed.
Lemma derive_num : forall s n, num_value (derive T s) n = if mem_key n (numbers T) then num_value s n else 0.
Proof.
  intros s n. unfold derive. rewrite <- reset_num. generalize (reset_derived T s) as t.
  generalize (layers T) as ls.
  induction ls as [|l ls IH]; intros t; cbn [fold_left]; [reflexivity|]. rewrite IH. apply layer_num.
Qed.

(* Dominance: a state that is no worse than another *)
Definition rel (mono : bool) (a b : Z) : Prop := if mono then b <= a else a = b.
Definition same (mono : bool) (s t : state) : Prop :=
  (forall v, var_value s v = var_value t v) /\ forall n, rel mono (num_value s n) (num_value t n).
Definition no_worse (mono : bool) (s t : state) : Prop :=
  (forall v, bas v -> var_value s v = var_value t v) /\ forall n, In n (numbers T) ->
    rel mono (num_value s n) (num_value t n).

Lemma rel_refl : forall m a, rel m a a.
Proof. intros [] a; simpl; lia. Qed.
Lemma value_rel2 : forall m l s t sz ch ch', (m = true -> nonneg l = true) -> same m s t ->
  rel m (amount (offset l) sz ch) (amount (offset l) sz ch') -> rel m (value l s sz ch) (value l t sz ch').
Proof.
  intros m [fs r] s t sz ch ch' P [_ H]. unfold value. simpl.
  assert (P' : m = true -> forallb (fun f : key * Z => 0 <=? snd f) fs = true) by (intro e; apply (P e)).
  clear P. revert P'. generalize (amount r sz ch) as a. generalize (amount r sz ch') as b.
  induction fs as [|f fs IH]; intros b a P G; simpl; [exact G|].
  apply IH.
  - intro e. specialize (P e). simpl in P. apply andb_true_iff in P. apply P.
  - specialize (H (fst f)). destruct m; simpl in *.
    + specialize (P eq_refl). apply andb_true_iff in P. destruct P as [P _]. apply Z.leb_le in P. nia.
    + rewrite H. lia.
Qed.
Lemma value_rel : forall m l s t sz ch, (m = true -> nonneg l = true) -> same m s t ->
  rel m (value l s sz ch) (value l t sz ch).
Proof. intros. apply value_rel2; auto. apply rel_refl. Qed.
Lemma is_fact_same : forall m s t f, same m s t -> is_fact s f = is_fact t f.
Proof. intros m s t f [H _]. unfold is_fact. rewrite H. reflexivity. Qed.
Lemma is_literal_same : forall m s t l, same m s t -> is_literal s l = is_literal t l.
Proof. intros. unfold is_literal. erewrite is_fact_same by eassumption. reflexivity. Qed.
Lemma forallb_ext : forall X (f g : X -> bool) xs, (forall x, f x = g x) -> forallb f xs = forallb g xs.
Proof. intros X f g xs H. induction xs; simpl; congruence. Qed.
Lemma existsb_ext : forall X (f g : X -> bool) xs, (forall x, f x = g x) -> existsb f xs = existsb g xs.
Proof. intros X f g xs H. induction xs; simpl; congruence. Qed.
Lemma holds_facts_same : forall m c s t, same m s t -> holds_facts c s = holds_facts c t.
Proof.
  intros m c s t H. unfold holds_facts. f_equal.
  - apply forallb_ext. intro. eapply is_fact_same, H.
  - apply forallb_ext. intro. apply existsb_ext. intro. eapply is_literal_same, H.
Qed.
Definition no_dearer (m : bool) (o : operator) (ch ch' : choice) : Prop :=
  amount (cost o) (slot_sizes o) ch <= amount (cost o) (slot_sizes o) ch' /\
  forall l, In l (comparisons (precondition o) ++ map snd (number_effects o)) ->
    rel m (amount (offset l) (slot_sizes o) ch) (amount (offset l) (slot_sizes o) ch').
Lemma holds_mono2 : forall m c s t sz ch ch', (m = true -> forallb nonneg (comparisons c) = true) ->
  same m s t ->
  (forall l, In l (comparisons c) -> rel m (amount (offset l) sz ch) (amount (offset l) sz ch')) ->
  holds c t sz ch' = true -> holds c s sz ch = true.
Proof.
  intros m c s t sz ch ch' P H D. unfold holds. rewrite (holds_facts_same _ c _ _ H).
  rewrite !andb_true_iff. intros [F C]. split; [exact F|].
  rewrite forallb_forall in C |- *. intros l L. specialize (C l L). apply Z.leb_le in C. apply Z.leb_le.
  assert (Q : rel m (value l s sz ch) (value l t sz ch')).
  { apply value_rel2; [|exact H|apply D, L]. intro e. specialize (P e). rewrite forallb_forall in P.
    apply P, L. }
  destruct m; simpl in Q; lia.
Qed.
Lemma holds_mono : forall m c s t sz ch, (m = true -> forallb nonneg (comparisons c) = true) -> same m s t ->
  holds c t sz ch = true -> holds c s sz ch = true.
Proof. intros. eapply holds_mono2; eauto. intros. apply rel_refl. Qed.
Lemma holds_same : forall m c s t sz ch, (m = true -> comparisons c = []) -> same m s t ->
  holds c s sz ch = holds c t sz ch.
Proof.
  intros m c s t sz ch P H. unfold holds. rewrite (holds_facts_same _ c _ _ H). f_equal.
  destruct m.
  - rewrite P by reflexivity. reflexivity.
  - apply forallb_ext. intro l. f_equal. apply (value_rel false); [discriminate|exact H].
Qed.
Lemma news_same : forall m rules s t,
  (m = true -> forall r, In r rules -> comparisons (snd r) = []) -> same m s t ->
    new_facts rules s = new_facts rules t.
Proof.
  intros m rules s t P H. unfold new_facts. f_equal.
  assert (Q : forall r, In r rules -> negb (is_fact s (fst r)) && holds (snd r) s [] []
                                  = negb (is_fact t (fst r)) && holds (snd r) t [] []).
  { intros r I. erewrite is_fact_same by eassumption. f_equal. eapply holds_same; [|exact H]. auto. }
  clear P. induction rules as [|r rules IH]; simpl; [reflexivity|].
  rewrite Q by (left; reflexivity). rewrite IH by (intros; apply Q; right; assumption). reflexivity.
Qed.
Lemma layer_same : forall m rules, (m = true -> forall r, In r rules -> comparisons (snd r) = []) ->
  forall fuel s t, same m s t -> same m (evaluate_layer fuel rules s) (evaluate_layer fuel rules t).
Proof.
  intros m rules P. induction fuel; intros s t H; cbn [evaluate_layer]; [exact H|].
  rewrite (news_same m rules s t P H). destruct (new_facts rules t) as [|f fs]; [exact H|].
  apply IHfuel. destruct H as [H1 H2]. split; [|exact H2].
  intro v. unfold var_value. cbn [var_values]. rewrite !get_puts. f_equal. apply H1.
Qed.
Lemma derive_same : forall m, (m = true -> forall ls, In ls (layers T) -> forall r, In r ls ->
  comparisons (snd r) = []) ->
  forall s t, no_worse m s t -> same m (derive T s) (derive T t).
Proof.
  intros m P s t [H1 H2]. unfold derive.
  assert (R : same m (reset_derived T s) (reset_derived T t)).
  { split.
    - intro v. unfold reset_derived, var_value at 1 3. cbn [var_values]. rewrite !get_puts. f_equal.
      rewrite (last_put_copy (var_value s)), (last_put_copy (var_value t)).
      destruct (mem_key v (basics T)) eqn:E; [|reflexivity].
      apply H1. apply memb_In in E. unfold basics in E. apply in_map_iff in E.
      destruct E as [i [E I]]. apply in_seq in I. unfold is_basic. apply Z.leb_le. subst v.
      rewrite <- (Nat2Pos.id i) in I by lia. lia.
    - intro n. rewrite !reset_num. destruct (mem_key n (numbers T)) eqn:E; [|apply rel_refl].
      apply H2. apply memb_In, E. }
  revert R. generalize (reset_derived T s) as a. generalize (reset_derived T t) as b. revert P.
  generalize (layers T) as ls.
  induction ls as [|l ls IH]; intros P b a R; cbn [fold_left]; [exact R|].
  apply IH; [intros e l' L; apply P; [exact e|right; exact L]|].
  apply layer_same; [|exact R]. intros e r. apply P; [exact e|left; reflexivity].
Qed.

Lemma makes_same : forall m o s t, same m s t -> made_facts o s = made_facts o t.
Proof.
  intros m o s t H. unfold made_facts. f_equal. f_equal.
  induction (conditional o) as [|c cs IH]; simpl; [reflexivity|].
  replace (fires s c) with (fires t c); [rewrite IH; reflexivity|].
  unfold fires. apply forallb_ext. intro. symmetry. eapply is_literal_same, H.
Qed.
Lemma puts_rel : forall m o s t ch ch', (m = true ->
  forallb (fun c => nonneg (snd c)) (number_effects o) = true) -> same m s t ->
  (forall l, In l (map snd (number_effects o)) ->
    rel m (amount (offset l) (slot_sizes o) ch) (amount (offset l) (slot_sizes o) ch')) ->
  forall n, rel m (num_value (apply o s ch) n) (num_value (apply o t ch') n).
Proof.
  intros m o s t ch ch' P H D n. unfold apply, num_value. cbn [num_values]. rewrite !get_puts.
  destruct H as [H1 H2]. assert (Q : rel m (get (num_values s) n) (get (num_values t) n)) by apply H2.
  assert (R : same m s t) by (split; assumption). clear H1 H2.
  revert P D Q. generalize (get (num_values s) n) as a. generalize (get (num_values t) n) as b.
  induction (number_effects o) as [|c cs IH]; intros b a P D Q; simpl; [exact Q|].
  apply IH.
  - intro e. specialize (P e). simpl in P. apply andb_true_iff in P. apply P.
  - intros l L. apply D. right. exact L.
  - destruct (Pos.eqb (fst c) n); [|exact Q]. apply value_rel2; [|exact R|apply D; left; reflexivity].
    intro e. specialize (P e). simpl in P. apply andb_true_iff in P. apply P.
Qed.
Lemma apply_no_worse : forall m o s t ch ch', (m = true ->
  forallb (fun c => nonneg (snd c)) (number_effects o) = true) ->
  same m s t -> no_dearer m o ch ch' -> no_worse m (apply o s ch) (apply o t ch').
Proof.
  intros m o s t ch ch' P H D. split.
  - intros v _. unfold apply, var_value. cbn [var_values]. rewrite !get_puts, (makes_same _ _ _ _ H).
    f_equal. apply H.
  - intros n _. apply puts_rel; [assumption|assumption|]. intros l L. apply D. apply in_or_app. right.
    exact L.
Qed.

(* Patterns and tables *)
Definition shape (s : state) (pat : list key) : list Z := map (var_value s) pat.
Lemma after_map : forall pat g fs, pattern_after pat (map g pat) fs = map (fun v => last_put fs v (g v)) pat.
Proof. induction pat; intros; simpl; [reflexivity|]. rewrite IHpat. reflexivity. Qed.
Lemma value_in_map : forall pat g v, pattern_value pat (map g pat) v = if mem_key v pat
  then Some (g v) else None.
Proof.
  induction pat as [|w pat IH]; intros g v; simpl; [reflexivity|].
  unfold mem_key. simpl. rewrite (Pos.eqb_sym v w).
  destruct (Pos.eqb_spec w v); simpl; [subst; reflexivity|apply IH].
Qed.
Lemma truth_ok : forall pat s l b, pattern_truth pat (shape s pat) l = Some b -> is_literal s l = b.
Proof.
  intros pat s l b. unfold pattern_truth, shape. rewrite value_in_map.
  destruct (mem_key _ pat); [|discriminate]. intro e. injection e as e. exact e.
Qed.
Lemma fired_false : forall pat s c,
  existsb (fun t => match t with Some false => true
    | _ => false end) (map (pattern_truth pat (shape s pat)) (fst c)) = true ->
  fires s c = false.
Proof.
  intros pat s c H. unfold fires. apply existsb_exists in H. destruct H as [t [I E]].
  apply in_map_iff in I. destruct I as [l [L I]]. destruct t as [[]|]; try discriminate.
  apply truth_ok in L. destruct (forallb (is_literal s) (fst c)) eqn:F; [|reflexivity].
  rewrite forallb_forall in F. rewrite (F l I) in L. discriminate.
Qed.
Lemma fired_true : forall pat s c,
  forallb (fun t => match t with Some true => true
    | _ => false end) (map (pattern_truth pat (shape s pat)) (fst c)) = true ->
  fires s c = true.
Proof.
  intros pat s c H. unfold fires. rewrite forallb_forall in H |- *. intros l I.
  specialize (H (pattern_truth pat (shape s pat) l) (in_map _ _ _ I)).
  destruct (pattern_truth pat (shape s pat) l) as [[]|] eqn:E; try discriminate. apply truth_ok in E. exact E.
Qed.
Lemma targets_ok : forall pat s cs ts g, In (map g pat) ts ->
  In (map (fun v => last_put (flat_map snd (filter (fires s) cs)) v (g v)) pat)
    (reached_patterns pat (shape s pat) cs ts).
Proof.
  intros pat s. induction cs as [|c cs IH]; intros ts g H; simpl; [exact H|].
  destruct (forallb (fun f => negb (mem_key (fst f) pat)) (snd c)) eqn:Other.
  { destruct (fires s c); simpl; [|apply IH, H].
    erewrite map_ext_in; [apply IH, H|]. intros v I. simpl. rewrite last_put_app. f_equal.
    apply last_put_none. intros f F e. rewrite forallb_forall in Other. specialize (Other f F).
    apply negb_true_iff in Other. assert (mem_key (fst f) pat = true); [|congruence].
    apply memb_In. rewrite e. exact I. }
  destruct (existsb _ _) eqn:E.
  { rewrite (fired_false _ _ _ E). apply IH, H. }
  assert (N : In (map (fun v => last_put (snd c) v (g v)) pat) (map (fun t =>
    pattern_after pat t (snd c)) ts)).
  { rewrite <- after_map. apply (in_map (fun t => pattern_after pat t (snd c))). exact H. }
  match goal with |- context [if forallb ?a ?b then _ else _] => destruct (forallb a b) eqn:F end.
  - rewrite (fired_true _ _ _ F). simpl.
    apply (IH _ _) in N. erewrite map_ext; [exact N|]. intro v. simpl. apply last_put_app.
  - destruct (fires s c); simpl.
    + assert (N' : In (map (fun v => last_put (snd c) v (g v)) pat) (ts ++ filter (fun t => negb (existsb (same_values t) ts)) (map (fun t =>
        pattern_after pat t (snd c)) ts))).
      { apply in_or_app. destruct (existsb (same_values (map (fun v => last_put (snd c) v (g v)) pat)) ts) eqn:D.
        - left. apply existsb_exists in D. destruct D as [t [I S]]. unfold same_values in S.
          destruct (list_eq_dec Z.eq_dec _ t) as [<-|]; [exact I|discriminate].
        - right. apply filter_In. split; [exact N|]. rewrite D. reflexivity. }
      apply (IH _ _) in N'. erewrite map_ext; [exact N'|]. intro v. simpl. apply last_put_app.
    + apply IH. apply in_or_app. left. exact H.
Qed.
Lemma all_targets_ok : forall pat o s ch, In (shape (apply o s ch) pat)
  (successor_patterns pat o (shape s pat)).
Proof.
  intros. unfold successor_patterns.
  pose proof (targets_ok pat s (conditional o) [pattern_after pat (shape s pat) (effects o)]
                (fun v => last_put (effects o) v (var_value s v))) as H.
  unfold shape in *. erewrite map_ext; [apply H; left; apply after_map|].
  intro v. unfold apply, var_value, made_facts. cbn [var_values]. rewrite get_puts, last_put_app. reflexivity.
Qed.
Lemma untouched : forall pat o s ch, mentions pat o = false -> shape (apply o s ch) pat = shape s pat.
Proof.
  intros pat o s ch H. unfold shape. apply map_ext_in. intros v I.
  unfold apply, var_value. cbn [var_values]. rewrite get_puts. apply last_put_none.
  intros f F e. assert (Q : mentions pat o = true); [|congruence].
  unfold mentions. apply existsb_exists. exists f. split.
  - unfold made_facts in F. apply in_app_or in F. apply in_or_app. right. apply in_or_app.
    destruct F as [F|F]; [left; exact F|right]. apply in_flat_map in F. destruct F as [c [C F]].
    apply filter_In in C. apply in_flat_map. exists c. tauto.
  - apply memb_In. rewrite e. exact I.
Qed.
Definition wf (s : state) : Prop := forall v, bas v -> 0 <= var_value s v < get (domain_size T) v.
Lemma lookup_ok : forall v fs x, fact_value v fs = Some x -> In (v, x) fs.
Proof.
  intros v fs x H. unfold fact_value in H.
  match type of H with match ?e with _ => _ end = _ => destruct e as [[w y]|] eqn:F end; [|discriminate].
  apply find_some in F. destruct F as [F E]. apply Pos.eqb_eq in E. simpl in *. injection H as ->. subst.
  exact F.
Qed.
Lemma matching_ok : forall s pat fs, wf s -> forallb (is_basic T) pat = true ->
  forallb (is_fact s) fs = true ->
  In (shape s pat) (matching T pat fs).
Proof.
  intros s pat fs W B F. induction pat as [|v pat IH]; simpl; [left; reflexivity|].
  simpl in B. apply andb_true_iff in B. destruct B as [B1 B2]. apply in_flat_map. exists (var_value s v).
  split.
  - destruct (fact_value v fs) as [x|] eqn:L; [|apply range_In, W, B1].
    apply lookup_ok in L. rewrite forallb_forall in F. specialize (F _ L). unfold is_fact in F. simpl in F.
    apply Z.eqb_eq in F. left. symmetry. exact F.
  - apply in_map, IH, B2.
Qed.
Lemma shape_derive : forall s pat, forallb (is_basic T) pat = true -> shape (derive T s) pat = shape s pat.
Proof.
  intros s pat B. unfold shape. apply map_ext_in. intros v I. apply derive_val.
  rewrite forallb_forall in B. apply B, I.
Qed.
Lemma wf_derive : forall s, wf s -> wf (derive T s).
Proof. intros s W v B. rewrite derive_val by exact B. apply W, B. Qed.

(* Well-formed states *)
Hypothesis task_ok : check_task T = true.
Lemma wf_init : wf (init T).
Proof.
  intros v B. unfold check_task in task_ok. rewrite !andb_true_iff in task_ok.
  destruct task_ok as [[[H _] _] _].
  rewrite forallb_forall in H. specialize (H v (basics_In v B)). unfold in_range in H. lia.
Qed.
Lemma wf_apply : forall o s ch, In o (operators T) -> wf s -> wf (apply o s ch).
Proof.
  intros o s ch I W v B. unfold apply, var_value. cbn [var_values]. rewrite get_puts.
  destruct (last_put_in (made_facts o s) v (get (var_values s) v)) as [E|E]; [rewrite E; apply W, B|].
  set (x := last_put _ _ _) in *.
  unfold check_task in task_ok. rewrite !andb_true_iff in task_ok. destruct task_ok as [[[_ H] _] _].
  rewrite forallb_forall in H. specialize (H o I). rewrite !andb_true_iff in H. destruct H as [[H1 H2] _].
  assert (S : is_well_formed T (v, x) = true).
  { unfold made_facts in E. apply in_app_or in E. destruct E as [E|E].
    - rewrite forallb_forall in H1. apply H1, E.
    - apply in_flat_map in E. destruct E as [c [C E]]. apply filter_In in C. destruct C as [C _].
      rewrite forallb_forall in H2. specialize (H2 c C). rewrite forallb_forall in H2. apply H2, E. }
  unfold is_well_formed, in_range in S. simpl in S. lia.
Qed.
Lemma holds_facts_of : forall c s sz ch, holds c s sz ch = true -> forallb (is_fact s) (facts c) = true.
Proof. intros c s sz ch H. unfold holds, holds_facts in H. rewrite !andb_true_iff in H. tauto. Qed.

(* A potential is a lower bound on the cost of every plan. *)
Lemma potential_ok : forall t, check_potential T (map prepare (operators T)) t = true ->
  forall s steps c, plan T s steps c -> wf s ->
    exists k, table_bound T t (shape s (pattern t)) = Some k /\ k <= c.
Proof.
  intros t H. unfold check_potential in H. rewrite !andb_true_iff in H. destruct H as [[B G] O].
  intros s steps c P. induction P as [s HG|s o ch steps c Io Ad Ho P IH]; intro W.
  - rewrite forallb_forall in G. specialize (G (shape s (pattern t))).
    assert (M : In (shape s (pattern t)) (matching T (pattern t) (facts (goal T)))).
    { rewrite <- shape_derive by exact B. apply matching_ok; [apply wf_derive, W|exact B|].
      eapply holds_facts_of, HG. }
    specialize (G M). unfold at_most in G. destruct (table_bound T t _) as [k|]; [|discriminate].
    exists k. split; [reflexivity|lia].
  - destruct (IH (wf_apply _ _ _ Io (wf_derive _ W))) as [k [K L]]. clear IH P.
    rewrite forallb_forall in O. specialize (O (prepare o) (in_map _ _ _ Io)).
    unfold potential_ok_for, prepare in O.
    destruct (minimum_le _ _ (in_map (amount (cost o) (slot_sizes o)) _ _ (choices_In o ch Ad))) as
      [least [E Le]].
    rewrite E in O. destruct (mentions (pattern t) o) eqn:U.
    + rewrite forallb_forall in O. specialize (O (shape s (pattern t))).
      assert (M : In (shape s (pattern t)) (matching T (pattern t) (facts (precondition o)))).
      { rewrite <- shape_derive by exact B. apply matching_ok; [apply wf_derive, W|exact B|].
        eapply holds_facts_of, Ho. }
      specialize (O M). rewrite forallb_forall in O.
      specialize (O (shape (apply o (derive T s) ch) (pattern t))).
      rewrite <- (shape_derive s _ B) in O at 1. specialize (O (all_targets_ok _ _ _ _)).
      rewrite K in O. unfold at_most in O.
      destruct (table_bound T t (shape s (pattern t))) as [b|]; [|discriminate].
      exists b. split; [reflexivity|lia].
    + rewrite untouched in K by exact U. rewrite shape_derive in K by exact B.
      exists k. split; [exact K|lia].
Qed.

(* Needs *)
Lemma alone_value : forall l n s sz ch, is_number l n = true ->
  value l s sz ch = num_value s n + amount (offset l) sz ch.
Proof.
  intros [fs r] n s sz ch H. unfold is_number in H. unfold value. simpl in *.
  destruct fs as [|[m f] [|]]; try discriminate. apply andb_true_iff in H. destruct H as [H1 H2].
  apply Pos.eqb_eq in H1. apply Z.eqb_eq in H2. subst. simpl. lia.
Qed.
Lemma changed : forall (ev : linear -> Z) cs n x,
  distinct (map fst cs) = true ->
  last_put (map (fun c : key * linear => (fst c, ev (snd c))) cs) n x =
  match filter (fun c => Pos.eqb (fst c) n) cs with [] => x | c :: _ => ev (snd c) end.
Proof.
  intros ev. induction cs as [|[m l] cs IH]; intros n x D; simpl; [reflexivity|].
  simpl in D. apply andb_true_iff in D. destruct D as [D1 D2]. rewrite IH by exact D2.
  destruct (Pos.eqb_spec m n) as [e|e]; [|reflexivity]. simpl. subst.
  match goal with |- match ?e with _ => _ end = _ => destruct e as [|c r] eqn:F end; [reflexivity|].
  exfalso. assert (I : In c (filter (fun c => Pos.eqb (fst c) n) cs)) by (rewrite F; left; reflexivity).
  apply filter_In in I. destruct I as [I E]. apply Pos.eqb_eq in E.
  apply negb_true_iff in D1. assert (Q : mem_key n (map fst cs) = true); [|congruence].
  apply memb_In. rewrite <- E. apply in_map, I.
Qed.
(* [least_use] bounds the consumption of a step. *)
Lemma lowers_ok : forall n o s ch least, In o (operators T) -> In n (numbers T) -> admitted o ch ->
  holds (precondition o) (derive T s) (slot_sizes o) ch = true -> least_use n (prepare o) = Some least ->
  num_value (apply o (derive T s) ch) n + least <= num_value s n /\ 0 <= least /\ (0 < least ->
    0 <= num_value (apply o (derive T s) ch) n).
Proof.
  intros n o s ch least Io In_ Ad Ho L.
  assert (D : distinct (map fst (number_effects o)) = true).
  { unfold check_task in task_ok. rewrite !andb_true_iff in task_ok. destruct task_ok as [[[_ H] _] _].
    rewrite forallb_forall in H. specialize (H o Io). rewrite !andb_true_iff in H. tauto. }
  assert (V : num_value (derive T s) n = num_value s n).
  { rewrite derive_num. apply memb_In in In_. rewrite In_. reflexivity. }
  pose proof (changed (fun l => value l (derive T s) (slot_sizes o) ch) (number_effects o) n
    (get (num_values (derive T s)) n) D) as CH.
  cbv beta in CH. unfold apply, num_value at 1 3. cbn [num_values]. rewrite get_puts, CH. clear CH.
  change (get (num_values (derive T s)) n) with (num_value (derive T s) n). rewrite V.
  unfold least_use, prepare in L.
  match goal with |- context [match ?e with [] => num_value s n
    | _ => _ end] => destruct e as [|[m l] r] eqn:F end.
  { injection L as <-. lia. }
  destruct r; [|discriminate]. destruct (is_number l n) eqn:E; [|discriminate]. cbn [snd].
  rewrite (alone_value _ _ _ _ _ E), V.
  destruct (minimum_le _ _ (in_map (fun ch =>
    - amount (offset l) (slot_sizes o) ch) _ _ (choices_In o ch Ad))) as [m' [E' Le]].
  rewrite E' in L. destruct (_ && _) eqn:C; [|discriminate]. injection L as <-.
  apply andb_true_iff in C. destruct C as [C1 C2]. apply Z.leb_le in C1.
  split; [lia|]. split; [exact C1|]. intro Pos. apply orb_true_iff in C2. destruct C2 as [C2|C2]; [lia|].
  rewrite forallb_forall in C2. specialize (C2 ch (choices_In o ch Ad)).
  apply existsb_exists in C2. destruct C2 as [c [Ic Ec]]. apply andb_true_iff in Ec. destruct Ec as [Ea El].
  unfold holds in Ho. apply andb_true_iff in Ho. destruct Ho as [_ Ho]. rewrite forallb_forall in Ho.
  specialize (Ho c Ic). rewrite (alone_value _ _ _ _ _ Ea), V in Ho. lia.
Qed.
Lemma need_ok : forall n t, check_need T (map prepare (operators T)) (n, t) = true ->
  forall s steps c, plan T s steps c -> wf s ->
  exists k, table_bound T t (shape s (pattern t)) = Some k /\ 0 <= k /\ (0 < k -> k <= num_value s n).
Proof.
  intros n t H. unfold check_need in H. rewrite !andb_true_iff in H. destruct H as [[[[N B] Z0] G] O].
  apply memb_In in N.
  assert (NN : forall s, wf s -> forall k, table_bound T t (shape s (pattern t)) = Some k -> 0 <= k).
  { intros s W k E. rewrite forallb_forall in Z0. specialize (Z0 (shape s (pattern t))).
    rewrite E in Z0. apply Z.leb_le. apply Z0. apply matching_ok; [exact W|exact B|reflexivity]. }
  intros s steps c P. induction P as [s HG|s o ch steps c Io Ad Ho P IH]; intro W.
  - rewrite forallb_forall in G. specialize (G (shape s (pattern t))).
    assert (M : In (shape s (pattern t)) (matching T (pattern t) (facts (goal T)))).
    { rewrite <- shape_derive by exact B. apply matching_ok; [apply wf_derive, W|exact B|].
      eapply holds_facts_of, HG. }
    specialize (G M). destruct (table_bound T t (shape s (pattern t))) as [k|] eqn:E; [|discriminate].
    exists k. split; [reflexivity|]. split; [exact (NN s W _ E)|]. intro K.
    apply orb_true_iff in G. destruct G as [G|G]; [lia|].
    apply existsb_exists in G. destruct G as [l [Il El]]. apply andb_true_iff in El. destruct El as [E1 E2].
    unfold holds in HG. apply andb_true_iff in HG. destruct HG as [_ HG]. rewrite forallb_forall in HG.
    specialize (HG l Il). rewrite (alone_value _ _ _ _ _ E1), derive_num in HG.
    apply memb_In in N. rewrite N in HG. lia.
  - pose proof (wf_apply o (derive T s) ch Io (wf_derive _ W)) as W'.
    destruct (IH W') as [k' [K' [P' L']]]. clear IH P.
    rewrite forallb_forall in O. specialize (O (prepare o) (in_map _ _ _ Io)). unfold need_ok_for in O.
    cbn [fst prepare] in O.
    assert (Q : match least_use n (prepare o) with
                | Some least => at_most (table_bound T t (shape s (pattern t))) (Some k') least = true
                | None => exists x, table_bound T t (shape s (pattern t)) = Some x /\ x = 0
                end).
    { destruct (mentions (pattern t) o) eqn:U.
      - rewrite forallb_forall in O. specialize (O (shape s (pattern t))).
        assert (M : In (shape s (pattern t)) (matching T (pattern t) (facts (precondition o)))).
        { rewrite <- shape_derive by exact B. apply matching_ok; [apply wf_derive, W|exact B|].
          eapply holds_facts_of, Ho. }
        specialize (O M). rewrite forallb_forall in O.
        specialize (O (shape (apply o (derive T s) ch) (pattern t))).
        rewrite <- (shape_derive s _ B) in O at 1. specialize (O (all_targets_ok _ _ _ _)).
        rewrite K' in O. change (o, (choices o, minimum (map (amount (cost o) (slot_sizes o)) (choices o))))
          with (prepare o) in O.
        destruct (least_use n (prepare o)); [exact O|]. unfold is_infinite, is_zero_bound in O.
        destruct (table_bound T t (shape s (pattern t))) as [x|]; simpl in O; [|discriminate].
        exists x. split; [reflexivity|]. rewrite orb_false_r in O. lia.
      - rewrite untouched in K' by exact U. rewrite shape_derive in K' by exact B.
        change (o, (choices o, minimum (map (amount (cost o) (slot_sizes o)) (choices o)))) with
          (prepare o) in O.
        destruct (least_use n (prepare o)) as [least|] eqn:L.
        + rewrite K'. simpl. destruct (lowers_ok n o s ch least Io N Ad Ho L). lia.
        + exists k'. split; [exact K'|]. rewrite forallb_forall in O. specialize (O (shape s (pattern t))).
          rewrite K' in O. simpl in O. rewrite orb_false_r in O. apply Z.eqb_eq, O.
          apply matching_ok; [exact W|exact B|reflexivity]. }
    destruct (least_use n (prepare o)) as [least|] eqn:L.
    + unfold at_most in Q. destruct (table_bound T t (shape s (pattern t))) as [k|] eqn:E; [|discriminate].
      exists k. split; [reflexivity|]. split; [exact (NN s W _ E)|]. intro Kp.
      destruct (lowers_ok n o s ch least Io N Ad Ho L) as [L1 [L2 L3]].
      apply Z.leb_le in Q.
      destruct (Z.eq_dec k' 0) as [e|e].
      * subst k'. assert (Lp : 0 < least) by lia. specialize (L3 Lp). lia.
      * assert (Kp' : 0 < k') by lia. specialize (L' Kp'). lia.
    + destruct Q as [x [E X]]. exists x. split; [exact E|]. subst. lia.
Qed.
End Soundness.

(* Coverage by labels *)
Lemma fits_ok : forall m (f g : linear -> Z) ls, fits m (map f ls) (map g ls) = true ->
  forall l, In l ls -> rel m (f l) (g l).
Proof.
  intros m f g. induction ls as [|x ls IH]; intros H l I; simpl in *; [destruct I|].
  apply andb_true_iff in H. destruct H as [H1 H2]. destruct I as [I|I]; [subst|apply IH; assumption].
  destruct m; simpl; lia.
Qed.
Lemma front_ok : forall m o ch, admitted o ch ->
  exists ch', In ch' (undominated_choices m o) /\ no_dearer m o ch' ch.
Proof.
  intros m o ch Ad. apply choices_In in Ad. unfold undominated_choices.
  match goal with |- context [if forallb ?a ?b then _ else _] => destruct (forallb a b) eqn:F end.
  - set (e := fun ch => (ch, (amount (cost o) (slot_sizes o) ch, profile o ch))) in *.
    assert (H0 : forall l, (forall x : choice_profile, In x l -> snd x = snd (e (fst x))) ->
                 forall all, (forall x : choice_profile, In x all -> snd x = snd (e (fst x))) ->
                 forall x : choice_profile, In x (fold_left (fun f e =>
                   if existsb (fun x => dominates m x e) f then f
                                    else e :: filter (fun x => negb (dominates m e x)) f) all l) ->
                                      snd x = snd (e (fst x))).
    { intros l Hl all. revert l Hl.
      induction all as [|y all IH]; intros l Hl Ha x I; simpl in I; [apply Hl, I|].
      revert I. apply IH; [|intros z Z; apply Ha; right; exact Z].
      intros z Iz. destruct (existsb _ l); [apply Hl, Iz|].
      destruct Iz as [Iz|Iz]; [subst; apply Ha; left; reflexivity|apply filter_In in Iz; apply Hl, Iz]. }
    rewrite forallb_forall in F. specialize (F (e ch) (in_map e _ _ Ad)).
    apply existsb_exists in F. destruct F as [x [Ix G]].
    exists (fst x). split; [apply in_map, Ix|].
    apply H0 in Ix; [|intros ? []|intros z Iz; apply in_map_iff in Iz; destruct Iz as [c [E _]]; subst z;
      reflexivity].
    unfold dominates in G. rewrite Ix in G. apply andb_true_iff in G. destruct G as [G1 G2]. simpl in G1, G2.
    split; [lia|]. apply (fits_ok m (fun l => amount (offset l) (slot_sizes o) (fst x)) (fun l =>
      amount (offset l) (slot_sizes o) ch)). exact G2.
  - exists ch. split; [exact Ad|]. split; [lia|]. intros. apply rel_refl.
Qed.
