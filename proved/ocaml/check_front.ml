(* Checks certificates for a Pareto front with the function that theorem [front_optimal] is about.
   Believed, with reader.ml. The directory has the files domain.pddl, problem.pddl, front.txt, and
   I/plan.txt for each point I, counted from 1. front.txt has the two objectives, such as
   minimize (total-cost), and the two values of each point. There is one file of evidence for each
   point, and one more. Exit statuses: 0 proved, 30 not proved, 3 rejected. *)
let read_file path =
  let channel = open_in_bin path in
  Fun.protect ~finally:(fun () -> close_in channel) (fun () -> really_input_string channel (in_channel_length channel))

let check directory evidence_files =
  let read name = read_file (Filename.concat directory name) in
  let problem direction item = Reader.problem ~metric:[direction; item] (read "domain.pddl") (read "problem.pddl") in
  let first, second, values = match Reader.expressions (read "front.txt") with
    | direction :: item :: second_direction :: second_item :: values ->
      problem direction item, problem second_direction second_item, values
    | _ -> Reader.reject "a front has two objectives, each with minimize or maximize" in
  let value problem item = match Reader.claim problem (Reader.word item) with
    | Some value -> value
    | None -> Reader.reject "a point has two values" in
  let rec points i = function
    | a :: b :: others ->
      let plan = Reader.plan first (read (Filename.concat (string_of_int i) "plan.txt")) in
      { Checker.point_plan = plan; first_value = value first a; second_value = value second b } :: points (i + 1) others
    | [] -> []
    | [_] -> Reader.reject "a point has two values" in
  let points = points 1 values in
  let objective { Reader.task = { Checker.metric; per_time; per_step; _ }; _ } =
    { Checker.objective_metric = metric; time_weight = per_time; step_weight = per_step } in
  let evidence = List.map (fun file -> Evidence.read first.Reader.action_names (read_file file)) evidence_files in
  let for_checker { Evidence.ground_task; names; argument; labels_at; case; goal_case; _ } =
    { Checker.list_task = ground_task; list_names = names; list_case = case; list_goal_case = goal_case; list_argument = argument;
      list_oracle = labels_at } in
  if Checker.check_front first.Reader.task (objective first) (objective second) (List.map for_checker evidence) points then begin
    let rec pairs = function a :: b :: others -> (Reader.word a ^ " " ^ Reader.word b) :: pairs others | _ -> [] in
    Printf.printf "proved: the front has exactly these values: %s\n" (String.concat ", " (pairs values));
    0
  end
  else (print_endline "not proved"; 30)

let () =
  match Array.to_list Sys.argv with
  | _ :: directory :: (_ :: _ as evidence_files) ->
    exit (try check directory evidence_files with
      | Reader.Rejected message | Sys_error message -> Printf.printf "rejected: %s\n" message; 3
      | Stack_overflow -> print_endline "rejected: too deep for the stack"; 3
      | error -> Printf.printf "rejected: %s\n" (Printexc.to_string error); 3)
  | _ -> prerr_endline "usage: metaplan-proved-front DIRECTORY EVIDENCE..."; exit 2
