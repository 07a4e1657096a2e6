(* Theorem [optimal]: if [check_certificate] accepts, then the plan of the certificate is executable
   with the claimed metric, and no plan has a smaller metric; or, without a claimed metric, there is
   no plan. *)
From Coq Require Import ZArith QArith List Bool Lia Lqa Setoid.
From Proved Require Import Task Check Sound Lifted Faithful Symbolic Simulation.
Import ListNotations.
Open Scope Q_scope.

(* What the checker accepts is true. Nothing is assumed of the ground task [T], the names [N], the
   case trees, the argument [A] and the oracle. *)
Theorem optimal : forall P T N case goal_case A oracle plan claim,
  check_certificate P T N case goal_case A oracle plan claim = true -> is_optimal P plan claim.
Proof.
  intros P T N case goal_case A oracle plan claim H. unfold check_certificate in H.
  rewrite !andb_true_iff in H. destruct H as [[C F] H].
  pose proof (initially P T N case goal_case C F) as R0.
  destruct claim as [m|].
  - destruct (eval (initial P) None [] (metric P)) as [first|] eqn:E0; [|discriminate].
    rewrite !andb_true_iff in H. destruct H as [[H0 H1] [H2 H3]].
    destruct (execute P false (initial P) 0 plan) as [[w spent]|] eqn:X; [|discriminate].
    destruct (final_metric P w spent) as [m'|] eqn:Fm; [|discriminate]. apply Qeq_bool_iff in H1.
    apply Pos.eqb_eq in H2. split.
    + exists w, spent, m'. auto.
    + intros other w2 spent2 m2 X2 F2.
      destruct (simulation P T N case goal_case C F other _ _ _ _ _ X2 R0) as [ps [c [Pl [Le [s2 R2]]]]].
      pose proof (sound T A _ oracle H3 ps c Pl) as B. cbn beta iota in B. rewrite Zle_Qle in B.
      set (q := Qred ((m - first) * (Zpos (cost_scale N) # 1))) in *.
      assert (Iq : inject_Z (Qnum q) == q) by (unfold inject_Z; destruct q as [n d]; simpl in *; subst d;
        reflexivity).
      rewrite Iq in B. unfold q in B. rewrite Qred_correct in B.
      unfold final_metric in F2. destruct (eval w2 None [] (metric P)) as [x|] eqn:E2; [|discriminate].
      injection F2 as <-.
      assert (G : forall w s v, Base P T N w s -> eval w None [] (metric P) = Some v -> measure P N w == v).
      { intros w' s v R E. pose proof
          (symbolic_expression_ok P N w' (b_value _ _ _ _ _ R) w' unchanged None Undefined
          (describes_itself P w') eq_refl [] (metric P)) as L.
        unfold measure. unfold is_linear in H0.
        destruct (symbolic_expression P N unchanged Undefined [] (metric P)) as [| |f]; try discriminate.
        symmetry. apply L, E. }
      rewrite (G _ _ _ R0 E0), (G _ _ _ R2 E2) in Le.
      assert (K : 0 < (Zpos (cost_scale N) # 1)) by reflexivity.
      assert (Y : (m - first) * (Zpos (cost_scale N) # 1) <= (x + spent2 - first - 0) *
        (Zpos (cost_scale N) # 1)) by lra.
      apply Qmult_lt_0_le_reg_r in Y; [lra|exact K].
  - intro other. destruct (execute P true (initial P) 0 other) as [[w spent]|] eqn:X; [|reflexivity]. exfalso.
    destruct (simulation P T N case goal_case C F other _ _ _ _ _ X R0) as [ps [c [Pl _]]].
    assert (H' : check T A None oracle = true) by (destruct (eval (initial P) None [] (metric P)); exact H).
    exact (sound T A None oracle H' ps c Pl).
Qed.

(* A plan without steps of duration 0 is also a plan where such steps are permitted. *)
Lemma step_permissive P w a env r : step P false w a env = Some r -> step P true w a env = Some r.
Proof.
  unfold step. destruct (negb _); [auto|]. destruct (duration a); [|auto].
  destruct (eval w None env e); [|auto]. destruct (less q 0); [auto|]. destruct (Qeq_bool q 0); [discriminate|auto].
Qed.
Lemma execute_permissive P plan : forall w spent r,
  execute P false w spent plan = Some r -> execute P true w spent plan = Some r.
Proof.
  induction plan as [|[i env] plan IH]; intros w spent r; [auto|]. simpl.
  destruct (nth_error (actions P) i) as [a|]; [|auto].
  destruct (step P false (derived_world P w) a env) as [[w' d]|] eqn:S; [|discriminate].
  rewrite (step_permissive _ _ _ _ _ S). apply IH.
Qed.

(* A certificate without a claimed metric: no list of steps can be executed to a goal state, whether
   steps of duration 0 are permitted or not. *)
Theorem unsolvable : forall P T N case goal_case A oracle plan,
  check_certificate P T N case goal_case A oracle plan None = true ->
  forall allow_zero steps, execute P allow_zero (initial P) 0 steps = None.
Proof.
  intros P T N case goal_case A oracle plan H allow_zero steps.
  pose proof (optimal _ _ _ _ _ _ _ _ _ H steps) as E. destruct allow_zero; [exact E|].
  destruct (execute P false (initial P) 0 steps) as [r|] eqn:X; [|reflexivity].
  apply execute_permissive in X. congruence.
Qed.
