(* Checks certificates for tasks with timed initial literals with the function that theorem
   [timed_optimal] is about. Believed for these tasks, with reader.ml and check.ml. *)
module C = Checker
open Reader

(* Events in the order of their times. Of two literals about one atom, the later one in the file
   counts; it comes first in [literals]. *)
let events literals =
  let compare_times t u = if C.qeq_bool t u then 0 else if C.qle_bool t u then -1 else 1 in
  let once sets (atom, holds) = if List.mem_assoc atom sets then sets else (atom, holds) :: sets in
  List.map (fun time ->
    let sets = List.filter_map (fun (other, set) -> if C.qeq_bool time other then Some set else None) literals in
    { C.time; sets = List.fold_left once [] sets }) (List.sort_uniq compare_times (List.map fst literals))

(* The task with its events. Those at time 0 are also part of the initial state. *)
let task_with_events problem literals =
  let task = problem.task and events = events literals in
  if task.C.strata <> [] then reject "not covered: derived predicates together with timed initial literals";
  if not (C.qeq_bool task.C.per_step zero) then reject "not covered: a metric of steps together with timed initial literals";
  List.iter (fun { C.time; _ } -> if not (C.qle_bool zero time) then reject "a timed initial literal before time 0") events;
  let first = List.concat_map (fun { C.time; sets } -> if C.qeq_bool time zero then sets else []) events in
  let others = List.filter (fun (atom, ()) -> not (List.mem_assoc atom first)) (C.all_entries task.C.initial_atoms) in
  let added = List.filter_map (fun (atom, holds) -> if holds then Some (atom, ()) else None) first in
  let initial_atoms = List.fold_left (fun map (atom, ()) -> C.add_atom atom () map) C.M.empty (others @ added) in
  { task with C.initial_atoms }, events

(* Start times, as in 2.5: (go a b) [1.5]. A step without one starts when the step before it does, or at 0. *)
let start_times text =
  let rec starts time = function
    | Word word :: others when word.[String.length word - 1] = ':' -> starts (fraction (String.sub word 0 (String.length word - 1))) others
    | Word _ :: others -> starts time others
    | List _ :: others -> time :: starts time others
    | [] -> [] in
  starts zero (expressions text)

(* Written times may be rounded down: an action starts at its written time, or up to 0.001 after it. *)
let exact_starts written starts =
  let is_near time start = C.qle_bool time start && C.qle_bool start (C.qplus time (decimal "0.001")) in
  if List.length starts <> List.length written || not (List.for_all2 is_near written starts)
  then reject "the start times of the evidence are not those of the plan";
  starts

let check problem literals read evidence_text =
  let task, events = task_with_events problem literals in
  let evidence = Evidence.read problem.action_names evidence_text in
  let claim = claim problem evidence.Evidence.claim in
  let plan_text = if claim = None then "" else read "plan.txt" in
  let plan = List.combine (exact_starts (start_times plan_text) evidence.starts) (plan problem plan_text) in
  if not (C.check_timed task events evidence.ground_task evidence.names evidence.timeline evidence.passage_case evidence.wait_case
            evidence.goal_case evidence.argument evidence.labels_at plan claim)
  then (print_endline "not proved"; 30)
  else begin
    (match claim with
     | Some _ -> Printf.printf "proved, with timed initial literals: the plan of %d steps is optimal, metric %s\n" (List.length plan) evidence.claim
     | None -> print_endline "proved, with timed initial literals: there is no plan");
    0
  end
