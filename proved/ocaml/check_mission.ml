(* Checks the certificate of a mission with a knowledge base, with the function that theorem [mission_optimal] is about.
   Believed for missions, with mission.ml. Exit statuses: 0 proved, 30 not proved, 3 rejected. *)
let read_file path =
  let channel = open_in_bin path in
  Fun.protect ~finally:(fun () -> close_in channel) (fun () -> really_input_string channel (in_channel_length channel))

let check directory evidence_file =
  let read name = read_file (Filename.concat directory name) in
  let knowledge = Knowledge.knowledge_base (read "knowledge.nt") (read "origin.json") in
  let steps = Knowledge.derivations (read "derivations.json") in
  let { Mission.mission; problem; steps; other_metric } =
    Mission.read ~derive:Derive.steps knowledge steps (Json.json (read "origin.json")) (read "problem.pddl") in
  let plan = if Sys.file_exists (Filename.concat directory "plan.txt") then Reader.plan problem (read "plan.txt") else [] in
  let evidence = Evidence.read problem.action_names (read_file evidence_file) in
  let claim = Reader.claim problem evidence.claim in
  let levels = Knowledge.levels mission.mission_knowledge in
  if Checker.check_mission mission levels steps (Derive.orders mission steps) evidence.ground_task evidence.names evidence.case
       evidence.goal_case evidence.argument evidence.labels_at plan claim
  then begin
    Printf.printf "proved: for the problem that follows from the knowledge base%s: "
      (if other_metric then ", with another metric than the mission's" else "");
    (match claim with
     | Some _ -> Printf.printf "the plan of %d steps is optimal, metric %s\n" (List.length plan) evidence.claim
     | None -> print_endline "there is no plan");
    0
  end
  else (print_endline "not proved"; 30)

(* Names in messages may contain line ends, but only a proved statement may start a line with "proved:". *)
let print_reason message = Printf.printf "rejected: %s\n" (String.map (fun c -> if c < ' ' then ' ' else c) message)

let () =
  match Sys.argv with
  | [| _; directory; evidence_file |] ->
    exit (try check directory evidence_file with
      | Reader.Rejected message | Sys_error message -> print_reason message; 3
      | Stack_overflow -> print_reason "too deep for the stack"; 3
      | error -> print_reason (Printexc.to_string error); 3)
  | _ -> prerr_endline "usage: metaplan-proved-mission CERTIFICATE EVIDENCE"; exit 2
