(* Checks certificates for a list of objectives with the function that theorem [list_optimal] is
   about. Believed, with reader.ml. The directory has the files domain.pddl, problem.pddl, plan.txt,
   and objectives.txt, with one objective in a line, such as minimize (total-cost). There is one file
   of evidence for each objective. Exit statuses: 0 proved, 30 not proved, 3 rejected. *)
let read_file path =
  let channel = open_in_bin path in
  Fun.protect ~finally:(fun () -> close_in channel) (fun () -> really_input_string channel (in_channel_length channel))

let check directory evidence_files =
  let read name = read_file (Filename.concat directory name) in
  let problem metric = Reader.problem ~metric (read "domain.pddl") (read "problem.pddl") in
  let rec objectives = function
    | direction :: item :: others -> problem [direction; item] :: objectives others
    | [] -> []
    | [_] -> Reader.reject "an objective is minimize or maximize, and an expression" in
  let problems = objectives (Reader.expressions (read "objectives.txt")) in
  if problems = [] || List.compare_lengths problems evidence_files <> 0 then
    Reader.reject "there is one file of evidence for each objective";
  let first = List.hd problems in
  let plan = Reader.plan first (read "plan.txt") in
  let evidence = List.map (fun file -> Evidence.read first.Reader.action_names (read_file file)) evidence_files in
  let claims = List.map2 (fun problem evidence -> match Reader.claim problem evidence.Evidence.claim with
    | Some value -> value
    | None -> Reader.reject "a list of objectives has values") problems evidence in
  let objective { Reader.task = { Checker.metric; per_time; per_step; _ }; _ } =
    { Checker.objective_metric = metric; time_weight = per_time; step_weight = per_step } in
  let for_checker { Evidence.ground_task; names; argument; labels_at; case; goal_case; _ } =
    { Checker.list_task = ground_task; list_names = names; list_case = case; list_goal_case = goal_case; list_argument = argument;
      list_oracle = labels_at } in
  if Checker.check_list first.Reader.task (List.map objective problems) (List.map for_checker evidence) plan claims then begin
    Printf.printf "proved: the plan of %d steps is optimal for the list of objectives, values %s\n" (List.length plan)
      (String.concat ", " (List.map (fun evidence -> evidence.Evidence.claim) evidence));
    0
  end
  else (print_endline "not proved"; 30)

let () =
  match Array.to_list Sys.argv with
  | _ :: directory :: (_ :: _ as evidence_files) ->
    exit (try check directory evidence_files with
      | Reader.Rejected message | Sys_error message -> Printf.printf "rejected: %s\n" message; 3
      | error -> Printf.printf "rejected: %s\n" (Printexc.to_string error); 3)
  | _ -> prerr_endline "usage: check_list DIRECTORY EVIDENCE..."; exit 2
