(* Theorem [layer_closed]: [evaluate_layer] of Task.v reaches a fixpoint, so its fuel suffices. *)
From Coq Require Import ZArith List Bool FMapPositive Lia.
From Proved Require Import Task Check Proof.
Import ListNotations.
Open Scope Z_scope.

Lemma filter_shorter : forall X (f : X -> bool) l, (length (filter f l) <= length l)%nat.
Proof. intros X f. induction l as [|x l IH]; simpl; [lia|]. destruct (f x); simpl; lia. Qed.

Section Closed.
Variable rules : list (fact * condition).
(* All rules of a derived variable assign the same value. *)
Hypothesis one_value : forall r q, In r rules -> In q rules -> fst (fst r) = fst (fst q) ->
  snd (fst r) = snd (fst q).
Definition true_heads (s : state) : nat := length (filter (fun r => is_fact s (fst r)) rules).
Lemma new_facts_in : forall s f, In f (new_facts rules s) ->
  (exists r, In r rules /\ fst r = f) /\ is_fact s f = false.
Proof.
  intros s f I. unfold new_facts in I. apply in_map_iff in I. destruct I as [r [E I]]. apply filter_In in I.
  destruct I as [I C].
  apply andb_true_iff in C. destruct C as [C _]. apply negb_true_iff in C. subst f.
  split; [exists r; tauto|exact C].
Qed.
Lemma grows : forall s r, In r rules -> is_fact s (fst r) = true \/ In (fst r) (new_facts rules s) ->
  is_fact (State (put_all (new_facts rules s) (var_values s)) (num_values s)) (fst r) = true.
Proof.
  intros s r I H. unfold is_fact, var_value. cbn [var_values]. rewrite get_puts. apply Z.eqb_eq.
  destruct (last_put_in (new_facts rules s) (fst (fst r)) (get (var_values s) (fst (fst r)))) as [E|E].
  - rewrite E. destruct H as [H|H]; [apply Z.eqb_eq, H|].
    exfalso. assert (G : forall fs x, In (fst r) fs ->
      (forall f, In f fs -> exists q, In q rules /\ fst q = f) ->
       last_put fs (fst (fst r)) x = snd (fst r)).
    { induction fs as [|f fs IH]; intros x J Q; [destruct J|]. simpl.
      destruct (in_dec (fun a b : fact => ltac:(decide equality;
        [apply Z.eq_dec|apply Pos.eq_dec])) (fst r) fs) as [K|K].
      - apply IH; [exact K|intros; apply Q; right; assumption].
      - destruct J as [J|J]; [|contradiction]. subst f. rewrite Pos.eqb_refl.
        destruct (last_put_in fs (fst (fst r)) (snd (fst r))) as [L|L]; [exact L|].
        destruct (Q _ (or_intror L)) as [q [Iq Eq]].
        assert (V : snd (fst q) = snd (fst r)) by (apply one_value; auto; rewrite Eq; reflexivity).
        rewrite Eq in V. exact V. }
    specialize (G (new_facts rules s) (get (var_values s) (fst (fst r))) H (fun f If =>
      proj1 (new_facts_in s f If))).
    destruct (new_facts_in s _ H) as [_ F]. unfold is_fact, var_value in F. apply Z.eqb_neq in F. congruence.
  - destruct (new_facts_in s _ E) as [[q [Iq Eq]] _].
    assert (V : snd (fst q) = snd (fst r)) by (apply one_value; auto; rewrite Eq; reflexivity).
    rewrite Eq in V. exact V.
Qed.
Lemma more_true_heads : forall s, new_facts rules s <> [] ->
  (true_heads s < true_heads (State (put_all (new_facts rules s) (var_values s)) (num_values s)))%nat.
Proof.
  intros s N. destruct (new_facts rules s) as [|f fs] eqn:E; [congruence|]. rewrite <- E.
  destruct (new_facts_in s f) as [[r0 [I0 E0]] F0]; [rewrite E; left; reflexivity|].
  unfold true_heads.
  assert (G : forall l, incl l rules ->
    (length (filter (fun r => is_fact s (fst r)) l) <= length (filter (fun r =>
      is_fact (State (put_all (new_facts rules s) (var_values s)) (num_values s)) (fst r)) l))%nat /\
    (In r0 l -> (length (filter (fun r => is_fact s (fst r)) l) < length (filter (fun r =>
      is_fact (State (put_all (new_facts rules s) (var_values s)) (num_values s)) (fst r)) l))%nat)).
  { induction l as [|r l IH]; intros Sub; [split; [simpl; lia|intros []]|].
    destruct IH as [A B]; [intros x X; apply Sub; right; exact X|].
    assert (Ir : In r rules) by (apply Sub; left; reflexivity). cbn [filter].
    destruct (is_fact s (fst r)) eqn:T.
    - rewrite (grows s r Ir (or_introl T)). cbn [length]. split; [lia|]. intros [X|X]; [subst; congruence|].
      specialize (B X). lia.
    - split.
      + destruct (is_fact (State _ _) (fst r)); cbn [length]; lia.
      + intros [X|X].
        * subst r. rewrite (grows s r0 I0) by (right; rewrite E0, E; left; reflexivity). cbn [length]. lia.
        * specialize (B X). destruct (is_fact (State _ _) (fst r)); cbn [length]; lia. }
  apply (G rules); [intros x X; exact X|exact I0].
Qed.
Theorem layer_closed : forall s, new_facts rules (evaluate_layer (S (length rules)) rules s) = [].
Proof.
  assert (G : forall fuel s, (length rules < fuel + true_heads s)%nat ->
    new_facts rules (evaluate_layer fuel rules s) = []).
  { induction fuel; intros s H; cbn [evaluate_layer].
    - exfalso. unfold true_heads in H. pose proof (filter_shorter _ (fun r => is_fact s (fst r)) rules). lia.
    - destruct (new_facts rules s) as [|f fs] eqn:E; [exact E|]. rewrite <- E. apply IHfuel.
      assert (Ne : new_facts rules s <> []) by (rewrite E; discriminate).
      pose proof (more_true_heads s Ne) as M. lia. }
  intro s. apply G. lia.
Qed.
End Closed.

(* All rules of an accepted task are satisfied by its derived variables. *)
Lemma put_heads : forall (rules : list (fact * condition)) (m : M.t Z) v,
  M.find v (fold_left (fun m r => M.add (fst (fst r)) (snd (fst r)) m) rules m) = None ->
  M.find v m = None /\ forall r, In r rules -> fst (fst r) <> v.
Proof.
  induction rules as [|r rules IH]; intros m v H; [split; [exact H|intros r []]|].
  cbn [fold_left] in H. destruct (IH _ _ H) as [A B]. destruct (Pos.eq_dec (fst (fst r)) v) as [e|e].
  - subst v. rewrite M.gss in A. discriminate.
  - rewrite M.gso in A by (intro Q; apply e; symmetry; exact Q). split; [exact A|]. intros q [<-|Q]; [exact e|apply B, Q].
Qed.
Lemma evaluate_keeps : forall fuel rules s v, (forall r, In r rules -> fst (fst r) <> v) ->
  var_value (evaluate_layer fuel rules s) v = var_value s v.
Proof.
  induction fuel; intros rules s v H; [reflexivity|]. cbn [evaluate_layer].
  destruct (new_facts rules s) as [|f fs] eqn:E; [reflexivity|]. rewrite IHfuel by exact H.
  unfold var_value. cbn [var_values]. rewrite get_puts. apply last_put_none. intros g G. rewrite <- E in G.
  destruct (new_facts_in rules s g G) as [[r [I <-]] _]. apply H, I.
Qed.
Lemma layers_keep : forall ls s v, M.find v (snd (check_layers ls)) = None ->
  var_value (fold_left (fun s rules => evaluate_layer (S (length rules)) rules s) ls s) v = var_value s v.
Proof.
  induction ls as [|rules ls IH]; intros s v H; [reflexivity|]. cbn [check_layers] in H.
  destruct (check_layers ls) as [ok later]. apply put_heads in H. destruct H as [A B].
  cbn [fold_left]. rewrite IH by exact A. apply evaluate_keeps, B.
Qed.
Lemma layers_keep_numbers : forall ls s n,
  num_value (fold_left (fun s rules => evaluate_layer (S (length rules)) rules s) ls s) n = num_value s n.
Proof.
  induction ls as [|rules ls IH]; intros s n; [reflexivity|]. cbn [fold_left]. rewrite IH. apply layer_num.
Qed.
Lemma holds_agrees : forall c s t, (forall v, In v (condition_variables c) -> var_value s v = var_value t v) ->
  (forall n, num_value s n = num_value t n) -> holds c s [] [] = holds c t [] [].
Proof.
  intros c s t V N. unfold holds, holds_facts. f_equal; [f_equal|].
  - assert (F : forall f, In f (facts c) -> is_fact s f = is_fact t f).
    { intros f I. unfold is_fact. rewrite V; [reflexivity|]. apply in_or_app. left. apply in_map, I. }
    revert F. generalize (facts c). induction l as [|f l IH]; intro F; [reflexivity|]. cbn [forallb].
    rewrite (F f) by (left; reflexivity). f_equal. apply IH. intros g G. apply F. right. exact G.
  - assert (F : forall cl, In cl (clauses c) -> existsb (is_literal s) cl = existsb (is_literal t) cl).
    { intros cl I. assert (L : forall l, In l cl -> is_literal s l = is_literal t l).
      { intros l J. unfold is_literal, is_fact. rewrite V; [reflexivity|]. apply in_or_app. right.
        apply in_map_iff. exists l. split; [reflexivity|]. apply in_concat. exists cl. split; assumption. }
      clear I. induction cl as [|l cl IH]; [reflexivity|]. cbn [existsb].
      rewrite (L l) by (left; reflexivity). f_equal. apply IH. intros g G. apply L. right. exact G. }
    revert F. generalize (clauses c). induction l as [|f l IH]; intro F; [reflexivity|]. cbn [forallb].
    rewrite (F f) by (left; reflexivity). f_equal. apply IH. intros g G. apply F. right. exact G.
  - apply forallb_ext. intro l. f_equal. unfold value. generalize (amount (offset l) [] []).
    induction (factors l) as [|f fs IH]; intro a; [reflexivity|]. cbn [fold_left]. rewrite N. apply IH.
Qed.
Theorem derive_closed : forall T, fst (check_layers (layers T)) = true -> forall s rules r,
  In rules (layers T) -> In r rules -> holds (snd r) (derive T s) [] [] = true ->
  is_fact (derive T s) (fst r) = true.
Proof.
  intros T C s0 rules r I J. unfold derive. generalize (reset_derived T s0) as s. revert C I.
  generalize (layers T) as ls. induction ls as [|layer ls IH]; intros C I s H; [destruct I|].
  cbn [check_layers] in C. destruct (check_layers ls) as [ok later] eqn:E. cbn [fst] in *.
  apply andb_true_iff in C. destruct C as [Ok C]. rewrite forallb_forall in C. cbn [fold_left] in *.
  destruct I as [<-|I]; [|apply IH; assumption].
  pose proof (C _ J) as R. apply andb_true_iff in R. destruct R as [_ R]. rewrite forallb_forall in R.
  assert (K : forall v, In v (fst (fst r) :: condition_variables (snd r)) -> forall s,
    var_value (fold_left (fun s rules => evaluate_layer (S (length rules)) rules s) ls s) v = var_value s v).
  { intros v V t. apply layers_keep. rewrite E. specialize (R _ V). cbn [snd].
    destruct (M.find v later); [discriminate|reflexivity]. }
  assert (One : forall r q, In r layer -> In q layer -> fst (fst r) = fst (fst q) ->
    snd (fst r) = snd (fst q)).
  { intros a b A B Eq. pose proof (C _ A) as CA. pose proof (C _ B) as CB.
    apply andb_true_iff in CA. apply andb_true_iff in CB. destruct CA as [CA _]. destruct CB as [CB _].
    clear A B. destruct a as [[va xa] ca], b as [[vb xb] cb]. cbn [fst snd] in *. subst vb.
    destruct (M.find va _); [|discriminate]. lia. }
  set (t := evaluate_layer (S (length layer)) layer s) in *.
  rewrite (holds_agrees (snd r) _ t) in H;
    [|intros v V; apply K; right; exact V|intro n; apply layers_keep_numbers].
  unfold is_fact. rewrite K by (left; reflexivity).
  pose proof (layer_closed layer One s) as Cl. fold t in Cl. unfold new_facts in Cl.
  destruct (var_value t (fst (fst r)) =? snd (fst r)) eqn:F; [reflexivity|]. exfalso.
  assert (X : In (fst r) (map fst (filter (fun r : fact * condition =>
    negb (is_fact t (fst r)) && holds (snd r) t [] []) layer))).
  { apply in_map, filter_In. split; [exact J|]. unfold is_fact. rewrite F, H. reflexivity. }
  rewrite Cl in X. destruct X.
Qed.

(* Induction over the evaluation of the derived variables: a property of variables that every rule
   preserves holds for each variable with its true value. *)
Section Induction.
Variables (T : task) (s0 : state) (true_value : key -> Z -> Prop) (Q : key -> Prop).
Hypothesis heads_not_basic : forallb (forallb (fun r : fact * condition => negb (is_basic T (fst (fst r))))) (layers T) = true.
Hypothesis derived_not_basic : forallb (fun d : key * Z => negb (is_basic T (fst d))) (derived T) = true.
Hypothesis initially : forall v y, true_value v y -> is_fact (reset_derived T s0) (v, y) = true -> Q v.
Hypothesis step : forall rules rest before s r, layers T = before ++ rules :: rest -> In r rules ->
  (forall u, is_basic T u = true -> var_value s u = var_value s0 u) ->
  (forall u, M.find u (snd (check_layers (rules :: rest))) = None -> var_value s u = var_value (derive T s0) u) ->
  (forall v y, true_value v y -> is_fact s (v, y) = true -> Q v) ->
  holds (snd r) s [] [] = true -> true_value (fst (fst r)) (snd (fst r)) -> Q (fst (fst r)).
Theorem derive_invariant : forall v y, true_value v y -> is_fact (derive T s0) (v, y) = true -> Q v.
Proof.
  assert (G : forall ls before s, layers T = before ++ ls ->
    fold_left (fun s rules => evaluate_layer (S (length rules)) rules s) ls s = derive T s0 ->
    (forall u, is_basic T u = true -> var_value s u = var_value s0 u) ->
    (forall v y, true_value v y -> is_fact s (v, y) = true -> Q v) ->
    forall v y, true_value v y -> is_fact (derive T s0) (v, y) = true -> Q v).
  { induction ls as [|rules ls IH]; intros before s L D Ba Tr v y; [cbn [fold_left] in D; rewrite <- D; apply Tr|].
    assert (Heads : forall r, In r rules -> is_basic T (fst (fst r)) = false).
    { intros r I. rewrite forallb_forall in heads_not_basic. specialize (heads_not_basic rules).
      rewrite L in heads_not_basic. specialize (heads_not_basic (in_elt _ _ _)).
      rewrite forallb_forall in heads_not_basic. apply negb_true_iff, heads_not_basic, I. }
    assert (Fix : forall u, M.find u (snd (check_layers (rules :: ls))) = None ->
      var_value (derive T s0) u = var_value s u) by (intros u U; rewrite <- D; apply (layers_keep (rules :: ls)), U).
    assert (NotHead : forall u, M.find u (snd (check_layers (rules :: ls))) = None ->
      forall r, In r rules -> fst (fst r) <> u).
    { intros u U. cbn [check_layers] in U. destruct (check_layers ls) as [ok later].
      apply put_heads in U. apply U. }
    assert (Round : forall n t,
      (forall u, is_basic T u = true -> var_value t u = var_value s0 u) ->
      (forall u, M.find u (snd (check_layers (rules :: ls))) = None -> var_value t u = var_value (derive T s0) u) ->
      (forall v y, true_value v y -> is_fact t (v, y) = true -> Q v) ->
      let t' := evaluate_layer n rules t in
      (forall u, is_basic T u = true -> var_value t' u = var_value s0 u) /\
      (forall v y, true_value v y -> is_fact t' (v, y) = true -> Q v)).
    { induction n; intros t B1 B2 B3; [split; assumption|]. cbn [evaluate_layer].
      destruct (new_facts rules t) as [|f fs] eqn:E; [split; assumption|]. rewrite <- E.
      assert (N : forall g, In g (new_facts rules t) ->
        exists r, In r rules /\ fst r = g /\ holds (snd r) t [] [] = true).
      { intros g J. unfold new_facts in J. apply in_map_iff in J. destruct J as [r [<- J]]. apply filter_In in J.
        destruct J as [J C]. apply andb_true_iff in C. exists r. tauto. }
      apply IHn.
      - intros u U. unfold var_value. cbn [var_values]. rewrite get_puts, last_put_none; [apply B1, U|].
        intros g J e. destruct (N _ J) as [r [I [A _]]]. pose proof (Heads _ I) as X. rewrite A, e in X. congruence.
      - intros u U. unfold var_value at 1. cbn [var_values]. rewrite get_puts, last_put_none; [apply B2, U|].
        intros g J e. destruct (N _ J) as [r [I [A _]]]. apply (NotHead _ U _ I). rewrite A. exact e.
      - intros w x W F. unfold is_fact, var_value in F. cbn [var_values fst snd] in F. rewrite get_puts in F.
        apply Z.eqb_eq in F.
        destruct (last_put_in (new_facts rules t) w (get (var_values t) w)) as [K|K].
        + apply (B3 w x W). unfold is_fact, var_value. cbn [fst snd]. apply Z.eqb_eq. congruence.
        + rewrite F in K. destruct (N _ K) as [r [I [A C]]].
          pose proof (step rules ls before t r L I B1 B2 B3 C) as X. rewrite A in X. apply X, W. }
    cbn [fold_left] in D. destruct (Round (S (length rules)) s) as [R1 R2]; auto.
    { intros u U. symmetry. apply Fix, U. }
    apply (IH (before ++ [rules]) (evaluate_layer (S (length rules)) rules s)); auto.
    rewrite L, <- app_assoc. reflexivity. }
  intros v y. apply (G (layers T) [] (reset_derived T s0)); auto.
  intros u U. apply reset_val; auto.
Qed.
End Induction.

Lemma last_put_some : forall fs v x, (exists f, In f fs /\ fst f = v) -> In (v, last_put fs v x) fs.
Proof.
  induction fs as [|f fs IH]; intros v x [g [I E]]; [destruct I|]. simpl.
  destruct (in_dec (fun a b : positive => Pos.eq_dec a b) v (map fst fs)) as [J|J].
  - right. apply in_map_iff in J. destruct J as [h [H J]]. apply IH. exists h. auto.
  - left. destruct I as [<-|I]; [|exfalso; apply J, in_map_iff; exists g; auto].
    rewrite <- E, Pos.eqb_refl. rewrite last_put_none; [destruct f; reflexivity|].
    intros h H e. apply J, in_map_iff. exists h. split; [congruence|exact H].
Qed.
(* A derived variable has its true value or its default value. *)
Lemma derived_values : forall T s v y d, (exists f, In f (derived T) /\ fst f = v) ->
  (forall f, In f (derived T) -> fst f = v -> snd f = d) ->
  (forall rules r, In rules (layers T) -> In r rules -> fst (fst r) = v -> snd (fst r) = y) ->
  var_value (derive T s) v = y \/ var_value (derive T s) v = d.
Proof.
  intros T s v y d Ex De He. unfold derive.
  assert (I : var_value (reset_derived T s) v = y \/ var_value (reset_derived T s) v = d).
  { right. unfold reset_derived, var_value. cbn [var_values]. rewrite get_puts.
    pose proof (last_put_some (derived T) v (get (put_all (map (fun v => (v, get (var_values s) v)) (basics T)) (M.empty Z)) v) Ex) as L.
    exact (De _ L eq_refl). }
  revert I. generalize (reset_derived T s) as t. revert He. generalize (layers T) as ls.
  induction ls as [|rules ls IH]; intros He t I; [exact I|]. cbn [fold_left]. apply IH.
  { intros rs r R. apply He. right. exact R. }
  generalize (S (length rules)) as n. intro n. revert t I. induction n; intros t I; [exact I|]. cbn [evaluate_layer].
  destruct (new_facts rules t) as [|f fs] eqn:E; [exact I|]. rewrite <- E. apply IHn.
  unfold var_value in *. cbn [var_values]. rewrite get_puts.
  destruct (last_put_in (new_facts rules t) v (get (var_values t) v)) as [K|K]; [rewrite K; exact I|left].
  destruct (new_facts_in rules t _ K) as [[r [J A]] _].
  pose proof (He rules r (or_introl eq_refl) J) as X. rewrite A in X. exact (X eq_refl).
Qed.
