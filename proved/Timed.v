(* Semantics of timed initial literals for actions executed one after another: the formal counterpart
   of crates/pddl/src/validate/definition.md for tasks without derived predicates. This file has to be
   believed, with Lifted.v, for tasks with timed initial literals. *)
From Coq Require Import ZArith QArith List Bool.
From Proved Require Import Lifted.
Import ListNotations.

(* The timed initial literals of one time: a happening without conditions. No atom occurs twice. *)
Record event := Event { time : Q; sets : list (atom * bool) }.
Definition occur (w : world) (v : event) : world :=
  World (fun a => match assoc a (sets v) with Some b => b | None => holds_in w a end) (value_in w).
Definition elapse (w : world) (vs : list event) : world := fold_left occur vs w.

Section Timed.
Variables (P : problem) (events : list event).       (* in the order of their times, which differ; those at 0 are part of the initial state *)
Definition after_until (t u : Q) : list event := filter (fun v => less t (time v) && Qle_bool (time v) u) events.
Definition between (t u : Q) : list event := filter (fun v => less t (time v) && less (time v) u) events.
Definition at_time (t : Q) : list event := filter (fun v => Qle_bool t (time v) && Qle_bool (time v) t) events.

(* The atoms that a happening reads, even if they do not affect the result. *)
Fixpoint atoms_read (env : list key) (f : formula) : list atom :=
  match f with
  | Atom p ts => match ground env ts with Some l => [(p, l)] | None => [] end
  | Not g => atoms_read env g
  | And g h => atoms_read env g ++ atoms_read env h
  | Forall t g => flat_map (fun o => atoms_read (env ++ [o]) g) (objects P t)
  | _ => []
  end.
Fixpoint atoms_read_by_effect (env : list key) (e : effect) : list atom :=
  match e with
  | Both a b => atoms_read_by_effect env a ++ atoms_read_by_effect env b
  | When f a => atoms_read env f ++ atoms_read_by_effect env a
  | Each t a => flat_map (fun o => atoms_read_by_effect (env ++ [o]) a) (objects P t)
  | _ => []
  end.
(* An event at time [t] sets an atom that the happening reads or changes to the other value. *)
Definition interferes (w : world) (d : option Q) (env : list key) (f : formula) (e : effect) (t : Q) : bool :=
  existsb (fun l : atom * bool =>
      existsb (atom_eqb (fst l)) (atoms_read env f ++ atoms_read_by_effect env e) ||
      match changes P w d env e with Some cs => sets_atom cs (fst l) (negb (snd l)) | None => false end)
    (flat_map sets (at_time t)).
(* The world after events, before each of which a condition holds. *)
Fixpoint pass (w : world) (d : option Q) (env : list key) (f : formula) (vs : list event) : option world :=
  match vs with
  | [] => Some w
  | v :: r => match truth P w d env f with Some true => pass (occur w v) d env f r | _ => None end
  end.

(* One step that starts at time [s], in the world at time [now]: the world at its end and its duration.
   Events between start and end occur, and so does the event at the end. *)
Definition timed_step (allow_zero : bool) (w : world) (now s : Q) (a : action) (env : list key) : option (world * Q) :=
  if less s now || negb (Nat.eqb (length env) (length (parameters a)) &&
       forallb (fun x => existsb (Pos.eqb (fst x)) (objects P (snd x))) (combine env (parameters a)))
  then None else
  let w := elapse w (after_until now s) in
  match duration a with
  | None => if interferes w None env (at_start a) (start_effect a) s then None
            else option_map (fun w => (w, 0)) (happening P w None env (at_start a) (start_effect a))
  | Some x =>
      match eval w None env x with
      | None => None
      | Some d =>
          if less d 0 then None
          else if Qeq_bool d 0 then
            let f := And (at_start a) (at_end a) in let e := Both (start_effect a) (end_effect a) in
            if negb allow_zero || interferes w (Some d) env f e s then None
            else option_map (fun w => (w, d)) (happening P w (Some d) env f e)
          else if interferes w (Some d) env (at_start a) (start_effect a) s then None
          else match happening P w (Some d) env (at_start a) (start_effect a) with
          | None => None
          | Some w1 =>
              match pass w1 (Some d) env (over_all a) (between s (s + d)) with
              | None => None
              | Some w2 =>
                  if interferes w2 (Some d) env (at_end a) (end_effect a) (s + d) then None
                  else option_map (fun w => (elapse w (at_time (s + d)), d))
                    (happening P w2 (Some d) env (And (over_all a) (at_end a)) (end_effect a))
              end
          end
      end
  end.
(* A plan gives each action the time of its start. It ends when its last action ends. *)
Fixpoint timed_execute (allow_zero : bool) (w : world) (now spent : Q) (plan : list (Q * (nat * list key)))
    : option (world * Q) :=
  match plan with
  | [] => match truth P w None [] (goal_formula P) with Some true => Some (w, spent) | _ => None end
  | (s, (i, env)) :: r =>
      match nth_error (actions P) i with
      | None => None
      | Some a => match timed_step allow_zero w now s a env with
                  | Some (w', d) => timed_execute allow_zero w' (s + d) (Qred (spent + per_time P * d + per_step P)) r
                  | None => None
                  end
      end
  end.
End Timed.
Definition is_timed_optimal (P : problem) (events : list event) (plan : list (Q * (nat * list key))) (claim : option Q) : Prop :=
  match claim with
  | Some m =>
      (exists w spent m', timed_execute P events false (initial P) 0 0 plan = Some (w, spent)
         /\ final_metric P w spent = Some m' /\ m' == m) /\
      forall other w spent m', timed_execute P events true (initial P) 0 0 other = Some (w, spent) ->
         final_metric P w spent = Some m' -> m <= m'
  | None => forall other, timed_execute P events true (initial P) 0 0 other = None
  end.
