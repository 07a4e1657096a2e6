(* Lists of objectives: the first one is minimized; among the plans with its least value the second
   one; and so on. A certificate for such a list is a sequence of certificates: each one is about the
   problem with one objective, whose goal also limits the objectives before it. *)
From Coq Require Import ZArith QArith List Bool Lia Lqa.
From Proved Require Import Task Check Lifted Faithful Symbolic Axioms Optimal.
Import ListNotations.
Open Scope Q_scope.

(* An objective, and its weights of the total time and of the number of steps *)
Record objective := Objective { objective_metric : expression; time_weight : Q; step_weight : Q }.
Definition with_objective (P : problem) (o : objective) : problem :=
  Problem (objects P) (actions P) (strata P) (initial_atoms P) (initial_values P) (goal_formula P)
          (objective_metric o) (time_weight o) (step_weight o).
Definition objective_value (P : problem) (allow_zero : bool) (o : objective) (plan : list (nat * list key)) : option Q :=
  match execute (with_objective P o) allow_zero (initial P) 0 plan with
  | Some (w, spent) => final_metric (with_objective P o) w spent
  | None => None
  end.
(* The plan has the values [ms], and no plan has a list of values that is lexicographically less. The
   comparison ends at a value that is undefined. *)
Fixpoint no_less (P : problem) (objectives : list objective) (ms : list Q) (other : list (nat * list key)) : Prop :=
  match objectives, ms with
  | o :: rest, m :: ms =>
      match objective_value P true o other with
      | Some m' => m < m' \/ m == m' /\ no_less P rest ms other
      | None => True
      end
  | _, _ => True
  end.
Definition is_list_optimal (P : problem) (objectives : list objective) (plan : list (nat * list key)) (ms : list Q) : Prop :=
  Forall2 (fun o m => exists m', objective_value P false o plan = Some m' /\ m' == m) objectives ms /\
  forall other, no_less P objectives ms other.

(* What follows does not have to be trusted. *)
Record evidence := Evidence {
  list_task : task; list_names : names; list_case : nat -> list key -> case_tree; list_goal_case : case_tree;
  list_argument : argument; list_oracle : state -> list positive }.
Definition accepts (P : problem) (e : evidence) (plan : list (nat * list key)) (claim : Q) : bool :=
  check_certificate P (list_task e) (list_names e) (list_case e) (list_goal_case e) (list_argument e) (list_oracle e) plan
    (Some claim).
(* The goal also requires that the expression is at most [m], or less than [m] if [strict]. *)
Definition limited (P : problem) (strict : bool) (e : expression) (m : Q) : problem :=
  Problem (objects P) (actions P) (strata P) (initial_atoms P) (initial_values P)
          (And (Compare strict (Constant m) e) (goal_formula P)) (metric P) (per_time P) (per_step P).
Definition is_untimed (o : objective) : bool := Qeq_bool (time_weight o) 0 && Qeq_bool (step_weight o) 0.
Fixpoint check_list (P : problem) (objectives : list objective) (es : list evidence) (plan : list (nat * list key))
    (ms : list Q) : bool :=
  match objectives, es, ms with
  | [], [], [] => true
  | o :: rest, e :: es, m :: ms =>
      accepts (with_objective P o) e plan m &&
      match rest with
      | [] => match es, ms with [], [] => true | _, _ => false end
      | _ => is_untimed o && check_list (limited P false (objective_metric o) m) rest es plan ms
      end
  | _, _, _ => false
  end.

Section Same.
Variables (P : problem) (o : objective) (strict : bool) (e : expression) (m : Q).
Notation L := (limited P strict e m).
(* A plan of a problem is a plan of the limited one if its value is within the limit. *)
Lemma run_limited : forall allow plan w spent w' spent',
  execute (with_objective P o) allow w spent plan = Some (w', spent') ->
  truth P (derived_world P w') None [] (Compare strict (Constant m) e) = Some true ->
  execute (with_objective L o) allow w spent plan = Some (w', spent').
Proof.
  intros allow. induction plan as [|[i env] plan IH]; intros w spent w' spent' H T; cbn [execute] in *.
  - change (truth (with_objective L o) (derived_world (with_objective L o) w) None [] (goal_formula (with_objective L o)))
      with (truth P (derived_world P w) None [] (And (Compare strict (Constant m) e) (goal_formula P))).
    change (truth (with_objective P o) (derived_world (with_objective P o) w) None [] (goal_formula (with_objective P o)))
      with (truth P (derived_world P w) None [] (goal_formula P)) in H.
    destruct (truth P (derived_world P w) None [] (goal_formula P)) as [[]|] eqn:G; try discriminate.
    injection H as <- <-. cbn [truth] in *. rewrite G. cbn [truth] in T. rewrite T. reflexivity.
  - change (actions (with_objective L o)) with (actions (with_objective P o)).
    destruct (nth_error (actions (with_objective P o)) i) as [a|]; [|discriminate].
    change (step (with_objective L o) allow (derived_world (with_objective L o) w) a env)
      with (step (with_objective P o) allow (derived_world (with_objective P o) w) a env).
    destruct (step (with_objective P o) allow (derived_world (with_objective P o) w) a env) as [[w1 d]|]; [|discriminate].
    apply IH; assumption.
Qed.
Lemma run_unlimited : forall allow plan w spent w' spent',
  execute (with_objective L o) allow w spent plan = Some (w', spent') ->
  execute (with_objective P o) allow w spent plan = Some (w', spent').
Proof.
  intros allow. induction plan as [|[i env] plan IH]; intros w spent w' spent' H; cbn [execute] in *.
  - change (truth (with_objective L o) (derived_world (with_objective L o) w) None [] (goal_formula (with_objective L o)))
      with (truth P (derived_world P w) None [] (And (Compare strict (Constant m) e) (goal_formula P))) in H.
    change (truth (with_objective P o) (derived_world (with_objective P o) w) None [] (goal_formula (with_objective P o)))
      with (truth P (derived_world P w) None [] (goal_formula P)).
    cbn [truth] in H.
    match type of H with context [and_kleene ?limit _] => destruct limit as [[]|] end;
      destruct (truth P (derived_world P w) None [] (goal_formula P)) as [[]|]; try discriminate; exact H.
  - change (actions (with_objective L o)) with (actions (with_objective P o)) in H.
    destruct (nth_error (actions (with_objective P o)) i) as [a|]; [|discriminate].
    change (step (with_objective L o) allow (derived_world (with_objective L o) w) a env)
      with (step (with_objective P o) allow (derived_world (with_objective P o) w) a env) in H.
    destruct (step (with_objective P o) allow (derived_world (with_objective P o) w) a env) as [[w1 d]|]; [|discriminate].
    apply IH; assumption.
Qed.
End Same.
Lemma run_world : forall P o o' allow plan w spent w' spent' other,
  execute (with_objective P o) allow w spent plan = Some (w', spent') ->
  exists other', execute (with_objective P o') allow w other plan = Some (w', other').
Proof.
  intros P o o' allow. induction plan as [|[i env] plan IH]; intros w spent w' spent' other H; cbn [execute] in *.
  - change (truth (with_objective P o') (derived_world (with_objective P o') w) None [] (goal_formula (with_objective P o')))
      with (truth (with_objective P o) (derived_world (with_objective P o) w) None [] (goal_formula (with_objective P o))).
    destruct (truth _ _ _ _ _) as [[]|]; try discriminate. injection H as <- <-. exists other. reflexivity.
  - change (actions (with_objective P o')) with (actions (with_objective P o)).
    destruct (nth_error (actions (with_objective P o)) i) as [a|]; [|discriminate].
    change (step (with_objective P o') allow (derived_world (with_objective P o') w) a env)
      with (step (with_objective P o) allow (derived_world (with_objective P o) w) a env).
    destruct (step (with_objective P o) allow (derived_world (with_objective P o) w) a env) as [[w1 d]|]; [|discriminate].
    eapply IH, H.
Qed.
Lemma run_untimed : forall P o allow, is_untimed o = true -> forall plan w spent w' spent',
  execute (with_objective P o) allow w spent plan = Some (w', spent') -> spent' == spent.
Proof.
  intros P o allow U. unfold is_untimed in U. apply andb_true_iff in U. destruct U as [U1 U2].
  apply Qeq_bool_iff in U1. apply Qeq_bool_iff in U2.
  induction plan as [|[i env] plan IH]; intros w spent w' spent' H; cbn [execute] in *.
  - destruct (truth _ _ _ _ _) as [[]|]; try discriminate. injection H as <- <-. reflexivity.
  - destruct (nth_error _ i) as [a|]; [|discriminate]. destruct (step _ _ _ a env) as [[w1 d]|]; [|discriminate].
    apply IH in H. rewrite H, Qred_correct. cbn [with_objective per_time per_step]. rewrite U1, U2. ring.
Qed.
(* A plan whose value equals the limit has the same values of all objectives in both problems. *)
Lemma within_limit : forall P o m, is_untimed o = true -> forall allow plan m', objective_value P allow o plan = Some m' ->
  m' == m -> forall o', objective_value (limited P false (objective_metric o) m) allow o' plan = objective_value P allow o' plan.
Proof.
  intros P o m U allow plan m' H E o'. unfold objective_value in H.
  destruct (execute (with_objective P o) allow (initial P) 0 plan) as [[w spent]|] eqn:X; [|discriminate].
  pose proof (run_untimed P o allow U _ _ _ _ _ X) as Z.
  destruct (run_world P o o' allow plan _ _ _ _ 0 X) as [spent' X'].
  unfold final_metric in H. cbn [with_objective metric] in H.
  destruct (eval w None [] (objective_metric o)) as [x|] eqn:V; [|discriminate]. injection H as H.
  assert (T : truth P (derived_world P w) None [] (Compare false (Constant m) (objective_metric o)) = Some true).
  { cbn [truth eval]. rewrite <- (Axioms.eval_same w (derived_world P w) (fun f => eq_refl)), V. f_equal.
    apply Qle_bool_iff. rewrite <- H in E. lra. }
  unfold objective_value. change (initial (limited P false (objective_metric o) m)) with (initial P).
  rewrite (run_limited P o' false (objective_metric o) m allow plan _ _ _ _ X' T), X'. reflexivity.
Qed.
Lemma no_less_same : forall P R other, (forall o, objective_value P true o other = objective_value R true o other) ->
  forall objectives ms, no_less P objectives ms other -> no_less R objectives ms other.
Proof.
  intros P R other S. induction objectives as [|o rest IH]; intros [|m ms] H; cbn [no_less] in *; auto.
  rewrite <- S. destruct (objective_value P true o other); auto. destruct H as [H|[H1 H2]]; [left; exact H|right].
  split; [exact H1|apply IH, H2].
Qed.
Theorem list_optimal : forall objectives P es plan ms,
  check_list P objectives es plan ms = true -> is_list_optimal P objectives plan ms.
Proof.
  induction objectives as [|o rest IH]; intros P es plan ms H; cbn [check_list] in H.
  - destruct es; [|discriminate]. destruct ms; [|discriminate]. split; [constructor|]. intro other. exact I.
  - destruct es as [|e es]; [discriminate|]. destruct ms as [|m ms]; [discriminate|].
    apply andb_true_iff in H. destruct H as [C H]. apply optimal in C. destruct C as [[w [spent [m0 [X [F E]]]]] Best].
    assert (First : objective_value P false o plan = Some m0).
    { unfold objective_value. change (initial P) with (initial (with_objective P o)). rewrite X. exact F. }
    assert (Bound : forall other m', objective_value P true o other = Some m' -> m < m' \/ m == m').
    { intros other m' V. unfold objective_value in V.
      destruct (execute (with_objective P o) true (initial P) 0 other) as [[w' spent']|] eqn:X'; [|discriminate].
      pose proof (Best other w' spent' m' X' V) as L. destruct (Qlt_le_dec m m'); [left; assumption|right; lra]. }
    destruct rest as [|o2 rest].
    + destruct es; [|discriminate]. destruct ms; [|discriminate]. split.
      * constructor; [exists m0; auto|constructor].
      * intro other. cbn [no_less]. destruct (objective_value P true o other) as [m'|] eqn:V; [|exact I].
        destruct (Bound _ _ V); [left; assumption|right; split; [assumption|exact I]].
    + apply andb_true_iff in H. destruct H as [U H]. apply IH in H. destruct H as [Values Rest]. split.
      * constructor; [exists m0; auto|]. revert Values. clear -X. intro V. induction V as [|o' m' os ms A V IH]; constructor;
          [|exact IH]. destruct A as [x [A B]]. exists x. split; [|exact B]. unfold objective_value in *.
        change (initial (limited P false (objective_metric o) m)) with (initial P) in A.
        destruct (execute (with_objective (limited P false (objective_metric o) m) o') false (initial P) 0 plan)
          as [[w' s']|] eqn:Y; [|discriminate]. apply run_unlimited in Y. rewrite Y. exact A.
      * intro other. change (match objective_value P true o other with Some m' => m < m' \/ m == m' /\
          no_less P (o2 :: rest) ms other | None => True end).
        destruct (objective_value P true o other) as [m'|] eqn:V; [|exact I].
        destruct (Bound _ _ V) as [L|L]; [left; exact L|right]. split; [exact L|].
        apply (no_less_same (limited P false (objective_metric o) m) P other); [|apply Rest].
        apply (within_limit P o m U true other m' V). symmetry. exact L.
Qed.
