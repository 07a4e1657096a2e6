(* Reads the certificate of a Pareto front, and checks it. Believed for fronts. front.txt has the two objectives, such as
   minimize (total-cost), and the two values of each point. *)

let read_file path =
  let channel = open_in_bin path in
  Fun.protect ~finally:(fun () -> close_in channel) (fun () -> really_input_string channel (in_channel_length channel))

(* [problem] reads the problem with an objective, and [accepts] checks the front of the first problem. *)
let check ~problem ~accepts ~statement read evidence_files =
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
  if accepts first (objective first) (objective second) (List.map for_checker evidence) points then begin
    let rec pairs = function a :: b :: others -> (Reader.word a ^ " " ^ Reader.word b) :: pairs others | _ -> [] in
    Printf.printf "%sthe front has exactly these values: %s\n" statement (String.concat ", " (pairs values));
    0
  end
  else (print_endline "not proved"; 30)
