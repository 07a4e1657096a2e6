(* Semantics of PDDL actions executed one after another: the formal counterpart of
   crates/pddl/src/validate/definition.md for tasks without chosen durations and timed initial literals; Timed.v has the
   semantics of the latter. This file, the statement of the theorem [optimal], and the readers are all that
   has to be believed. *)
From Coq Require Import ZArith QArith List Bool FMapPositive.
Import ListNotations.

Definition key := positive.                      (* predicates, functions, types and objects are numbered *)
Definition atom := (key * list key)%type.        (* a predicate or a function, applied to objects *)
Definition atom_eqb (a b : atom) : bool :=
  Pos.eqb (fst a) (fst b) && if list_eq_dec Pos.eq_dec (snd a) (snd b) then true else false.
Fixpoint assoc {X} (a : atom) (l : list (atom * X)) : option X :=
  match l with [] => None | (b, x) :: r => if atom_eqb a b then Some x else assoc a r end.

(* Finite maps from atoms: buckets in a search tree. Collisions of [bucket] cost time only. *)
Definition atom_map X := PositiveMap.t (list (atom * X)).
Definition bucket (a : atom) : positive :=
  fold_left (fun h o => (4096 * h + o)%positive) (snd a) (fst a).
Definition bucket_entries {X} (m : atom_map X) (a : atom) : list (atom * X) :=
  match PositiveMap.find (bucket a) m with Some l => l | None => [] end.
Definition find_atom {X} (m : atom_map X) (a : atom) : option X := assoc a (bucket_entries m a).
Definition add_atom {X} (a : atom) (x : X) (m : atom_map X) : atom_map X :=
  PositiveMap.add (bucket a) ((a, x) :: bucket_entries m a) m.

(* Syntax. [Var i] is the variable at position i: parameters first, then variables of enclosing
   quantifiers. *)
Inductive term := Var (i : nat) | Object (o : key).
Inductive expression :=
  | Constant (q : Q) | Fluent (f : key) (ts : list term) | Duration
  | Plus (a b : expression) | Minus (a b : expression) | Times (a b : expression) | Over (a b : expression).
Inductive formula :=
  | Truth (b : bool) | Atom (p : key) (ts : list term) | Same (t u : term)
  | Compare (strict : bool) (a b : expression)          (* a > b if strict, else a >= b *)
  | Not (f : formula) | And (f g : formula) | Forall (type : key) (f : formula).
Definition Or (f g : formula) := Not (And (Not f) (Not g)).
Definition Imply (f g : formula) := Not (And f (Not g)).
Definition Exists (type : key) (f : formula) := Not (Forall type (Not f)).
Definition Equal (a b : expression) := And (Compare false a b) (Compare false b a).
Inductive effect :=
  | Nothing | Put (holds : bool) (p : key) (ts : list term)          (* adds or deletes an atom *)
  | Change (assigns : bool) (f : key) (ts : list term) (e : expression) (* assigns or increases *)
  | Both (a b : effect) | When (f : formula) (a : effect) | Each (type : key) (a : effect).
Record action := Action {
  parameters : list key;                           (* types *)
  duration : option expression;                    (* none: instantaneous; only the part at start is used *)
  at_start : formula; start_effect : effect; over_all : formula; at_end : formula; end_effect : effect }.
Record world := World { holds_in : atom -> bool; value_in : atom -> option Q }.
(* A derived predicate holds of objects of these types if the body holds. *)
Record rule := Rule { head : key; head_types : list key; body : formula }.
Record problem := Problem {
  objects : key -> list key;                       (* the objects of a type *)
  actions : list action;
  strata : list (list rule);                       (* negation refers to earlier strata only *)
  initial_atoms : atom_map unit; initial_values : atom_map Q;
  goal_formula : formula;
  metric : expression;                             (* to be minimized, with *)
  per_time : Q; per_step : Q }.                  (* weights of the total time and of the number of steps *)
Definition initial (P : problem) : world :=
  World (fun a => match find_atom (initial_atoms P) a with Some _ => true | None => false end)
        (find_atom (initial_values P)).

(* Terms, expressions, conditions. [None] is undefined. *)
Definition object_of (env : list key) (t : term) : option key :=
  match t with Var i => nth_error env i | Object o => Some o end.
Fixpoint ground (env : list key) (ts : list term) : option (list key) :=
  match ts with
  | [] => Some []
  | t :: r => match object_of env t, ground env r with Some o, Some l => Some (o :: l) | _, _ => None end
  end.
Definition lift (f : Q -> Q -> Q) (a b : option Q) : option Q :=
  match a, b with Some x, Some y => Some (f x y) | _, _ => None end.
Fixpoint eval (w : world) (d : option Q) (env : list key) (e : expression) : option Q :=
  match e with
  | Constant q => Some q
  | Fluent f ts => match ground env ts with Some l => value_in w (f, l) | None => None end
  | Duration => d
  | Plus a b => lift Qplus (eval w d env a) (eval w d env b)
  | Minus a b => lift Qminus (eval w d env a) (eval w d env b)
  | Times a b => lift Qmult (eval w d env a) (eval w d env b)
  | Over a b => match eval w d env b with
                | Some y => if Qeq_bool y 0 then None else lift Qdiv (eval w d env a) (Some y)
                | None => None end
  end.
Definition less (x y : Q) : bool := negb (Qle_bool y x).
(* Kleene's conjunction: undefined only where the truth depends on an undefined operand. *)
Definition and_kleene (a b : option bool) : option bool :=
  match a, b with
  | Some false, _ => Some false | _, Some false => Some false
  | Some true, Some true => Some true | _, _ => None
  end.
Section Conditions.
Variable P : problem.
Fixpoint truth (w : world) (d : option Q) (env : list key) (f : formula) : option bool :=
  match f with
  | Truth b => Some b
  | Atom p ts => match ground env ts with Some l => Some (holds_in w (p, l)) | None => None end
  | Same t u => match object_of env t, object_of env u with
                | Some a, Some b => Some (Pos.eqb a b) | _, _ => None end
  | Compare strict a b => match eval w d env a, eval w d env b with
                          | Some x, Some y => Some (if strict then less y x else Qle_bool y x)
                          | _, _ => None end
  | Not g => option_map negb (truth w d env g)
  | And g h => and_kleene (truth w d env g) (truth w d env h)
  | Forall t g => fold_right (fun o r => and_kleene (truth w d (env ++ [o]) g) r) (Some true) (objects P t)
  end.

(* Derived predicates: in each stratum, the least set of atoms that contains the head of every
   instance of a rule whose body holds. *)
Definition is_derived (p : key) : bool := existsb (existsb (fun r => Pos.eqb p (head r))) (strata P).
(* The world in which exactly these derived atoms hold. *)
Definition with_facts (w : world) (facts : atom_map unit) : world :=
  World (fun a => if is_derived (fst a) then match find_atom facts a with Some _ => true | None => false end
                  else holds_in w a) (value_in w).
Fixpoint tuples (types : list key) : list (list key) :=
  match types with [] => [[]] | t :: r => flat_map (fun o => map (cons o) (tuples r)) (objects P t) end.
Definition rule_instances (rules : list rule) : list (atom * formula) :=
  flat_map (fun r => map (fun env => ((head r, env), body r)) (tuples (head_types r))) rules.
Definition fires_in (w : world) (i : atom * formula) : bool :=
  match truth w None (snd (fst i)) (snd i) with Some b => b | None => false end.
Definition new_atoms (w : world) (instances : list (atom * formula)) : list atom :=
  map fst (filter (fun i => negb (holds_in w (fst i)) && fires_in w i) instances).
(* Theorem [stratum_closed] shows that the number of instances bounds the number of rounds. *)
Fixpoint evaluate_stratum (rounds : nat) (instances : list (atom * formula)) (w : world) (facts : atom_map unit)
    : atom_map unit :=
  match rounds with
  | O => facts
  | S rounds => match new_atoms (with_facts w facts) instances with
                | [] => facts
                | new => evaluate_stratum rounds instances w (fold_left (fun m a => add_atom a tt m) new facts)
                end
  end.
Definition derived_facts (w : world) : atom_map unit :=
  fold_left (fun facts rules => let instances := rule_instances rules in
               evaluate_stratum (S (length instances)) instances w facts) (strata P) (PositiveMap.empty _).
Definition derived_world (w : world) : world := with_facts w (derived_facts w).

(* The changes that an effect makes; undefined if it needs an undefined value. *)
Inductive change := Fact (a : atom) (holds : bool) | Number (a : atom) (assigns : bool) (q : Q).
Definition both {X} (a b : option (list X)) : option (list X) :=
  match a, b with Some x, Some y => Some (x ++ y) | _, _ => None end.
Fixpoint changes (w : world) (d : option Q) (env : list key) (e : effect) : option (list change) :=
  match e with
  | Nothing => Some []
  | Put b p ts => match ground env ts with Some l => Some [Fact (p, l) b] | None => None end
  | Change assigns f ts x => match ground env ts, eval w d env x with
                             | Some l, Some q => Some [Number (f, l) assigns q] | _, _ => None end
  | Both a b => both (changes w d env a) (changes w d env b)
  | When f a => match truth w d env f with
                | Some true => changes w d env a | Some false => Some [] | None => None end
  | Each t a => fold_right (fun o r => both (changes w d (env ++ [o]) a) r) (Some []) (objects P t)
  end.
(* Of an atom that is both added and deleted, the addition counts. *)
Definition sets_atom (cs : list change) (a : atom) (b : bool) : bool :=
  existsb (fun c => match c with Fact a' b' => atom_eqb a a' && Bool.eqb b b' | _ => false end) cs.
(* Several changes of one number: increases together, or assignments of one value. *)
Definition changes_of (f : atom) (cs : list change) : list (bool * Q) :=
  flat_map (fun c => match c with Number f' b q => if atom_eqb f f' then [(b, q)] else [] | _ => [] end) cs.
Definition changed_value (old : option Q) (l : list (bool * Q)) : option Q :=
  match l with
  | [] => old
  | (true, q) :: r => if forallb (fun c => fst c && Qeq_bool (snd c) q) r then Some q else None
  | (false, _) :: _ => if existsb fst l then None
                       else option_map (fun x => fold_left (fun s c => Qred (s + snd c)) l x) old
  end.
Fixpoint changed_fluents (cs : list change) : list atom :=
  match cs with
  | [] => []
  | Number f _ _ :: r => f :: changed_fluents r
  | Fact _ _ :: r => changed_fluents r
  end.
Fixpoint updates (w : world) (cs : list change) (fs : list atom) : option (list (atom * Q)) :=
  match fs with
  | [] => Some []
  | f :: r => match changed_value (value_in w f) (changes_of f cs), updates w cs r with
              | Some q, Some l => Some ((f, q) :: l) | _, _ => None end
  end.
(* One happening: everything is evaluated in the state before it. *)
Definition happening (w : world) (d : option Q) (env : list key) (f : formula) (e : effect) : option world :=
  match truth w d env f, changes w d env e with
  | Some true, Some cs =>
      match updates w cs (changed_fluents cs) with
      | Some l => Some (World (fun a => sets_atom cs a true || (negb (sets_atom cs a false) && holds_in w a))
                              (fun a => match assoc a l with Some q => Some q | None => value_in w a end))
      | None => None
      end
  | _, _ => None
  end.
(* One step from a state with its derived atoms: the state after it and its duration. With duration 0, start and end are one happening.
   The definition forbids that start and end interfere then; [allow_zero] permits such steps. *)
Definition step (allow_zero : bool) (w : world) (a : action) (env : list key) : option (world * Q) :=
  if negb (Nat.eqb (length env) (length (parameters a)) &&
           forallb (fun x => existsb (Pos.eqb (fst x)) (objects P (snd x))) (combine env (parameters a)))
  then None else
  match duration a with
  | None => option_map (fun w => (w, 0)) (happening w None env (at_start a) (start_effect a))
  | Some e =>
      match eval w None env e with
      | None => None
      | Some d =>
          if less d 0 then None
          else if Qeq_bool d 0 then
            if allow_zero then option_map (fun w => (w, d))
              (happening w (Some d) env (And (at_start a) (at_end a)) (Both (start_effect a) (end_effect a)))
            else None
          else match happening w (Some d) env (at_start a) (start_effect a) with
               | None => None
               | Some w1 => option_map (fun w => (w, d))
                   (happening (derived_world w1) (Some d) env (And (over_all a) (at_end a)) (end_effect a))
               end
      end
  end.
(* A plan names actions by their positions. The goal state in which it ends, with what its steps add
   to the metric. *)
Fixpoint execute (allow_zero : bool) (w : world) (spent : Q) (plan : list (nat * list key))
    : option (world * Q) :=
  match plan with
  | [] => match truth (derived_world w) None [] (goal_formula P) with Some true => Some (w, spent) | _ => None end
  | (i, env) :: r =>
      match nth_error (actions P) i with
      | None => None
      | Some a => match step allow_zero (derived_world w) a env with
                  | Some (w', d) => execute allow_zero w' (Qred (spent + per_time P * d + per_step P)) r
                  | None => None
                  end
      end
  end.
End Conditions.
Definition final_metric (P : problem) (w : world) (spent : Q) : option Q :=
  option_map (fun m => m + spent) (eval w None [] (metric P)).
(* The claim of a certificate: [Some m], an optimal plan has metric m; [None], there is no plan. The
   plan of the certificate has no step of duration 0; the other plans may have some. *)
Definition is_optimal (P : problem) (plan : list (nat * list key)) (claim : option Q) : Prop :=
  match claim with
  | Some m =>
      (exists w spent m', execute P false (initial P) 0 plan = Some (w, spent)
         /\ final_metric P w spent = Some m' /\ m' == m) /\
      forall other w spent m', execute P true (initial P) 0 other = Some (w, spent) ->
         final_metric P w spent = Some m' -> m <= m'
  | None => forall other, execute P true (initial P) 0 other = None
  end.
