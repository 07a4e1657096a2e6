(* Derived predicates of PDDL: the strata reach a fixpoint, and if they are stratified, an atom holds
   if and only if the body of one of its rules holds. *)
From Coq Require Import ZArith QArith List Bool FMapPositive Lia.
From Proved Require Import Task Derived Lifted Faithful Symbolic.
Import ListNotations.
Open Scope nat_scope.

(* Sets of atoms *)
Lemma mem_add : forall (m : atom_map unit) a b, mem (add_atom a tt m) b = atom_eqb b a || mem m b.
Proof.
  intros m a b. unfold mem, find_atom, add_atom, bucket_entries.
  destruct (Pos.eq_dec (bucket b) (bucket a)) as [e|e].
  - rewrite e, PositiveMap.gss. cbn [assoc]. destruct (atom_eqb b a); reflexivity.
  - rewrite PositiveMap.gso by exact e. destruct (atom_eqb b a) eqn:E; [|reflexivity].
    apply atom_eqb_eq in E. congruence.
Qed.
Lemma mem_fold : forall new (m : atom_map unit) b,
  mem (fold_left (fun m a => add_atom a tt m) new m) b = existsb (atom_eqb b) new || mem m b.
Proof.
  induction new as [|a new IH]; intros m b; [reflexivity|]. cbn [fold_left existsb]. rewrite IH, mem_add.
  destruct (atom_eqb b a), (existsb (atom_eqb b) new); reflexivity.
Qed.
Lemma mem_empty : forall a, mem (PositiveMap.empty (list (atom * unit))) a = false.
Proof. intro a. unfold mem, find_atom, bucket_entries. rewrite PositiveMap.gempty. reflexivity. Qed.
Lemma in_atoms : forall a l, existsb (atom_eqb a) l = true <-> In a l.
Proof.
  intros a l. rewrite existsb_exists. split.
  - intros [b [I E]]. apply atom_eqb_eq in E. subst. exact I.
  - intro I. exists a. split; [exact I|apply atom_eqb_refl].
Qed.

(* A formula keeps its truth value where the allowed occurrences keep theirs. *)
Lemma eval_same : forall W W', (forall f, value_in W f = value_in W' f) -> forall d env e,
  eval W d env e = eval W' d env e.
Proof.
  intros W W' V d env. induction e; cbn [eval]; rewrite ?IHe1, ?IHe2; try reflexivity.
  destruct (ground env ts); [apply V|reflexivity].
Qed.
Section Kept.
Variables (P : problem) (allowed : key -> bool -> bool) (W W' : world).
Hypothesis kept_true : forall a, allowed (fst a) true = true -> holds_in W a = true -> holds_in W' a = true.
Hypothesis kept_false : forall a, allowed (fst a) false = true -> holds_in W a = false -> holds_in W' a = false.
Hypothesis values : forall f, value_in W f = value_in W' f.
Lemma truth_kept : forall f b env d, occurrences_ok allowed b f = true -> truth P W d env f = Some b ->
  truth P W' d env f = Some b.
Proof.
  induction f; intros v env d O H; cbn [occurrences_ok truth] in *.
  - exact H.
  - destruct (ground env ts) as [l|]; [|discriminate]. injection H as H. f_equal.
    destruct v; [apply kept_true|apply kept_false]; assumption.
  - exact H.
  - rewrite <- !(eval_same W W' values). exact H.
  - destruct (truth P W d env f) as [t|] eqn:E; [|discriminate]. cbn [option_map] in H. injection H as <-.
    rewrite negb_involutive in O. rewrite (IHf _ _ _ O E). reflexivity.
  - apply andb_true_iff in O. destruct O as [O1 O2]. destruct v.
    + assert (A : truth P W d env f1 = Some true /\ truth P W d env f2 = Some true)
        by (destruct (truth P W d env f1) as [[]|], (truth P W d env f2) as [[]|]; simpl in H;
            split; congruence).
      destruct A as [A1 A2]. rewrite (IHf1 _ _ _ O1 A1), (IHf2 _ _ _ O2 A2). reflexivity.
    + assert (A : truth P W d env f1 = Some false \/ truth P W d env f2 = Some false)
        by (destruct (truth P W d env f1) as [[]|], (truth P W d env f2) as [[]|]; simpl in H;
            try discriminate; auto).
      destruct A as [A|A]; [rewrite (IHf1 _ _ _ O1 A)|rewrite (IHf2 _ _ _ O2 A)];
        destruct (truth P W' d env f1) as [[]|], (truth P W' d env f2) as [[]|]; reflexivity.
  - revert H. induction (objects P type) as [|o os IH]; intro H; cbn [fold_right] in *; [exact H|].
    set (x := fold_right _ _ os) in H at 1. set (y := fold_right _ _ os).
    assert (X : x = Some v -> y = Some v) by exact IH. clearbody x y. clear IH.
    destruct v.
    + assert (A : truth P W d (env ++ [o]) f = Some true /\ x = Some true)
        by (destruct (truth P W d (env ++ [o]) f) as [[]|], x as [[]|]; simpl in H; split; congruence).
      destruct A as [A1 A2]. rewrite (IHf _ _ _ O A1), (X A2). reflexivity.
    + assert (A : truth P W d (env ++ [o]) f = Some false \/ x = Some false)
        by (destruct (truth P W d (env ++ [o]) f) as [[]|], x as [[]|]; simpl in H; try discriminate; auto).
      destruct A as [A|A]; [rewrite (IHf _ _ _ O A)|rewrite (X A)];
        destruct (truth P W' d (env ++ [o]) f) as [[]|], y as [[]|]; reflexivity.
Qed.
End Kept.

Section Strata.
Variables (P : problem) (w : world).
Notation W F := (with_facts P w F).
Notation all_derived instances := (forall i : atom * formula, In i instances -> is_derived P (fst (fst i)) = true).

(* One stratum *)
Lemma new_atoms_in : forall V instances a, In a (new_atoms P V instances) ->
  exists i, In i instances /\ fst i = a /\ fires_in P V i = true /\ holds_in V a = false.
Proof.
  intros V instances a I. unfold new_atoms in I. apply in_map_iff in I. destruct I as [i [<- I]].
  apply filter_In in I. destruct I as [I H]. apply andb_true_iff in H. destruct H as [N H]. exists i.
  apply negb_true_iff in N. auto.
Qed.
Lemma stratum_grows : forall n instances F a, mem F a = true -> mem (evaluate_stratum P n instances w F) a = true.
Proof.
  induction n; intros instances F a H; [exact H|]. cbn [evaluate_stratum].
  destruct (new_atoms P (W F) instances) as [|b new]; [exact H|]. apply IHn. rewrite mem_fold, H. apply orb_true_r.
Qed.
Lemma stratum_origin : forall n instances F a, mem (evaluate_stratum P n instances w F) a = true ->
  mem F a = true \/ exists i F', In i instances /\ fst i = a /\ fires_in P (W F') i = true /\
    (forall b, mem F b = true -> mem F' b = true) /\
    (forall b, mem F' b = true -> mem (evaluate_stratum P n instances w F) b = true).
Proof.
  induction n; intros instances F a H; [left; exact H|]. cbn [evaluate_stratum] in *.
  destruct (new_atoms P (W F) instances) as [|c new] eqn:E; [left; exact H|]. rewrite <- E in *.
  set (F1 := fold_left (fun m a => add_atom a tt m) (new_atoms P (W F) instances) F) in *.
  assert (G : forall b, mem F b = true -> mem F1 b = true).
  { intros b B. unfold F1. rewrite mem_fold, B. apply orb_true_r. }
  destruct (IHn _ _ _ H) as [M|[i [F' [I [A [Fi [L U]]]]]]].
  - unfold F1 in M. rewrite mem_fold in M. apply orb_true_iff in M. destruct M as [M|M]; [right|left; exact M].
    apply in_atoms in M. apply new_atoms_in in M. destruct M as [i [I [A [Fi _]]]]. exists i, F.
    split; [exact I|]. split; [exact A|]. split; [exact Fi|]. split; [auto|].
    intros b B. apply stratum_grows, G, B.
  - right. exists i, F'. split; [exact I|]. split; [exact A|]. split; [exact Fi|]. split; [|exact U].
    intros b B. apply L, G, B.
Qed.
Lemma stratum_other : forall n instances F a, (forall i, In i instances -> fst (fst i) <> fst a) ->
  mem (evaluate_stratum P n instances w F) a = mem F a.
Proof.
  intros n instances F a N. destruct (mem F a) eqn:E; [apply stratum_grows, E|].
  destruct (mem (evaluate_stratum P n instances w F) a) eqn:E2; [|reflexivity].
  apply stratum_origin in E2. destruct E2 as [E2|[i [F' [I [A _]]]]]; [congruence|].
  exfalso. apply (N i I). exact (f_equal fst A).
Qed.
Lemma filter_longer : forall X (f g : X -> bool) l, (forall x, f x = true -> g x = true) ->
  length (filter f l) <= length (filter g l) /\
  ((exists x, In x l /\ f x = false /\ g x = true) -> length (filter f l) < length (filter g l)).
Proof.
  intros X f g l H. induction l as [|x l [A B]]; [split; [simpl; lia|intros [x [[] _]]]|]. cbn [filter].
  destruct (f x) eqn:E.
  - rewrite (H _ E). cbn [length]. split; [lia|]. intros [y [[->|I] [Y Z]]]; [congruence|].
    assert (length (filter f l) < length (filter g l)) by (apply B; exists y; auto). lia.
  - split; [destruct (g x); cbn [length]; lia|]. intros [y [[->|I] [Y Z]]].
    + rewrite Z. cbn [length]. lia.
    + assert (length (filter f l) < length (filter g l)) by (apply B; exists y; auto).
      destruct (g x); cbn [length]; lia.
Qed.
(* The rounds of [derived_facts] suffice for a fixpoint. *)
Theorem stratum_closed : forall instances F, all_derived instances ->
  new_atoms P (W (evaluate_stratum P (S (length instances)) instances w F)) instances = [].
Proof.
  intros instances F D.
  set (count := fun F : atom_map unit => length (filter (fun i : atom * formula => mem F (fst i)) instances)).
  assert (G : forall n F, length instances < n + count F ->
    new_atoms P (W (evaluate_stratum P n instances w F)) instances = []).
  { induction n; intros F0 L.
    - exfalso. unfold count in L. pose proof (filter_shorter _ (fun i : atom * formula => mem F0 (fst i)) instances).
      lia.
    - cbn [evaluate_stratum]. destruct (new_atoms P (W F0) instances) as [|c new] eqn:E; [exact E|]. rewrite <- E.
      apply IHn. set (F1 := fold_left (fun m a => add_atom a tt m) (new_atoms P (W F0) instances) F0).
      assert (count F0 < count F1); [|lia]. apply filter_longer.
      + intros i M. unfold F1. rewrite mem_fold, M. apply orb_true_r.
      + destruct (new_atoms_in (W F0) instances c) as [i [I [A [_ N]]]]; [rewrite E; left; reflexivity|].
        exists i. split; [exact I|]. cbn [with_facts holds_in] in N. rewrite <- A, (D _ I) in N. split; [exact N|].
        unfold F1. rewrite mem_fold. apply orb_true_iff. left. apply in_atoms. rewrite E, A. left. reflexivity. }
  apply G. lia.
Qed.

(* All strata *)
Lemma tuples_spec : forall types env, In env (tuples P types) <->
  Nat.eqb (length env) (length types) &&
  forallb (fun x => existsb (Pos.eqb (fst x)) (objects P (snd x))) (combine env types) = true.
Proof.
  induction types as [|t types IH]; intro env; destruct env as [|o env]; cbn [tuples length combine forallb Nat.eqb andb].
  - split; [reflexivity|intro; left; reflexivity].
  - split; [intros [|[]]; discriminate|discriminate].
  - split; [|discriminate]. intro I. apply in_flat_map in I. destruct I as [o [_ I]]. apply in_map_iff in I.
    destruct I as [e [Eq _]]. discriminate.
  - rewrite in_flat_map. cbn [fst snd]. split.
    + intros [x [I J]]. apply in_map_iff in J. destruct J as [e [Eq J]]. injection Eq as <- <-.
      apply IH in J. apply andb_true_iff in J. destruct J as [J1 J2]. rewrite J1, J2, andb_true_r. cbn [andb].
      apply existsb_exists. exists x. split; [exact I|apply Pos.eqb_refl].
    + intro H. rewrite !andb_true_iff in H. destruct H as [H1 [H2 H3]]. apply existsb_exists in H2.
      destruct H2 as [x [I E]]. apply Pos.eqb_eq in E. subst x. exists o. split; [exact I|]. apply in_map, IH.
      rewrite H1, H3. reflexivity.
Qed.
Lemma instance_spec : forall rules i, In i (rule_instances P rules) <->
  exists r, In r rules /\ fst (fst i) = head r /\ snd i = body r /\ In (snd (fst i)) (tuples P (head_types r)).
Proof.
  intros rules i. unfold rule_instances. rewrite in_flat_map. split; intros [r [I J]]; exists r.
  - apply in_map_iff in J. destruct J as [env [<- J]]. auto.
  - split; [exact I|]. destruct J as [A [B C]]. destruct i as [[p env] f]. cbn [fst snd] in *. subst.
    apply in_map_iff. exists env. auto.
Qed.
Notation all_rounds := (fold_left (fun facts rules => let instances := rule_instances P rules in
  evaluate_stratum P (S (length instances)) instances w facts)).
Lemma rounds_grow : forall ls F a, mem F a = true -> mem (all_rounds ls F) a = true.
Proof.
  induction ls as [|rules ls IH]; intros F a H; [exact H|]. cbn [fold_left]. apply IH, stratum_grows, H.
Qed.
Lemma not_head : forall rules p, is_head p rules = false -> forall i, In i (rule_instances P rules) -> fst (fst i) <> p.
Proof.
  intros rules p H i I. apply instance_spec in I. destruct I as [r [I [A _]]]. intro E.
  unfold is_head in H. assert (X : existsb (fun r => Pos.eqb p (head r)) rules = true); [|congruence].
  apply existsb_exists. exists r. split; [exact I|]. apply Pos.eqb_eq. congruence.
Qed.
Lemma rounds_other : forall ls F a, existsb (is_head (fst a)) ls = false -> mem (all_rounds ls F) a = mem F a.
Proof.
  induction ls as [|rules ls IH]; intros F a H; [reflexivity|]. cbn [existsb] in H. apply orb_false_iff in H.
  destruct H as [H1 H2]. cbn [fold_left]. rewrite IH by exact H2. apply stratum_other, not_head, H1.
Qed.
(* Every atom of a partial evaluation has a rule whose body holds in it. *)
Definition has_rule (V : world) (a : atom) : Prop :=
  exists r, In r (concat (strata P)) /\ is_rule_of P a r = true /\ truth P V None (snd a) (body r) = Some true.
Definition is_settled (ls : list (list rule)) (p : key) (b : bool) : bool := b || negb (existsb (is_head p) ls).
Definition justified (ls : list (list rule)) (F : atom_map unit) : Prop := forall a, mem F a = true ->
  exists r, In r (concat (strata P)) /\ is_rule_of P a r = true /\ truth P (W F) None (snd a) (body r) = Some true /\
    occurrences_ok (is_settled ls) true (body r) = true.
Lemma occurrences_weaken : forall (A B : key -> bool -> bool), (forall p b, A p b = true -> B p b = true) ->
  forall f b, occurrences_ok A b f = true -> occurrences_ok B b f = true.
Proof.
  intros A B H. induction f; intros v O; cbn [occurrences_ok] in *; auto.
  apply andb_true_iff in O. destruct O as [O1 O2]. rewrite (IHf1 _ O1), (IHf2 _ O2). reflexivity.
Qed.
Lemma instance_rule : forall rules i, In rules (strata P) -> In i (rule_instances P rules) ->
  exists r, In r rules /\ In r (concat (strata P)) /\ is_rule_of P (fst i) r = true /\ snd i = body r.
Proof.
  intros rules i I J. apply instance_spec in J. destruct J as [r [J [A [B C]]]]. exists r. split; [exact J|].
  split; [apply in_concat; exists rules; auto|]. split; [|exact B].
  unfold is_rule_of. apply tuples_spec in C. rewrite <- andb_assoc, C, A, Pos.eqb_refl. reflexivity.
Qed.
(* The rules of the strata [before] have no consequence that is missing. *)
Definition closed_under (before : list (list rule)) (F : atom_map unit) : Prop := forall r env, In r (concat before) ->
  In env (tuples P (head_types r)) -> truth P (W F) None env (body r) = Some true -> mem F (head r, env) = true.
Lemma earlier_bodies : forall before ls, is_stratified (before ++ ls) = true -> forall r, In r (concat before) ->
  occurrences_ok (fun p _ => negb (existsb (is_head p) ls)) true (body r) = true.
Proof.
  induction before as [|rules before IH]; intros ls S r I; [destruct I|]. cbn [app is_stratified concat] in *.
  apply andb_true_iff in S. destruct S as [S1 S2]. apply in_app_or in I. destruct I as [I|I]; [|apply IH; assumption].
  rewrite forallb_forall in S1. eapply occurrences_weaken; [|exact (S1 _ I)]. intros p b A. unfold is_allowed in A.
  rewrite existsb_app in A. destruct (existsb (is_head p) before), (existsb (is_head p) ls); simpl in *; auto.
Qed.
Lemma derived_invariant : is_stratified (strata P) = true -> forall Q : atom -> Prop,
  (forall before rules later F0 F i, strata P = before ++ rules :: later ->
     (forall a, mem F0 a = true -> Q a) -> (forall a, mem F0 a = true -> has_rule (W F0) a) -> closed_under before F0 ->
     (forall a, existsb (is_head (fst a)) (rules :: later) = false -> mem F a = mem F0 a) ->
     (forall a, mem F a = true -> Q a) -> (forall a, mem F a = true -> has_rule (W F) a) ->
     In i (rule_instances P rules) -> fires_in P (W F) i = true -> Q (fst i)) ->
  forall a, mem (derived_facts P w) a = true -> Q a.
Proof.
  intros Str Q H. unfold derived_facts.
  assert (Just : forall ls F, justified ls F -> forall a, mem F a = true -> has_rule (W F) a)
    by (intros ls F J a M; destruct (J a M) as [r X]; exists r; tauto).
  assert (Stratum : forall before rules later F0, strata P = before ++ rules :: later ->
    is_stratified (rules :: later) = true -> closed_under before F0 -> (forall a, mem F0 a = true -> Q a) ->
    justified (rules :: later) F0 -> forall n F,
    (forall a, existsb (is_head (fst a)) (rules :: later) = false -> mem F a = mem F0 a) ->
    (forall a, mem F a = true -> Q a) -> justified (rules :: later) F ->
    let F' := evaluate_stratum P n (rule_instances P rules) w F in
    (forall a, mem F' a = true -> Q a) /\ justified (rules :: later) F').
  { intros before rules later F0 R St Cl I0 J0.
    assert (R' : In rules (strata P)) by (rewrite R; apply in_elt).
    induction n; intros F Same I J; [split; assumption|]. cbn [evaluate_stratum].
    destruct (new_atoms P (W F) (rule_instances P rules)) as [|c new] eqn:E; [split; assumption|]. rewrite <- E.
    set (F1 := fold_left (fun m a => add_atom a tt m) (new_atoms P (W F) (rule_instances P rules)) F).
    assert (Other : forall b, is_head (fst b) rules = false -> mem F1 b = mem F b).
    { intros b Hd. unfold F1. rewrite mem_fold.
      destruct (existsb (atom_eqb b) (new_atoms P (W F) (rule_instances P rules))) eqn:X; [|reflexivity].
      exfalso. apply in_atoms, new_atoms_in in X. destruct X as [i [Ii [A _]]].
      apply (not_head _ _ Hd _ Ii). exact (f_equal fst A). }
    assert (Keep : forall f env, occurrences_ok (is_settled (rules :: later)) true f = true ->
      truth P (W F) None env f = Some true -> truth P (W F1) None env f = Some true).
    { intros f env O Tr. apply (truth_kept P (is_settled (rules :: later)) (W F)); [| |reflexivity|exact O|exact Tr];
        intros b Al; cbn [with_facts holds_in]; destruct (is_derived P (fst b)); auto.
      - change (mem F b = true -> mem F1 b = true). intro M. unfold F1. rewrite mem_fold, M. apply orb_true_r.
      - change (mem F b = false -> mem F1 b = false). intro M. rewrite Other; [exact M|].
        cbn [is_settled orb existsb] in Al. apply negb_true_iff, orb_false_iff in Al. apply Al. }
    apply IHn.
    - intros a N. rewrite Other; [apply Same, N|]. cbn [existsb] in N. apply orb_false_iff in N. apply N.
    - intros a M. unfold F1 in M. rewrite mem_fold in M. apply orb_true_iff in M.
      destruct M as [M|M]; [|apply I, M]. apply in_atoms, new_atoms_in in M. destruct M as [i [Ii [<- [Fi _]]]].
      apply (H before rules later F0 F i); auto; eapply Just; eassumption.
    - intros a M. unfold F1 in M. rewrite mem_fold in M. apply orb_true_iff in M. destruct M as [M|M].
      + apply in_atoms, new_atoms_in in M. destruct M as [i [Ii [<- [Fi _]]]].
        destruct (instance_rule _ _ R' Ii) as [r [Ir [Ic [Ru B]]]]. exists r. split; [exact Ic|]. split; [exact Ru|].
        cbn [is_stratified] in St. apply andb_true_iff in St. destruct St as [St _].
        rewrite forallb_forall in St. specialize (St _ Ir).
        assert (O : occurrences_ok (is_settled (rules :: later)) true (body r) = true).
        { eapply occurrences_weaken; [|exact St]. intros p b. unfold is_allowed, is_settled. cbn [existsb].
          destruct b, (is_head p rules), (existsb (is_head p) later); simpl; auto. }
        split; [|exact O]. apply Keep; [exact O|]. unfold fires_in in Fi. rewrite B in Fi.
        destruct (truth P (W F) None (snd (fst i)) (body r)) as [[]|]; [reflexivity|discriminate|discriminate].
      + destruct (J a M) as [r [Ic [Ru [Tr O]]]]. exists r. auto. }
  assert (G : forall ls before, strata P = before ++ ls -> is_stratified ls = true -> forall F, closed_under before F ->
    (forall a, mem F a = true -> Q a) -> justified ls F -> forall a, mem (all_rounds ls F) a = true -> Q a).
  { induction ls as [|rules ls IH]; intros before R St F Cl I J; [exact I|]. cbn [fold_left].
    set (instances := rule_instances P rules).
    destruct (Stratum before rules ls F R St Cl I J (S (length instances)) F (fun a _ => eq_refl) I J) as [I1 J1].
    fold instances in I1, J1. set (F1 := evaluate_stratum P (S (length instances)) instances w F) in *.
    assert (D : all_derived instances).
    { intros i X. apply instance_spec in X. destruct X as [q [X [Y _]]]. rewrite Y. unfold is_derived.
      apply existsb_exists. exists rules. split; [rewrite R; apply in_elt|]. apply existsb_exists. exists q.
      split; [exact X|apply Pos.eqb_refl]. }
    apply (IH (before ++ [rules])); [rewrite R, <- app_assoc; reflexivity| | |exact I1|].
    - cbn [is_stratified] in St. apply andb_true_iff in St. apply St.
    - intros r env Ir Et Tr. rewrite concat_app in Ir. cbn [concat] in Ir. rewrite app_nil_r in Ir.
      apply in_app_or in Ir. destruct Ir as [Ir|Ir].
      + apply stratum_grows. apply (Cl r env Ir Et).
        rewrite R in Str. pose proof (earlier_bodies _ _ Str r Ir) as O.
        apply (truth_kept P (fun p _ => negb (existsb (is_head p) (rules :: ls))) (W F1)); [| |reflexivity|exact O|exact Tr];
          intros b Al; cbn [with_facts holds_in]; destruct (is_derived P (fst b)); auto;
          apply negb_true_iff in Al; cbn [existsb] in Al; apply orb_false_iff in Al; destruct Al as [Al _].
        * change (mem F1 b = true -> mem F b = true). unfold F1. rewrite stratum_other by (apply not_head, Al). auto.
        * change (mem F1 b = false -> mem F b = false). unfold F1. rewrite stratum_other by (apply not_head, Al). auto.
      + pose proof (stratum_closed instances F D) as C. fold F1 in C.
        assert (X : In ((head r, env), body r) instances) by (apply instance_spec; exists r; auto).
        destruct (mem F1 (head r, env)) eqn:M; [reflexivity|]. exfalso.
        assert (Y : In (head r, env) (new_atoms P (W F1) instances)).
        { unfold new_atoms. apply in_map_iff. exists ((head r, env), body r). split; [reflexivity|]. apply filter_In.
          split; [exact X|]. pose proof (D _ X) as DX. cbn [fst snd] in DX. unfold fires_in.
          cbn [fst snd with_facts holds_in]. rewrite DX.
          change (negb (mem F1 (head r, env)) && match truth P (W F1) None env (body r) with Some b => b | None => false end = true).
          rewrite M, Tr. reflexivity. }
        rewrite C in Y. destruct Y.
    - intros a M. destruct (J1 a M) as [r [Ic [Ru [Tr O]]]]. exists r. split; [exact Ic|]. split; [exact Ru|].
      split; [exact Tr|]. eapply occurrences_weaken; [|exact O]. intros p b. unfold is_settled. cbn [existsb].
      destruct b, (is_head p rules), (existsb (is_head p) ls); simpl; auto. }
  apply (G (strata P) []); [reflexivity|exact Str|intros r env []| |]; intros a M; rewrite mem_empty in M; discriminate.
Qed.
Lemma rounds_origin : forall ls, is_stratified ls = true -> forall F a, mem (all_rounds ls F) a = true ->
  mem F a = true \/ exists r, In r (concat ls) /\ fst a = head r /\ In (snd a) (tuples P (head_types r)) /\
    truth P (W (all_rounds ls F)) None (snd a) (body r) = Some true.
Proof.
  induction ls as [|rules ls IH]; intros S F a H; [left; exact H|]. cbn [is_stratified] in S.
  apply andb_true_iff in S. destruct S as [S1 S2]. cbn [fold_left concat] in *.
  set (F1 := evaluate_stratum P _ _ w F) in *.
  destruct (IH S2 F1 a H) as [M|[r [I X]]].
  2: { right. exists r. split; [apply in_or_app; right; exact I|exact X]. }
  unfold F1 in M. apply stratum_origin in M. destruct M as [M|[i [F' [I [A [Fi [L U]]]]]]]; [left; exact M|right].
  fold F1 in U. apply instance_spec in I. destruct I as [r [I [B [C D]]]]. subst a. exists r.
  split; [apply in_or_app; left; exact I|]. split; [exact B|]. split; [exact D|].
  rewrite forallb_forall in S1. specialize (S1 _ I). unfold fires_in in Fi. rewrite C in Fi.
  destruct (truth P (W F') None (snd (fst i)) (body r)) as [[]|] eqn:E; try discriminate.
  apply (truth_kept P (is_allowed rules ls) (W F')); [| |reflexivity|exact S1|exact E].
  - intros b _. cbn [with_facts holds_in]. destruct (is_derived P (fst b)); [|auto]. intro M.
    apply rounds_grow, U, M.
  - intros b Al. cbn [with_facts holds_in]. destruct (is_derived P (fst b)); [|auto]. intro M.
    unfold is_allowed in Al. apply andb_true_iff in Al. destruct Al as [Al1 Al2].
    apply negb_true_iff in Al1. apply negb_true_iff in Al2. cbn [orb] in Al2.
    change (mem (all_rounds ls F1) b = false). change (mem F' b = false) in M.
    rewrite rounds_other by exact Al1. unfold F1.
    rewrite stratum_other by (apply not_head; exact Al2). destruct (mem F b) eqn:Fb; [|reflexivity].
    apply L in Fb. congruence.
Qed.
Lemma head_derived : forall rules r, In rules (strata P) -> In r rules -> is_derived P (head r) = true.
Proof.
  intros rules r I J. unfold is_derived. apply existsb_exists. exists rules. split; [exact I|].
  apply existsb_exists. exists r. split; [exact J|apply Pos.eqb_refl].
Qed.
Lemma rounds_closed : forall ls, incl ls (strata P) -> is_stratified ls = true -> forall F r env, In r (concat ls) ->
  In env (tuples P (head_types r)) -> truth P (W (all_rounds ls F)) None env (body r) = Some true ->
  mem (all_rounds ls F) (head r, env) = true.
Proof.
  induction ls as [|rules ls IH]; intros Sub S F r env I E H; [destruct I|]. cbn [is_stratified] in S.
  apply andb_true_iff in S. destruct S as [S1 S2]. cbn [fold_left concat] in *. apply in_app_or in I.
  destruct I as [I|I].
  2: { apply IH; auto. intros x X. apply Sub. right. exact X. }
  set (instances := rule_instances P rules) in *.
  set (F1 := evaluate_stratum P (S (length instances)) instances w F) in *.
  assert (D : all_derived instances).
  { intros i J. apply instance_spec in J. destruct J as [q [J [Q _]]]. rewrite Q.
    apply (head_derived rules); [apply Sub; left; reflexivity|exact J]. }
  pose proof (stratum_closed instances F D) as C. fold F1 in C. apply rounds_grow.
  assert (T : truth P (W F1) None env (body r) = Some true).
  { rewrite forallb_forall in S1. specialize (S1 _ I).
    apply (truth_kept P (is_allowed rules ls) (W (all_rounds ls F1))); [| |reflexivity|exact S1|exact H];
      intros b Al; cbn [with_facts holds_in]; destruct (is_derived P (fst b)); auto;
      unfold is_allowed in Al; apply andb_true_iff in Al; destruct Al as [Al _]; apply negb_true_iff in Al.
    - change (mem (all_rounds ls F1) b = true -> mem F1 b = true). rewrite rounds_other by exact Al. auto.
    - change (mem (all_rounds ls F1) b = false -> mem F1 b = false). rewrite rounds_other by exact Al. auto. }
  assert (J : In ((head r, env), body r) instances) by (apply instance_spec; exists r; auto).
  destruct (mem F1 (head r, env)) eqn:M; [reflexivity|]. exfalso.
  assert (X : In (head r, env) (new_atoms P (W F1) instances)).
  { unfold new_atoms. apply in_map_iff. exists ((head r, env), body r). split; [reflexivity|]. apply filter_In.
    split; [exact J|]. pose proof (D _ J) as DJ. cbn [fst snd] in DJ. unfold fires_in.
    cbn [fst snd with_facts holds_in]. rewrite DJ.
    change (negb (mem F1 (head r, env)) && match truth P (W F1) None env (body r) with Some b => b | None => false end = true).
    rewrite M, T. reflexivity. }
  rewrite C in X. destruct X.
Qed.
Hypothesis stratified : is_stratified (strata P) = true.
Notation dw := (derived_world P w).
Lemma rule_origin : forall a, is_derived P (fst a) = true -> holds_in dw a = true ->
  has_rule dw a.
Proof.
  intros a D H. cbn [derived_world with_facts holds_in] in H. rewrite D in H.
  destruct (rounds_origin _ stratified _ _ H) as [M|[r [I [A [B C]]]]]; [rewrite mem_empty in M; discriminate|].
  exists r. split; [exact I|]. split; [|exact C]. unfold is_rule_of. apply tuples_spec in B.
  rewrite <- andb_assoc, B, A, Pos.eqb_refl. reflexivity.
Qed.
Lemma rule_closed : forall a r, In r (concat (strata P)) -> is_rule_of P a r = true ->
  truth P dw None (snd a) (body r) = Some true -> holds_in dw a = true.
Proof.
  intros [p env] r I A H. unfold is_rule_of in A. rewrite <- andb_assoc in A. apply andb_true_iff in A.
  destruct A as [A B]. apply Pos.eqb_eq in A. cbn [fst snd] in *. subst p. apply tuples_spec in B.
  assert (D : is_derived P (head r) = true).
  { apply in_concat in I. destruct I as [rules [R I]]. eapply head_derived; eassumption. }
  cbn [derived_world with_facts holds_in fst]. rewrite D.
  exact (rounds_closed _ (fun x X => X) stratified _ _ _ I B H).
Qed.
End Strata.
