(* Semantics of a mission: the PDDL problem that PDDL files and a knowledge base determine. The bindings of the mission
   are rules of the knowledge base; their conclusions are facts about PDDL symbols: members of types, atoms of
   predicates, values of functions. In a plain domain, the facts also determine which designs an action chooses.
   This file, the theorems [mission_optimal] and [mission_front] in MissionProof.v and the readers are all that has to be
   believed about missions, in addition to Lifted.v and Datalog.v, and to Lists.v and Fronts.v for Pareto fronts. *)
From Coq Require Import ZArith QArith List Bool.
From Proved Require Import Lifted Datalog.
Import ListNotations.
Open Scope nat_scope.

(* Substitution in the schema of an action: for terms, and for functions without arguments *)
Section Substitution.
Variables (t : term -> term) (sum : key -> option expression).
Fixpoint in_expression (e : expression) : expression :=
  match e with
  | Fluent f [] => match sum f with Some e => e | None => e end
  | Fluent f ts => Fluent f (map t ts)
  | Plus a b => Plus (in_expression a) (in_expression b) | Minus a b => Minus (in_expression a) (in_expression b)
  | Times a b => Times (in_expression a) (in_expression b) | Over a b => Over (in_expression a) (in_expression b)
  | Constant _ | Duration => e
  end.
Fixpoint in_formula (f : formula) : formula :=
  match f with
  | Truth _ => f | Atom p ts => Atom p (map t ts) | Same a b => Same (t a) (t b)
  | Compare strict a b => Compare strict (in_expression a) (in_expression b)
  | Not g => Not (in_formula g) | And g h => And (in_formula g) (in_formula h) | Forall type g => Forall type (in_formula g)
  end.
Fixpoint in_effect (e : effect) : effect :=
  match e with
  | Nothing => e | Put b p ts => Put b p (map t ts) | Change b f ts x => Change b f (map t ts) (in_expression x)
  | Both a b => Both (in_effect a) (in_effect b) | When f a => When (in_formula f) (in_effect a)
  | Each type a => Each type (in_effect a)
  end.
End Substitution.

(* The designs of an action of a plain domain: it gets a parameter for the design of each function that it requires.
   The design solves the function; it is available and not ruled out, from the start to the end of the action. *)
Record choice_of_designs := ChoiceOfDesigns {
  requirement : key;                               (* predicate of the functions that the action requires *)
  design_type : key; solves : key; available : key;
  sums : list (key * key);                         (* functions, each with that of design and function which is summed *)
  ruled_out : list (formula * key) }.              (* contexts, each with the predicate of design and function that rules out *)
Definition with_designs (c : choice_of_designs) (functions : list key) (a : action) : action :=
  let n := length (parameters a) in let k := length functions in
  let t x := match x with Var i => Var (if Nat.ltb i n then i else i + k) | Object o => Object o end in
  let designs := combine (map Var (seq n k)) (map Object functions) in
  let sum f := match find (fun s => Pos.eqb f (fst s)) (sums c) with
               | Some (_, g) => Some (fold_right Plus (Constant 0) (map (fun d => Fluent g [fst d; snd d]) designs))
               | None => None end in
  let all := fold_right And (Truth true) in
  let chosen := all (map (fun d => Atom (solves c) [fst d; snd d]) designs) in
  let lasting := all (map (fun d => And (Atom (available c) [fst d])
    (all (map (fun r => Imply (fst r) (Not (Atom (snd r) [fst d; snd d]))) (ruled_out c)))) designs) in
  Action (parameters a ++ repeat (design_type c) k) (option_map (in_expression t sum) (duration a))
    (And (in_formula t sum (at_start a)) (And chosen lasting)) (in_effect t sum (start_effect a))
    (And (in_formula t sum (over_all a)) lasting) (in_formula t sum (at_end a)) (in_effect t sum (end_effect a)).

Record mission := Mission {
  mission_knowledge : knowledge_base;              (* with the bindings as rules *)
  files : problem;                                 (* the PDDL files; their actions are listed in [schemas] *)
  schemas : list (action * option choice_of_designs); (* no designs are added to the actions of an explicit domain *)
  bound_symbols : list key;                        (* the PDDL symbols of which the knowledge base has facts *)
  object_for : key -> key }.                       (* the object that represents an individual *)

Section Filled.
Variables (W : mission) (M : data -> Prop).
(* A fact about a PDDL symbol, individuals that these objects represent, and values *)
Definition image (p : key) (objects : list key) (values : list symbol) : Prop :=
  In p (bound_symbols W) /\ exists names, map (object_for W) names = objects /\ M (p, map Name names ++ values).
Definition mentions (n : key) : Prop := exists p l, In p (bound_symbols W) /\ M (p, l) /\ In (Name n) l.
Definition action_of (schema : action * option choice_of_designs) (a : action) : Prop :=
  match snd schema with
  | None => a = fst schema
  | Some c => exists functions, NoDup functions /\ (forall f, In f functions <-> image (requirement c) [f] []) /\
                a = with_designs c functions (fst schema)
  end.
(* The problem of a mission, for the facts in M. Values that the files state take precedence. *)
Definition filled (P : problem) : Prop :=
  (forall n m, mentions n -> mentions m -> object_for W n = object_for W m -> n = m) /\
  (forall t o, In o (objects P t) <-> In o (objects (files W) t) \/ image t [o] []) /\
  (forall p l, holds_in (initial P) (p, l) = true <-> holds_in (initial (files W)) (p, l) = true \/ image p l []) /\
  (forall f l q, value_in (initial P) (f, l) = Some q <-> value_in (initial (files W)) (f, l) = Some q \/
     value_in (initial (files W)) (f, l) = None /\ image f l [Literal (Numeric q)]) /\
  Forall2 action_of (schemas W) (actions P) /\
  strata P = strata (files W) /\ goal_formula P = goal_formula (files W) /\
  metric P = metric (files W) /\ per_time P = per_time (files W) /\ per_step P = per_step (files W).
End Filled.

(* The claim holds for the problem that follows from the mission's knowledge base and PDDL files. The knowledge base has
   exactly one stable model, and it is consistent. *)
Definition holds_for_mission (W : mission) (claim : problem -> Prop) : Prop :=
  exists M P, stable (mission_knowledge W) M /\ (forall other, stable (mission_knowledge W) other -> forall f, other f <-> M f) /\
    consistent (mission_knowledge W) M /\ filled W M P /\ claim P.
