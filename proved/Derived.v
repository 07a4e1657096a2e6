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
