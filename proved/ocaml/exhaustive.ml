(* Breadth-first search over all states of a small problem, with the semantics of Lifted.v only: the
   judge of claims that there is no plan. Does not have to be trusted. *)
module C = Checker
module R = Reader

type answer =
  | Plan of (C.nat * C.positive list) list
  | No_plan                                   (* no goal state can be reached *)
  | Too_large

(* The predicates and functions that an effect changes: whether it is a function, and the number of
   its arguments. *)
let rec changed = function
  | C.Nothing -> []
  | C.Put (_, p, terms) -> [false, p, List.length terms]
  | C.Change (_, f, terms, _) -> [true, f, List.length terms]
  | C.Both (a, b) -> changed a @ changed b
  | C.When (_, a) | C.Each (_, a) -> changed a
let changed_heads problem =
  List.sort_uniq compare (List.concat_map (fun action -> changed action.C.start_effect @ changed action.C.end_effect) problem.C.actions)

let rec tuples objects n =
  if n = 0 then [[]] else List.concat_map (fun o -> List.map (List.cons o) (tuples objects (n - 1))) objects

(* A text that differs between different reachable states. *)
let signature (problem : R.problem) =
  let objects = List.map R.object_key problem.object_names in
  let atoms = List.concat_map (fun (is_number, head, n) ->
      List.map (fun arguments -> is_number, (head, arguments)) (tuples objects n)) (changed_heads problem.task) in
  let rec bits = function C.XH -> "1" | C.XO p -> bits p ^ "0" | C.XI p -> bits p ^ "1" in
  let integer = function C.Z0 -> "0" | C.Zpos p -> bits p | C.Zneg p -> "-" ^ bits p in
  fun world -> String.concat " " (List.map (fun (is_number, atom) ->
      if not is_number then string_of_bool (world.C.holds_in atom)
      else match world.C.value_in atom with
        | None -> "undefined"
        | Some value -> let value = C.qred value in integer value.C.qnum ^ "/" ^ bits value.C.qden) atoms)

(* The same state; every value is computed once. *)
let memoized world =
  let once f =
    let table = Hashtbl.create 100 in
    fun atom -> match Hashtbl.find_opt table atom with
      | Some result -> result
      | None -> let result = f atom in Hashtbl.replace table atom result; result in
  { C.holds_in = once world.C.holds_in; C.value_in = once world.C.value_in }

(* With or without steps of duration 0, see [step] in Lifted.v. *)
let search allow_zero max_states (problem : R.problem) =
  let pddl = problem.task in
  let steps = List.concat (List.mapi (fun i action ->
      List.map (fun env -> R.nat i, action, env) (C.instances pddl (fun _ -> false) action.C.parameters [])) pddl.C.actions) in
  let signature = signature problem in
  let visited = Hashtbl.create 1000 and queue = Queue.create () in
  let add world plan =
    let key = signature world in
    if not (Hashtbl.mem visited key) then begin
      Hashtbl.replace visited key ();
      Queue.add (memoized world, plan) queue
    end in
  add (C.initial pddl) [];
  let rec visit () =
    if Queue.is_empty queue then No_plan
    else if Hashtbl.length visited > max_states then Too_large
    else
      let world, plan = Queue.pop queue in
      if C.execute pddl allow_zero world R.zero [] <> None then Plan (List.rev plan)
      else begin
        let world = C.derived_world pddl world in
        List.iter (fun (i, action, env) ->
          match C.step pddl allow_zero world action env with
          | Some (next, _) -> add next ((i, env) :: plan)
          | None -> ()) steps;
        visit ()
      end in
  visit ()

(* Plans of at most [max_steps] steps for a problem with timed initial literals, with their worlds and metrics. Every
   step starts at once, at an event or a moment after it, or such that it ends at an event or a moment after it; a
   moment is less than half of any difference of sums of durations and times. *)
let timed_plans allow_zero max_steps (pddl : C.problem) events moment =
  let steps = List.concat (List.mapi (fun i action ->
      List.map (fun env -> R.nat i, action, env) (C.instances pddl (fun _ -> false) action.C.parameters [])) pddl.C.actions) in
  let later time = C.qred (C.qplus time moment) in
  let at_events = List.concat_map (fun event -> [event.C.time; later event.C.time]) events in
  let starts world now action env = match action.C.duration with
    | None -> now :: at_events
    | Some duration -> (match C.eval world None env duration with
        | Some d -> now :: at_events @ List.map (fun time -> C.qred (C.qminus time d)) at_events
        | None -> [now]) in
  let rec extend length world now plan spent : ((C.q * (C.nat * C.positive list)) list * C.q) Seq.t = fun () ->
    let ended = match C.timed_execute pddl events allow_zero world now spent [] with
      | Some (world, spent) -> (match C.final_metric pddl world spent with Some metric -> Seq.return (List.rev plan, metric) | None -> Seq.empty)
      | None -> Seq.empty in
    let longer = if length = 0 then Seq.empty else
      List.to_seq steps |> Seq.flat_map (fun (i, action, env) ->
        List.to_seq (List.sort_uniq compare (List.map C.qred (starts world now action env))) |> Seq.flat_map (fun start ->
          match C.timed_step pddl events allow_zero world now start action env with
          | Some (next, d) ->
            let weight = C.qplus (C.qmult pddl.C.per_time d) pddl.C.per_step in
            extend (length - 1) (memoized next) (C.qred (C.qplus start d)) ((start, (i, env)) :: plan) (C.qred (C.qplus spent weight))
          | None -> Seq.empty)) in
    Seq.append ended longer () in
  extend max_steps (C.initial pddl) R.zero [] R.zero
