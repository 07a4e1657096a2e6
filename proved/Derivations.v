(* Checks the derivations of a knowledge base: each fact is stated or follows from earlier facts by a rule, and no rule
   has a conclusion that is missing. Theorem [knowledge]: then exactly the claimed facts hold.

   Not covered, and therefore not accepted: individuals with several names; rules of which an argument does not
   occur in a positive premise, if the positive premises have a match; rules that are not stratified, or equality that
   depends on negation. *)
From Coq Require Import ZArith QArith List Bool FMapPositive Lia.
From Proved Require Import Task Lifted Datalog.
Import ListNotations.
Open Scope nat_scope.

(* Facts by predicate *)
Definition arguments_eqb (l m : list symbol) : bool := if list_eq_dec symbol_eq_dec l m then true else false.
Definition data_eqb (f g : data) : bool := Pos.eqb (fst f) (fst g) && arguments_eqb (snd f) (snd g).
Definition index := M.t (list (list symbol)).
Definition rows (I : index) (p : key) : list (list symbol) := match M.find p I with Some l => l | None => [] end.
Definition insert (I : index) (f : data) : index := M.add (fst f) (snd f :: rows I (fst f)) I.
Definition index_of (facts : list data) : index := fold_left insert facts (M.empty _).
Definition contains (I : index) (f : data) : bool := existsb (arguments_eqb (snd f)) (rows I (fst f)).

(* Partial assignments of the variables of a rule *)
Definition bindings := list (key * symbol).
Fixpoint lookup (e : bindings) (x : key) : option symbol :=
  match e with [] => None | (y, s) :: e => if Pos.eqb x y then Some s else lookup e x end.
Definition known (e : bindings) (t : argument) : option symbol :=
  match t with RuleVariable x => lookup e x | Symbol s => Some s end.
Fixpoint all_known (e : bindings) (ts : list argument) : option (list symbol) :=
  match ts with
  | [] => Some []
  | t :: ts => match known e t, all_known e ts with Some s, Some l => Some (s :: l) | _, _ => None end
  end.
Definition ground_pattern (e : bindings) (a : pattern) : option data :=
  match all_known e (snd a) with Some l => Some (fst a, l) | None => None end.
Fixpoint unify (e : bindings) (ts : list argument) (l : list symbol) : option bindings :=
  match ts, l with
  | [], [] => Some e
  | t :: ts, s :: l =>
      match known e t, t with
      | Some s', _ => if symbol_eqb s' s then unify e ts l else None
      | None, RuleVariable x => unify ((x, s) :: e) ts l
      | None, Symbol _ => None
      end
  | _, _ => None
  end.
Fixpoint matches (I : index) (e : bindings) (patterns : list pattern) : list bindings :=
  match patterns with
  | [] => [e]
  | a :: patterns => flat_map (fun l => match unify e (snd a) l with
                                        | Some e => matches I e patterns | None => [] end) (rows I (fst a))
  end.
Definition positive_part (body : list conjunct) : list pattern :=
  flat_map (fun c => match c with Present a => [a] | _ => [] end) body.

(* Premises and conclusions. [None] is undecided. *)
Definition variables_of (a : pattern) : list key :=
  flat_map (fun t => match t with RuleVariable x => [x] | Symbol _ => [] end) (snd a).
Definition member (x : key) (l : list key) : bool := existsb (Pos.eqb x) l.
Fixpoint distinct (l : list key) : bool := match l with [] => true | x :: l => negb (member x l) && distinct l end.
Definition bound (e : bindings) (x : key) : bool := match lookup e x with Some _ => true | None => false end.
Fixpoint all_some {X} (l : list (option X)) : option (list X) :=
  match l with
  | [] => Some []
  | o :: l => match o, all_some l with Some x, Some l => Some (x :: l) | _, _ => None end
  end.
Definition comparison_decided (test : built_in) (a b : symbol) : bool :=
  match test with Different => symbol_eqb a b || negb (is_name a && is_name b) | _ => true end.
Definition count_decided (e : bindings) (local : list key) (inner : list pattern) : bool :=
  distinct local && forallb (fun x => negb (bound e x)) local &&
  forallb (fun a => forallb (fun x => member x local || bound e x) (variables_of a)) inner.
Definition decide (I : index) (e : bindings) (c : conjunct) : option bool :=
  match c with
  | Present _ => Some true
  | Absent a => option_map (fun f => negb (contains I f)) (ground_pattern e a)
  | Test test x y =>
      match known e x, known e y with
      | Some a, Some b => if comparison_decided test a b then Some (satisfies test a b) else None
      | _, _ => None
      end
  | Count n local inner =>
      if count_decided e local inner then
        option_map (fun values => Nat.eqb (length (nodup (list_eq_dec symbol_eq_dec) values)) n)
          (all_some (map (fun e => all_known e (map RuleVariable local)) (matches I e inner)))
      else None
  end.
Fixpoint decide_all (I : index) (e : bindings) (body : list conjunct) : option bool :=
  match body with
  | [] => Some true
  | c :: body => match decide I e c with
                 | Some true => decide_all I e body | Some false => Some false | None => None end
  end.
Definition concluded (I : index) (e : bindings) (c : conclusion) : bool :=
  match c with
  | Concludes a => match ground_pattern e a with Some f => contains I f | None => false end
  | Equates x y => match known e x, known e y with Some a, Some b => symbol_eqb a b | _, _ => false end
  end.

(* No rule has a conclusion that is missing, and no constraint is violated. *)
Definition complete_for (I : index) (r : implication) : bool :=
  forallb (fun e => match decide_all I e (premises r) with
                    | Some true => match conclusions r with [] => false | cs => forallb (concluded I e) cs end
                    | Some false => true
                    | None => false
                    end) (matches I [] (positive_part (premises r))).

(* A derivation: facts, each with the numbers of the earlier facts that match the positive premises of a rule, or stated. *)
Inductive reason := Stated | Derived (supports : list key).
Fixpoint unify_all (e : bindings) (patterns : list pattern) (facts : list data) : option bindings :=
  match patterns, facts with
  | [], [] => Some e
  | a :: patterns, f :: facts =>
      if Pos.eqb (fst a) (fst f) then
        match unify e (snd a) (snd f) with Some e => unify_all e patterns facts | None => None end
      else None
  | _, _ => None
  end.
Definition concludes (e : bindings) (f : data) (c : conclusion) : bool :=
  match c with
  | Concludes a => match ground_pattern e a with Some g => data_eqb f g | None => false end
  | Equates _ _ => false
  end.
Definition follows_by (I : index) (r : implication) (supports : list data) (f : data) : bool :=
  match unify_all [] (positive_part (premises r)) supports with
  | Some e => existsb (concludes e f) (conclusions r) &&
              match decide_all I e (premises r) with Some true => true | _ => false end
  | None => false
  end.
Section Check.
Variables (K : knowledge_base) (level : key -> nat).
Fixpoint founded (I stated_facts : index) (earlier : M.t data) (next : key) (steps : list (data * reason)) : bool :=
  match steps with
  | [] => true
  | (f, reason) :: steps =>
      match reason with
      | Stated => contains stated_facts f
      | Derived supports =>
          match all_some (map (fun i => M.find i earlier) supports) with
          | Some supports => existsb (fun r => follows_by I r supports f) (implications K)
          | None => false
          end
      end && founded I stated_facts (M.add next f earlier) (Pos.succ next) steps
  end.

(* Stratification: conclusions are not below positive premises, and above negated and counted ones. *)
Definition conclusion_level (c : conclusion) : nat :=
  match c with Concludes a => level (fst a) | Equates _ _ => level (same_as K) end.
Definition above (n : nat) (c : conjunct) : bool :=
  match c with
  | Present a => Nat.leb (level (fst a)) n
  | Absent a => Nat.ltb (level (fst a)) n
  | Test _ _ _ => true
  | Count _ _ inner => forallb (fun a : pattern => Nat.ltb (level (fst a)) n) inner
  end.
Definition stratified : bool :=
  Nat.eqb (level (same_as K)) 0 &&
  forallb (fun r => forallb (fun c => forallb (above (conclusion_level c)) (premises r)) (conclusions r)) (implications K).

Definition check_derivations (steps : list (data * reason)) : bool :=
  let I := index_of (map fst steps) in
  stratified && forallb (fun step => negb (Pos.eqb (fst (fst step)) (same_as K))) steps &&
  forallb (contains I) (stated K) &&
  founded I (index_of (stated K)) (M.empty _) 1%positive steps &&
  forallb (complete_for I) (implications K).
End Check.

(* The proof *)
Ltac parts := repeat match goal with |- _ /\ _ => split end.
Lemma symbol_eqb_eq : forall a b, symbol_eqb a b = true <-> a = b.
Proof. intros a b. unfold symbol_eqb. destruct (symbol_eq_dec a b); split; congruence. Qed.
Lemma arguments_eqb_eq : forall l m, arguments_eqb l m = true <-> l = m.
Proof. intros l m. unfold arguments_eqb. destruct (list_eq_dec symbol_eq_dec l m); split; congruence. Qed.
Lemma rows_insert : forall I f p, rows (insert I f) p = if Pos.eqb p (fst f) then snd f :: rows I p else rows I p.
Proof.
  intros I f p. unfold insert, rows at 1. destruct (Pos.eqb_spec p (fst f)) as [->|N].
  - rewrite PositiveMap.gss. reflexivity.
  - rewrite PositiveMap.gso by exact N. reflexivity.
Qed.
Lemma rows_in : forall facts I p l, In l (rows (fold_left insert facts I) p) <-> In (p, l) facts \/ In l (rows I p).
Proof.
  induction facts as [|f facts IH]; intros I p l; [cbn; tauto|]. cbn [fold_left]. rewrite IH, rows_insert.
  destruct f as [q m]. cbn [fst snd In]. destruct (Pos.eqb_spec p q) as [->|N]; cbn [In].
  - split; [intros [H|[->|H]]; auto|intros [[H|H]|H]; auto]. injection H as ->. auto.
  - split; [intros [H|H]; auto|intros [[H|H]|H]; auto]. injection H as -> ->. congruence.
Qed.
Lemma rows_index : forall facts p l, In l (rows (index_of facts) p) <-> In (p, l) facts.
Proof.
  intros facts p l. unfold index_of. rewrite rows_in. unfold rows. rewrite PositiveMap.gempty. cbn. tauto.
Qed.
Lemma contains_in : forall facts f, contains (index_of facts) f = true <-> In f facts.
Proof.
  intros facts [p l]. unfold contains. cbn [fst snd]. rewrite existsb_exists, <- rows_index. split.
  - intros [m [J E]]. apply arguments_eqb_eq in E. subst m. exact J.
  - intro J. exists l. split; [exact J|apply arguments_eqb_eq; reflexivity].
Qed.

(* A valuation agrees with bindings. *)
Definition agrees (v : valuation) (e : bindings) : Prop := forall x s, lookup e x = Some s -> v x = s.
Definition extends (e e' : bindings) : Prop := forall x s, lookup e x = Some s -> lookup e' x = Some s.
Lemma known_value : forall v e t s, agrees v e -> known e t = Some s -> value_of v t = s.
Proof. intros v e [x|c] s A H; cbn in *; [apply A, H|congruence]. Qed.
Lemma all_known_values : forall v e ts l, agrees v e -> all_known e ts = Some l -> map (value_of v) ts = l.
Proof.
  intros v e ts. induction ts as [|t ts IH]; intros l A H; cbn [all_known map] in *; [congruence|].
  destruct (known e t) as [s|] eqn:E; [|discriminate]. destruct (all_known e ts) as [l'|]; [|discriminate].
  injection H as <-. f_equal; [eapply known_value; eassumption|apply IH; auto].
Qed.
Lemma ground_instance : forall v e a f, agrees v e -> ground_pattern e a = Some f -> instance v a = f.
Proof.
  intros v e a f A H. unfold ground_pattern in H. destruct (all_known e (snd a)) as [l|] eqn:E; [|discriminate].
  injection H as <-. unfold instance. f_equal. eapply all_known_values; eassumption.
Qed.
(* Unification is complete and sound, and binds the variables of the pattern only. *)
Lemma unify_complete : forall v ts e, agrees v e ->
  exists e', unify e ts (map (value_of v) ts) = Some e' /\ agrees v e'.
Proof.
  intros v ts. induction ts as [|t ts IH]; intros e A; cbn [map unify]; [exists e; auto|].
  destruct (known e t) as [s|] eqn:E.
  - rewrite (known_value v e t s A E), (proj2 (symbol_eqb_eq s s) eq_refl). apply IH, A.
  - destruct t as [x|c]; [|discriminate]. apply IH. intros y s H. cbn [lookup] in H.
    destruct (Pos.eqb_spec y x) as [->|N]; [injection H as <-; reflexivity|apply A, H].
Qed.
Lemma unify_sound : forall ts l e e', unify e ts l = Some e' ->
  extends e e' /\ (forall v, agrees v e' -> map (value_of v) ts = l) /\
  (forall x s, lookup e' x = Some s -> lookup e x = Some s \/ In (RuleVariable x) ts) /\
  (forall x, In (RuleVariable x) ts -> bound e' x = true).
Proof.
  induction ts as [|t ts IH]; intros [|s l] e e' H; cbn [unify] in H; try discriminate.
  - injection H as <-. parts; [intros x s; auto|reflexivity|intros x s; auto|intros x []].
  - assert (G : exists e1, extends e e1 /\ known e1 t = Some s /\ unify e1 ts l = Some e' /\
      forall x c, lookup e1 x = Some c -> lookup e x = Some c \/ t = RuleVariable x).
    { destruct (known e t) as [c|] eqn:E.
      - destruct (symbol_eqb c s) eqn:Q; [|discriminate]. apply symbol_eqb_eq in Q. subst c. exists e.
        parts; [intros x c; auto|exact E|exact H|intros x c; auto].
      - destruct t as [x|c]; [|discriminate]. exists ((x, s) :: e). parts; [| |exact H|].
        + intros y c L. cbn [lookup]. destruct (Pos.eqb_spec y x) as [->|N]; [cbn in E; congruence|exact L].
        + cbn. rewrite Pos.eqb_refl. reflexivity.
        + intros y c L. cbn [lookup] in L. destruct (Pos.eqb_spec y x) as [->|N]; [right; reflexivity|left; exact L]. }
    destruct G as [e1 [X1 [N1 [U1 B1]]]]. destruct (IH _ _ _ U1) as [X [V [B C]]].
    assert (N : known e' t = Some s) by (destruct t as [x|c]; cbn in *; auto). parts.
    + intros x c L. apply X, X1, L.
    + intros v A. cbn [map]. f_equal; [eapply known_value; eassumption|apply V, A].
    + intros x c L. destruct (B _ _ L) as [M|M]; [|right; right; exact M].
      destruct (B1 _ _ M) as [M1|M1]; [left; exact M1|right; left; exact M1].
    + intros x [E|J]; [|apply C, J]. subst t. cbn in N. unfold bound. rewrite N. reflexivity.
Qed.
Lemma matches_complete : forall facts v patterns e, agrees v e ->
  (forall a, In a patterns -> In (instance v a) facts) ->
  exists e', In e' (matches (index_of facts) e patterns) /\ agrees v e'.
Proof.
  intros facts v patterns. induction patterns as [|a patterns IH]; intros e A H; cbn [matches].
  - exists e. split; [left; reflexivity|exact A].
  - destruct (unify_complete v (snd a) e A) as [e1 [U A1]].
    destruct (IH e1 A1) as [e2 [J A2]]; [intros b B; apply H; right; exact B|].
    exists e2. split; [|exact A2]. apply in_flat_map. exists (map (value_of v) (snd a)). split.
    + apply rows_index. apply (H a). left. reflexivity.
    + rewrite U. exact J.
Qed.
Definition uses (patterns : list pattern) (x : key) : Prop := exists a, In a patterns /\ In (RuleVariable x) (snd a).
Lemma matches_sound : forall facts patterns e e', In e' (matches (index_of facts) e patterns) ->
  extends e e' /\ (forall v, agrees v e' -> forall a, In a patterns -> In (instance v a) facts) /\
  (forall x s, lookup e' x = Some s -> lookup e x = Some s \/ uses patterns x).
Proof.
  intros facts patterns. induction patterns as [|a patterns IH]; intros e e' H; cbn [matches] in H.
  - destruct H as [<-|[]]. parts; [intros x s; auto|intros v _ b []|intros x s; auto].
  - apply in_flat_map in H. destruct H as [l [R H]]. destruct (unify e (snd a) l) as [e1|] eqn:U; [|destruct H].
    destruct (unify_sound _ _ _ _ U) as [X1 [V1 [B1 _]]]. destruct (IH _ _ H) as [X [V B]]. parts.
    + intros x s L. apply X, X1, L.
    + intros v A b [<-|J]; [|apply V; auto]. apply rows_index in R. unfold instance. rewrite (V1 v); [exact R|].
      intros x s L. apply A, X, L.
    + intros x s L. destruct (B _ _ L) as [L1|[b [J1 J2]]].
      * destruct (B1 _ _ L1) as [L2|L2]; [left; exact L2|right; exists a; cbn; auto].
      * right. exists b. cbn. auto.
Qed.

(* Counting *)
Lemma member_in : forall x l, member x l = true <-> In x l.
Proof.
  intros x l. unfold member. rewrite existsb_exists. split.
  - intros [y [J E]]. apply Pos.eqb_eq in E. subst. exact J.
  - intro J. exists x. split; [exact J|apply Pos.eqb_refl].
Qed.
Lemma assign_other : forall local l v x, ~ In x local -> assign local l v x = v x.
Proof.
  induction local as [|y local IH]; intros [|s l] v x N; cbn [assign]; auto.
  destruct (Pos.eqb_spec x y) as [->|D]; [cbn in N; tauto|apply IH; cbn in N; tauto].
Qed.
Lemma assign_known : forall local l v e, all_known e (map RuleVariable local) = Some l ->
  forall x s, In x local -> lookup e x = Some s -> assign local l v x = s.
Proof.
  induction local as [|y local IH]; intros l v e H x s J L; [destruct J|]. cbn [map all_known known] in H.
  destruct (lookup e y) as [t|] eqn:E; [|discriminate]. destruct (all_known e _) as [l'|] eqn:R; [|discriminate].
  injection H as <-. cbn [assign]. destruct (Pos.eqb_spec x y) as [->|N]; [congruence|].
  destruct J as [->|J]; [congruence|]. eapply IH; eassumption.
Qed.
Lemma all_known_length : forall e ts l, all_known e ts = Some l -> length l = length ts.
Proof.
  intros e ts. induction ts as [|t ts IH]; intros l H; cbn [all_known] in H; [injection H as <-; reflexivity|].
  destruct (known e t); [|discriminate]. destruct (all_known e ts); [|discriminate]. injection H as <-.
  cbn [length]. f_equal. apply IH. reflexivity.
Qed.
Lemma assign_values : forall local l v, distinct local = true -> length l = length local ->
  map (value_of (assign local l v)) (map RuleVariable local) = l.
Proof.
  induction local as [|x local IH]; intros [|s l] v D L; cbn [length] in L; try discriminate; [reflexivity|].
  cbn [distinct] in D. apply andb_true_iff in D. destruct D as [N D]. apply negb_true_iff in N. cbn [map value_of assign].
  rewrite Pos.eqb_refl. f_equal.
  etransitivity; [|apply (IH l v D); injection L as L; exact L]. rewrite !map_map. apply map_ext_in.
  intros y J. cbn [value_of]. destruct (Pos.eqb_spec y x) as [->|_]; [|reflexivity].
  apply member_in in J. congruence.
Qed.
Lemma all_some_in : forall X (l : list (option X)) l', all_some l = Some l' ->
  (forall x, In (Some x) l <-> In x l') /\ ~ In None l.
Proof.
  intros X l. induction l as [|o l IH]; intros l' H; cbn [all_some] in H; [injection H as <-; cbn; split; [tauto|auto]|].
  destruct o as [x|]; [|discriminate]. destruct (all_some l) as [m|] eqn:E; [|discriminate]. injection H as <-.
  destruct (IH _ eq_refl) as [A B]. split.
  - intro y. cbn [In]. rewrite A. split; [intros [J|J]; [left; congruence|right; exact J]|intros [->|J]; auto].
  - intros [J|J]; [discriminate|exact (B J)].
Qed.
Lemma count_correct : forall facts v e n local inner b, agrees v e ->
  decide (index_of facts) e (Count n local inner) = Some b ->
  (b = true <-> exists tuples, NoDup tuples /\ length tuples = n /\ forall l, In l tuples <->
     length l = length local /\ forall a, In a inner -> In (instance (assign local l v) a) facts).
Proof.
  intros facts v e n local inner b A H. cbn [decide] in H.
  destruct (count_decided e local inner) eqn:C; [|discriminate]. unfold count_decided in C.
  apply andb_true_iff in C. destruct C as [C V]. apply andb_true_iff in C. destruct C as [D U].
  rewrite forallb_forall in V, U.
  destruct (all_some _) as [tuples|] eqn:S; [|discriminate]. cbn [option_map] in H. injection H as <-.
  apply all_some_in in S. destruct S as [S Z].
  set (found := nodup _ tuples).
  assert (P : forall l, In l found <->
    length l = length local /\ forall a, In a inner -> In (instance (assign local l v) a) facts).
  { intro l. unfold found. rewrite nodup_In, <- S, in_map_iff. split.
    - intros [e' [E J]]. destruct (matches_sound _ _ _ _ J) as [X [Q B]].
      assert (Len := all_known_length _ _ _ E). rewrite map_length in Len. split; [exact Len|].
      apply Q. intros x s L. destruct (in_dec Pos.eq_dec x local) as [I|I]; [eapply assign_known; eassumption|].
      rewrite assign_other by exact I. destruct (B _ _ L) as [L1|[a [J1 J2]]]; [apply A, L1|].
      specialize (V a J1). rewrite forallb_forall in V.
      assert (W : member x local || bound e x = true).
      { apply V. unfold variables_of. apply in_flat_map. exists (RuleVariable x). cbn; auto. }
      apply orb_true_iff in W. destruct W as [W|W]; [apply member_in in W; contradiction|].
      unfold bound in W. destruct (lookup e x) as [t|] eqn:T; [|discriminate].
      assert (X' := X _ _ T). rewrite (A _ _ T). congruence.
    - intros [Len Q]. destruct (matches_complete facts (assign local l v) inner e) as [e' [J A']]; [|exact Q|].
      + intros x s L. rewrite assign_other; [apply A, L|]. intro I. specialize (U x I). unfold bound in U.
        rewrite L in U. discriminate.
      + exists e'. split; [|exact J].
        destruct (all_known e' (map RuleVariable local)) as [m|] eqn:E.
        * f_equal. rewrite <- (all_known_values _ _ _ _ A' E). apply assign_values; assumption.
        * exfalso. apply Z. rewrite <- E. apply (in_map (fun e => all_known e (map RuleVariable local))), J. }
  assert (N : NoDup found) by apply NoDup_nodup. split.
  - intro E. apply Nat.eqb_eq in E. exists found. auto.
  - intros [other [N' [L' Q]]]. apply Nat.eqb_eq. rewrite <- L'. apply Nat.le_antisymm; apply NoDup_incl_length; auto.
    + intros l I. apply Q, P, I.
    + intros l I. apply P, Q, I.
Qed.

(* Rules *)
Lemma decide_correct : forall facts (S : data -> Prop) v e c b, agrees v e ->
  decide (index_of facts) e c = Some b -> (forall a, c = Present a -> S (instance v a)) ->
  (b = true <-> premise_holds (fun f => In f facts) S v c).
Proof.
  intros facts S v e [a|a|test x y|n local inner] b A H P; cbn [premise_holds].
  - cbn in H. injection H as <-. split; [intros _; apply P; reflexivity|reflexivity].
  - cbn [decide] in H. destruct (ground_pattern e a) as [f|] eqn:G; [|discriminate]. injection H as <-.
    rewrite (ground_instance _ _ _ _ A G), negb_true_iff, <- contains_in.
    destruct (contains (index_of facts) f); split; congruence.
  - cbn [decide] in H. destruct (known e x) as [s|] eqn:X; [|discriminate].
    destruct (known e y) as [t|] eqn:Y; [|discriminate]. destruct (comparison_decided test s t); [|discriminate].
    injection H as <-. rewrite (known_value _ _ _ _ A X), (known_value _ _ _ _ A Y). reflexivity.
  - eapply count_correct; eassumption.
Qed.
Lemma body_holds : forall facts (S : data -> Prop) v e body, agrees v e -> decide_all (index_of facts) e body = Some true ->
  (forall a, In a (positive_part body) -> S (instance v a)) ->
  forall c, In c body -> premise_holds (fun f => In f facts) S v c.
Proof.
  intros facts S v e body A. induction body as [|d body IH]; intros H P c J; [destruct J|].
  cbn [decide_all] in H. destruct (decide (index_of facts) e d) as [[]|] eqn:D; try discriminate.
  destruct J as [->|J].
  - apply (decide_correct _ S _ _ _ _ A D); [|reflexivity]. intros a ->. apply P. left. reflexivity.
  - apply IH; auto. intros a I. apply P. unfold positive_part. cbn [flat_map]. apply in_app_iff. right. exact I.
Qed.
Lemma body_fails : forall facts (S : data -> Prop) v e body, agrees v e -> decide_all (index_of facts) e body = Some false ->
  exists c, In c body /\ ~ premise_holds (fun f => In f facts) S v c.
Proof.
  intros facts S v e body A. induction body as [|d body IH]; intro H; [discriminate|].
  cbn [decide_all] in H. destruct (decide (index_of facts) e d) as [[]|] eqn:D; try discriminate.
  - destruct (IH H) as [c [J N]]. exists c. split; [right; exact J|exact N].
  - exists d. split; [left; reflexivity|]. intro Q.
    assert (F : false = true); [|discriminate]. apply (decide_correct _ S _ _ _ _ A D); [|exact Q].
    intros a ->. discriminate D.
Qed.
Lemma positive_in : forall body a, In a (positive_part body) <-> In (Present a) body.
Proof.
  intros body a. unfold positive_part. rewrite in_flat_map. split.
  - intros [[b|b|test x y|n local inner] [J I]]; try destruct I as [I|[]]; try destruct I. congruence.
  - intro J. exists (Present a). cbn. auto.
Qed.
Section Correct.
Variables (K : knowledge_base) (facts : list data).
Notation I := (index_of facts).
Notation M := (fun f => In f facts).
Lemma complete_correct : forall r v, complete_for I r = true ->
  (forall c, In c (premises r) -> premise_holds M M v c) ->
  conclusions r <> [] /\ forall c, In c (conclusions r) -> conclusion_holds K M v c.
Proof.
  intros r v C H. unfold complete_for in C. rewrite forallb_forall in C.
  destruct (matches_complete facts v (positive_part (premises r)) []) as [e [J A]].
  - intros x s L. discriminate L.
  - intros a Q. apply positive_in in Q. exact (H _ Q).
  - specialize (C e J). destruct (decide_all I e (premises r)) as [[]|] eqn:D; [| |discriminate].
    + split; [destruct (conclusions r); [discriminate|congruence]|]. intros c Q.
      assert (F : concluded I e c = true).
      { destruct (conclusions r) as [|c0 cs]; [destruct Q|]. rewrite forallb_forall in C. apply C, Q. }
      destruct c as [a|x y]; cbn [concluded conclusion_holds] in *.
      * destruct (ground_pattern e a) as [f|] eqn:G; [|discriminate]. rewrite (ground_instance _ _ _ _ A G).
        apply contains_in, F.
      * destruct (known e x) as [s|] eqn:X; [|discriminate]. destruct (known e y) as [t|] eqn:Y; [|discriminate].
        apply symbol_eqb_eq in F. left. rewrite (known_value _ _ _ _ A X), (known_value _ _ _ _ A Y). exact F.
    + exfalso. destruct (body_fails facts M v e _ A D) as [c [Q N]]. apply N, H, Q.
Qed.
Lemma unify_all_sound : forall patterns fs e e', unify_all e patterns fs = Some e' ->
  extends e e' /\ forall v, agrees v e' -> forall a, In a patterns -> In (instance v a) fs.
Proof.
  induction patterns as [|a patterns IH]; intros [|f fs] e e' H; cbn [unify_all] in H; try discriminate.
  - injection H as <-. split; [intros x s L; exact L|intros v _ b []].
  - destruct (Pos.eqb_spec (fst a) (fst f)) as [E|]; [|discriminate].
    destruct (unify e (snd a) (snd f)) as [e1|] eqn:U; [|discriminate].
    destruct (unify_sound _ _ _ _ U) as [X1 [V1 _]]. destruct (IH _ _ _ H) as [X V]. split.
    + intros x s L. apply X, X1, L.
    + intros v A b [<-|J]; [left|right; apply V; auto]. unfold instance. rewrite (V1 v).
      * rewrite E. destruct f; reflexivity.
      * intros x s L. apply A, X, L.
Qed.
(* A valuation for bindings *)
Definition complete_bindings (e : bindings) : valuation :=
  fun x => match lookup e x with Some s => s | None => Name 1%positive end.
Lemma complete_agrees : forall e, agrees (complete_bindings e) e.
Proof. intros e x s L. unfold complete_bindings. rewrite L. reflexivity. Qed.
Lemma follows_correct : forall (S : data -> Prop) r supports f, closed K M S -> In r (implications K) ->
  (forall g, In g supports -> S g) -> follows_by I r supports f = true -> S f.
Proof.
  intros S r supports f [_ [C _]] J Q F. unfold follows_by in F.
  destruct (unify_all [] (positive_part (premises r)) supports) as [e|] eqn:U; [|discriminate].
  apply andb_true_iff in F. destruct F as [F D]. destruct (decide_all I e (premises r)) as [[]|] eqn:A; try discriminate.
  apply existsb_exists in F. destruct F as [[a|x y] [Jc F]]; [|discriminate]. cbn [concludes] in F.
  destruct (ground_pattern e a) as [g|] eqn:G; [|discriminate].
  apply andb_true_iff in F. destruct F as [F1 F2]. apply Pos.eqb_eq in F1. apply arguments_eqb_eq in F2.
  assert (E : f = g) by (destruct f, g; cbn in *; congruence). subst g.
  rewrite <- (ground_instance _ _ _ _ (complete_agrees e) G). apply (C r (complete_bindings e) J) with (c := Concludes a); auto.
  apply (body_holds facts S _ e); auto using complete_agrees.
  intros b B. apply Q. eapply (proj2 (unify_all_sound _ _ _ _ U)); auto using complete_agrees.
Qed.
Lemma founded_correct : forall S : data -> Prop, closed K M S -> forall steps earlier next,
  (forall i f, PositiveMap.find i earlier = Some f -> S f) ->
  founded K I (index_of (stated K)) earlier next steps = true -> forall f, In f (map fst steps) -> S f.
Proof.
  intros S C. induction steps as [|[g why] steps IH]; intros earlier next E F f J; [destruct J|].
  cbn [founded] in F. apply andb_true_iff in F. destruct F as [F1 F2].
  assert (G : S g).
  { destruct why as [|supports].
    - apply contains_in in F1. apply (proj1 C), F1.
    - destruct (all_some _) as [fs|] eqn:A; [|discriminate]. apply all_some_in in A. destruct A as [A _].
      apply existsb_exists in F1. destruct F1 as [r [Jr F1]]. eapply follows_correct; try eassumption.
      intros h Jh. apply A in Jh. apply in_map_iff in Jh. destruct Jh as [i [L _]]. apply (E i), L. }
  destruct J as [<-|J]; [exact G|]. apply (IH _ _) with (2 := F2); auto. intros i h L.
  destruct (Pos.eq_dec i next) as [->|N].
  - rewrite PositiveMap.gss in L. congruence.
  - rewrite PositiveMap.gso in L by exact N. apply (E i), L.
Qed.
End Correct.

(* Stratified rules have at most one stable model. *)
Section Unique.
Variables (K : knowledge_base) (level : key -> nat).
Hypothesis is_stratified : stratified K level = true.
Lemma same_as_lowest : level (same_as K) = 0.
Proof. apply andb_true_iff in is_stratified. apply Nat.eqb_eq, is_stratified. Qed.
Lemma premises_above : forall r c d, In r (implications K) -> In c (conclusions r) -> In d (premises r) ->
  above level (conclusion_level K level c) d = true.
Proof.
  intros r c d Jr Jc Jd. pose proof is_stratified as G. apply andb_true_iff in G. destruct G as [_ G].
  rewrite forallb_forall in G. specialize (G r Jr). rewrite forallb_forall in G. specialize (G c Jc).
  rewrite forallb_forall in G. exact (G d Jd).
Qed.
(* A premise keeps its truth value for models that agree below its level. *)
Lemma premise_kept : forall (M M' S S' : data -> Prop) v c n, above level n c = true ->
  (forall f, level (fst f) < n -> (M f <-> M' f)) -> (forall f, level (fst f) <= n -> S f -> S' f) ->
  premise_holds M S v c -> premise_holds M' S' v c.
Proof.
  intros M M' S S' v [a|a|test x y|m local inner] n A E Sub H; cbn [above premise_holds] in *.
  - apply Nat.leb_le in A. apply Sub; [exact A|exact H].
  - apply Nat.ltb_lt in A. rewrite <- (E (instance v a)); [exact H|exact A].
  - exact H.
  - destruct H as [tuples [N [L H]]]. exists tuples. split; [exact N|]. split; [exact L|]. intro l. rewrite H.
    rewrite forallb_forall in A.
    split; intros [Len Q]; (split; [exact Len|]); intros a J; apply (E (instance (assign local l v) a));
      auto; apply Nat.ltb_lt, (A a J).
Qed.
Lemma stable_below : forall M M' n, stable K M -> stable K M' ->
  (forall f, level (fst f) < n -> (M f <-> M' f)) -> forall f, level (fst f) <= n -> M f -> M' f.
Proof.
  intros M M' n [_ Least] [[St [Ru [Sy Re]]] _] E f L H.
  refine (Least (fun g => level (fst g) <= n -> M' g) _ f H L). unfold closed. parts.
  - intros g J _. apply St, J.
  - intros r v Jr B c Jc.
    assert (P : conclusion_level K level c <= n -> conclusion_holds K M' v c).
    { intro Lc. apply (Ru r v Jr); [|exact Jc]. intros d Jd.
      apply (premise_kept M M' (fun g => level (fst g) <= n -> M' g) M' v d (conclusion_level K level c)).
      - eapply premises_above; eassumption.
      - intros g Lg. apply E. lia.
      - intros g Lg Q. apply Q. lia.
      - apply B, Jd. }
    destruct c as [a|x y]; cbn [conclusion_holds conclusion_level] in *; [exact P|].
    rewrite same_as_lowest in P. destruct (P (Nat.le_0_l n)) as [Q|Q]; [left; exact Q|right; intros _; exact Q].
  - intros a b Q Lb. apply Sy, Q, Lb.
  - intros p l l' Q F Lp. cbn [fst] in Lp. apply (Re p l l'); [apply Q, Lp|].
    clear Q. induction F as [|a b l l' Eq F IH]; constructor; [|exact IH].
    destruct Eq as [Eq|Eq]; [left; exact Eq|right]. apply Eq. cbn [fst]. rewrite same_as_lowest. lia.
Qed.
Lemma stable_unique : forall M M', stable K M -> stable K M' -> forall f, M f <-> M' f.
Proof.
  intros M M' H H'.
  assert (G : forall n f, level (fst f) < n -> (M f <-> M' f)).
  { induction n as [|n IH]; intros f L; [lia|]. split; apply (stable_below _ _ n); auto; try lia.
    intros g Lg. symmetry. apply IH, Lg. }
  intro f. apply (G (S (level (fst f)))). lia.
Qed.
End Unique.

Theorem knowledge : forall K level steps, check_derivations K level steps = true -> holds_exactly K (map fst steps).
Proof.
  intros K level steps H. unfold check_derivations in H. rewrite !andb_true_iff in H.
  destruct H as [[[[Str Names] St] Fo] Co]. rewrite forallb_forall in St, Names, Co.
  set (facts := map fst steps) in *.
  assert (NoEq : forall l, ~ In (same_as K, l) facts).
  { intros l J. apply in_map_iff in J. destruct J as [[f why] [E J]]. specialize (Names _ J).
    cbn [fst] in *. rewrite E in Names. cbn [fst] in Names. rewrite Pos.eqb_refl in Names. discriminate. }
  assert (C : closed K (fun f => In f facts) (fun f => In f facts)).
  { unfold closed. parts.
    - intros f J. apply contains_in, St, J.
    - intros r v Jr B c Jc. exact (proj2 (complete_correct K facts r v (Co r Jr) B) c Jc).
    - intros a b J. destruct (NoEq _ J).
    - intros p l l' J F. assert (E : l = l'); [|subst; exact J]. clear J.
      induction F as [|a b l l' [Eq|Eq] F IH]; [reflexivity| |destruct (NoEq _ Eq)]. congruence. }
  assert (S : stable K (fun f => In f facts)).
  { split; [exact C|]. intros S HS f J. eapply founded_correct; try eassumption.
    intros i g L. rewrite PositiveMap.gempty in L. discriminate. }
  unfold holds_exactly. cbv zeta. split; [exact S|]. split.
  - split.
    + intros r v Jr E B. exact (proj1 (complete_correct K facts r v (Co r Jr) B) E).
    + intros a b J. destruct (NoEq _ J).
  - intros other O f. exact (stable_unique K level Str _ _ O S f).
Qed.
