(* Semantics of a knowledge base: facts, rules with stratified negation and counting, integrity constraints, and
   equality of individuals as in OWL 2 RL. A model is stable [1] if it is the least set of facts that is
   closed under all rules, where negation and counting refer to the model itself. Stratified rules have exactly one
   stable model. This file, the theorem [knowledge] in Derivations.v and the readers are all that has to be
   believed about derivations.
   [1] M. Gelfond, V. Lifschitz: The stable model semantics for logic programming, ICLP 1988. *)
From Coq Require Import ZArith QArith List Bool.
From Proved Require Import Lifted.
Import ListNotations.
Open Scope nat_scope.

(* Values of XSD. Numbers are decimals and integers, in lowest terms, so that equal values are the same term. *)
Inductive xsd_value := Text (characters : list Z) | Boolean (b : bool) | Numeric (q : Q).
Inductive symbol := Name (n : key) | Literal (x : xsd_value).
Definition is_name (s : symbol) : bool := match s with Name _ => true | Literal _ => false end.
Definition data := (key * list symbol)%type.       (* a fact: a class, property or relation, with its arguments *)

(* Built-ins of SWRL, and tests of OWL. [Different] holds if the symbols certainly denote different things; two
   names do not, since an individual can have several names. *)
Inductive datatype := AnyText | AnyBoolean | AnyNumber | AnyInteger.
Inductive built_in := Less | LessOrEqual | Identical | NotIdentical | Different | Outside (d : datatype).
Definition symbol_eq_dec : forall a b : symbol, {a = b} + {a <> b}.
Proof. repeat (decide equality). Defined.
Definition symbol_eqb (a b : symbol) : bool := if symbol_eq_dec a b then true else false.
Fixpoint compare_text (s t : list Z) : comparison :=
  match s, t with
  | [], [] => Eq | [], _ :: _ => Lt | _ :: _, [] => Gt
  | c :: s, d :: t => match Z.compare c d with Eq => compare_text s t | o => o end
  end.
Definition compare_values (x y : xsd_value) : option comparison :=
  match x, y with
  | Text s, Text t => Some (compare_text s t)
  | Boolean b, Boolean c => Some (if b then if c then Eq else Gt else if c then Lt else Eq)
  | Numeric p, Numeric q => Some (Qcompare p q)
  | _, _ => None                                   (* values of different kinds have no order *)
  end.
Definition in_datatype (x : xsd_value) (d : datatype) : bool :=
  match x, d with
  | Text _, AnyText => true | Boolean _, AnyBoolean => true | Numeric _, AnyNumber => true
  | Numeric q, AnyInteger => Pos.eqb (Qden q) 1
  | _, _ => false
  end.
Definition satisfies (test : built_in) (a b : symbol) : bool :=
  match test, a, b with
  | Less, Literal x, Literal y => match compare_values x y with Some Lt => true | _ => false end
  | LessOrEqual, Literal x, Literal y => match compare_values x y with Some Lt | Some Eq => true | _ => false end
  | Identical, Literal _, Literal _ => symbol_eqb a b
  | NotIdentical, Literal _, Literal _ => negb (symbol_eqb a b)
  | Different, Name _, Name _ => false
  | Different, _, _ => negb (symbol_eqb a b)
  | Outside d, Literal x, _ => negb (in_datatype x d)     (* the second argument is ignored *)
  | Outside _, Name _, _ => true                   (* no individual is a value of a datatype *)
  | _, _, _ => false                               (* no value has this kind *)
  end.

(* Rules *)
Inductive argument := RuleVariable (x : key) | Symbol (s : symbol).
Definition pattern := (key * list argument)%type.
Inductive conjunct :=
  | Present (a : pattern) | Absent (a : pattern)
  | Test (test : built_in) (x y : argument)
  | Count (n : nat) (local : list key) (inner : list pattern). (* n values of the local variables satisfy all patterns *)
Inductive conclusion := Concludes (a : pattern) | Equates (x y : argument).
Record implication := Implication { premises : list conjunct; conclusions : list conclusion }. (* without conclusion: a constraint *)
Record knowledge_base := KnowledgeBase { stated : list data; implications : list implication; same_as : key }.

Definition valuation := key -> symbol.
Definition value_of (v : valuation) (t : argument) : symbol := match t with RuleVariable x => v x | Symbol s => s end.
Definition instance (v : valuation) (a : pattern) : data := (fst a, map (value_of v) (snd a)).
Fixpoint assign (local : list key) (l : list symbol) (v : valuation) : valuation :=
  match local, l with
  | x :: local, s :: l => fun y => if Pos.eqb y x then s else assign local l v y
  | _, _ => v
  end.

Section Models.
Variable K : knowledge_base.
(* A premise for the facts in S, where negation and counting refer to the model M. *)
Definition premise_holds (M S : data -> Prop) (v : valuation) (c : conjunct) : Prop :=
  match c with
  | Present a => S (instance v a)
  | Absent a => ~ M (instance v a)
  | Test test x y => satisfies test (value_of v x) (value_of v y) = true
  | Count n local inner => exists matches, NoDup matches /\ length matches = n /\
      forall l, In l matches <-> length l = length local /\ forall a, In a inner -> M (instance (assign local l v) a)
  end.
Definition equal (S : data -> Prop) (a b : symbol) : Prop := a = b \/ S (same_as K, [a; b]).
Definition conclusion_holds (S : data -> Prop) (v : valuation) (c : conclusion) : Prop :=
  match c with Concludes a => S (instance v a) | Equates x y => equal S (value_of v x) (value_of v y) end.
Definition closed (M S : data -> Prop) : Prop :=
  (forall f, In f (stated K) -> S f) /\
  (forall r v, In r (implications K) -> (forall c, In c (premises r) -> premise_holds M S v c) ->
     forall c, In c (conclusions r) -> conclusion_holds S v c) /\
  (* equal individuals have the same properties *)
  (forall a b, S (same_as K, [a; b]) -> S (same_as K, [b; a])) /\
  (forall p l l', S (p, l) -> Forall2 (equal S) l l' -> S (p, l')).
Definition stable (M : data -> Prop) : Prop :=
  closed M M /\ forall S, closed M S -> forall f, M f -> S f.
(* No constraint is violated, and no literal equals another literal or an individual. *)
Definition consistent (M : data -> Prop) : Prop :=
  (forall r v, In r (implications K) -> conclusions r = [] -> ~ forall c, In c (premises r) -> premise_holds M M v c) /\
  (forall a b, M (same_as K, [a; b]) -> a <> b -> is_name a = true /\ is_name b = true).
(* The claimed facts, and no others, hold in the knowledge base. *)
Definition holds_exactly (claimed : list data) : Prop :=
  let M f := In f claimed in
  stable M /\ consistent M /\ forall other, stable other -> forall f, other f <-> M f.
End Models.
