(* Pareto fronts of two objectives. A certificate for a front has one certificate for each point: no
   plan with a smaller second value than the point before has a smaller first value. A last
   certificate states that no plan has a smaller second value than the last point. *)
From Coq Require Import ZArith QArith List Bool Lia Lqa.
From Proved Require Import Task Check Lifted Faithful Symbolic Axioms Optimal Lists.
Import ListNotations.
Open Scope Q_scope.

(* A point of a front: a plan, and its values of both objectives *)
Record point := Point { point_plan : list (nat * list key); first_value : Q; second_value : Q }.
(* Each plan has the values of its point; every plan for which both objectives are defined has values
   that are at least those of some point; and no point has values that are at least those of another one. *)
Definition is_front (P : problem) (first second : objective) (points : list point) : Prop :=
  (forall p, In p points -> exists x y, objective_value P false first (point_plan p) = Some x /\
     objective_value P false second (point_plan p) = Some y /\ x == first_value p /\ y == second_value p) /\
  (forall other x y, objective_value P true first other = Some x -> objective_value P true second other = Some y ->
     exists p, In p points /\ first_value p <= x /\ second_value p <= y) /\
  ForallOrdPairs (fun p q => first_value p < first_value q /\ second_value q < second_value p) points.

(* What follows does not have to be trusted. *)
Definition within (P : problem) (second : objective) (limit : option Q) : problem :=
  match limit with Some m => limited P true (objective_metric second) m | None => P end.
Definition has_value (P : problem) (o : objective) (plan : list (nat * list key)) (m : Q) : bool :=
  match objective_value P false o plan with Some x => Qeq_bool x m | None => false end.
Fixpoint check_points (P : problem) (first second : objective) (limit : option Q) (es : list evidence) (points : list point)
    : bool :=
  match points, es with
  | p :: rest, e :: es =>
      accepts (with_objective (within P second limit) first) e (point_plan p) (first_value p) &&
      has_value P second (point_plan p) (second_value p) &&
      match rest with
      | [] => match es with
              | [e] => accepts (with_objective P second) e (point_plan p) (second_value p)
              | _ => false
              end
      | q :: _ => less (first_value p) (first_value q) && less (second_value q) (second_value p) &&
                  check_points P first second (Some (second_value p)) es rest
      end
  | _, _ => false
  end.
Definition check_front (P : problem) (first second : objective) (es : list evidence) (points : list point) : bool :=
  is_untimed second && check_points P first second None es points.

Lemma less_true x y : less x y = true -> x < y.
Proof.
  unfold less. intro H. apply negb_true_iff in H. apply Qnot_le_lt. intro L. apply Qle_bool_iff in L. congruence.
Qed.
Lemma has_value_true P o plan m : has_value P o plan m = true -> exists x, objective_value P false o plan = Some x /\ x == m.
Proof.
  unfold has_value. destruct (objective_value P false o plan) as [x|]; [|discriminate]. intro H.
  exists x. split; [reflexivity|apply Qeq_bool_iff, H].
Qed.
(* The plan of an accepted certificate has the value, and no plan has a smaller one. *)
Lemma accepted P o e plan m : accepts (with_objective P o) e plan m = true ->
  (exists x, objective_value P false o plan = Some x /\ x == m) /\
  forall other x, objective_value P true o other = Some x -> m <= x.
Proof.
  intro H. apply optimal in H. destruct H as [[w [spent [x [X [F E]]]]] Best]. split.
  - exists x. split; [|exact E]. unfold objective_value. change (initial P) with (initial (with_objective P o)).
    rewrite X. exact F.
  - intros other y V. unfold objective_value in V.
    destruct (execute (with_objective P o) true (initial P) 0 other) as [[w' spent']|] eqn:Y; [|discriminate].
    exact (Best other w' spent' y Y V).
Qed.
(* A limit does not change the values of a plan. *)
Lemma unlimited P second limit o allow plan x :
  objective_value (within P second limit) allow o plan = Some x -> objective_value P allow o plan = Some x.
Proof.
  destruct limit as [m|]; cbn [within]; [|auto]. unfold objective_value.
  change (initial (limited P true (objective_metric second) m)) with (initial P).
  destruct (execute (with_objective (limited P true (objective_metric second) m) o) allow (initial P) 0 plan)
    as [[w s]|] eqn:Y; [|discriminate].
  apply run_unlimited in Y. rewrite Y. auto.
Qed.
Lemma below_limit P second limit : is_untimed second = true -> forall allow plan y,
  objective_value P allow second plan = Some y -> (forall m, limit = Some m -> y < m) ->
  forall o x, objective_value P allow o plan = Some x -> objective_value (within P second limit) allow o plan = Some x.
Proof.
  intros U allow plan y V L o x H. destruct limit as [m|]; cbn [within]; [|exact H]. specialize (L m eq_refl).
  unfold objective_value in V, H |- *.
  destruct (execute (with_objective P second) allow (initial P) 0 plan) as [[w spent]|] eqn:X; [|discriminate].
  pose proof (run_untimed P second allow U _ _ _ _ _ X) as Z.
  destruct (run_world P second o allow plan _ _ _ _ 0 X) as [spent' X'].
  unfold final_metric in V. cbn [with_objective metric] in V.
  destruct (eval w None [] (objective_metric second)) as [v|] eqn:E; [|discriminate]. injection V as V.
  assert (T : truth P (derived_world P w) None [] (Compare true (Constant m) (objective_metric second)) = Some true).
  { cbn [truth eval]. rewrite <- (Axioms.eval_same w (derived_world P w) (fun f => eq_refl)), E. f_equal.
    unfold less. apply negb_true_iff. destruct (Qle_bool m v) eqn:B; [|reflexivity]. apply Qle_bool_iff in B.
    rewrite <- V in L. lra. }
  change (initial (limited P true (objective_metric second) m)) with (initial P).
  rewrite (run_limited P o true (objective_metric second) m allow plan _ _ _ _ X' T). rewrite X' in H. exact H.
Qed.

Section Points.
Variables (P : problem) (first second : objective).
Hypothesis U : is_untimed second = true.
Lemma points_ok : forall points limit es, check_points P first second limit es points = true ->
  (forall p, In p points -> exists x y, objective_value P false first (point_plan p) = Some x /\
     objective_value P false second (point_plan p) = Some y /\ x == first_value p /\ y == second_value p) /\
  (forall other x y, objective_value P true first other = Some x -> objective_value P true second other = Some y ->
     (forall m, limit = Some m -> y < m) -> exists p, In p points /\ first_value p <= x /\ second_value p <= y) /\
  ForallOrdPairs (fun p q => first_value p < first_value q /\ second_value q < second_value p) points.
Proof.
  induction points as [|p rest IH]; intros limit es H; [destruct es; discriminate|].
  destruct es as [|e es]; [discriminate|]. cbn [check_points] in H. rewrite !andb_true_iff in H.
  destruct H as [[A V] H]. apply accepted in A. destruct A as [[x0 [X0 E0]] Best]. apply unlimited in X0.
  apply has_value_true in V. destruct V as [y0 [Y0 F0]].
  assert (Attained : exists x y, objective_value P false first (point_plan p) = Some x /\
     objective_value P false second (point_plan p) = Some y /\ x == first_value p /\ y == second_value p)
    by (exists x0, y0; auto).
  assert (Here : forall other x y, objective_value P true first other = Some x -> objective_value P true second other = Some y ->
    (forall m, limit = Some m -> y < m) -> first_value p <= x).
  { intros other x y X Y L. apply (Best other). apply (below_limit P second limit U true other y Y L first x X). }
  destruct rest as [|q rest].
  - destruct es as [|e2 [|]]; try discriminate. apply accepted in H. destruct H as [_ Last]. repeat split.
    + intros p' [<-|[]]. exact Attained.
    + intros other x y X Y L. exists p. split; [left; reflexivity|]. split; [eapply Here; eassumption|eapply Last, Y].
    + repeat constructor.
  - rewrite !andb_true_iff in H. destruct H as [[L1 L2] H]. apply less_true in L1. apply less_true in L2.
    apply IH in H. destruct H as [Values [Complete Strict]]. repeat split.
    + intros p' [<-|I]; [exact Attained|apply Values, I].
    + intros other x y X Y L. destruct (Qlt_le_dec y (second_value p)) as [B|B].
      * destruct (Complete other x y X Y) as [p' [I W]]; [intros m M; injection M as <-; exact B|].
        exists p'. split; [right; exact I|exact W].
      * exists p. split; [left; reflexivity|]. split; [eapply Here; eassumption|exact B].
    + constructor; [|exact Strict]. constructor; [auto|].
      inversion Strict as [|q' r' Q R]; subst. eapply Forall_impl; [|exact Q]. cbn beta. intros r [C D]. split; lra.
Qed.
End Points.

(* Everything that the checker accepts is a front. *)
Theorem front_optimal : forall P first second es points,
  check_front P first second es points = true -> is_front P first second points.
Proof.
  intros P first second es points H. unfold check_front in H. apply andb_true_iff in H. destruct H as [U H].
  destruct (points_ok P first second U points None es H) as [A [B C]]. split; [exact A|]. split; [|exact C].
  intros other x y X Y. apply (B other x y X Y). discriminate.
Qed.

(* No plan is better than a point in one objective, and at least as good in the other one. *)
Theorem front_undominated : forall P first second points, is_front P first second points -> forall p other x y,
  In p points -> objective_value P true first other = Some x -> objective_value P true second other = Some y ->
  x <= first_value p -> y <= second_value p -> x == first_value p /\ y == second_value p.
Proof.
  intros P first second points [_ [Complete Strict]] p other x y I X Y A B.
  destruct (Complete other x y X Y) as [q [J [C D]]].
  destruct (ForallOrdPairs_In Strict _ _ I J) as [E|[[E F]|[E F]]]; [subst q| |]; split; lra.
Qed.
