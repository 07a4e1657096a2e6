(* Checks the certificate of a mission with a knowledge base, with the functions that theorems [mission_optimal] and
   [mission_front] are about. Believed for missions, with mission.ml; for fronts, with front.ml. There is one file of
   evidence, and for a front those of check_front.ml. Exit statuses: 0 proved, 30 not proved, 3 rejected. *)
let check directory evidence_files =
  let read name = Front.read_file (Filename.concat directory name) in
  (* Each file is read once, so that all steps see the same text. *)
  let origin_text = read "origin.json" and problem_text = read "problem.pddl" in
  let knowledge = Knowledge.knowledge_base (read "knowledge.nt") origin_text in
  let derivations = Knowledge.derivations (read "derivations.json") and origin = Json.json origin_text in
  let mission_with metric = Mission.read ~derive:Derive.steps ?metric knowledge derivations origin problem_text in
  let { Mission.mission; problem; steps; other_metric } = mission_with None in
  let levels = Knowledge.levels mission.mission_knowledge and orders = Derive.orders mission steps in
  let statement = "proved: for the problem that follows from the knowledge base" in
  if Sys.file_exists (Filename.concat directory "front.txt") then
    let problem direction item = (mission_with (Some [direction; item])).problem in
    let accepts _ = Checker.check_mission_front mission levels steps orders in
    Front.check ~problem ~accepts ~statement:(statement ^ ": ") read evidence_files
  else
    let plan = if Sys.file_exists (Filename.concat directory "plan.txt") then Reader.plan problem (read "plan.txt") else [] in
    let evidence = match evidence_files with
      | [file] -> Evidence.read problem.action_names (Front.read_file file)
      | _ -> Reader.reject "one file of evidence is expected" in
    let claim = Reader.claim problem evidence.claim in
    if Checker.check_mission mission levels steps orders evidence.ground_task evidence.names evidence.case evidence.goal_case
         evidence.argument evidence.labels_at plan claim
    then begin
      Printf.printf "%s%s: " statement (if other_metric then ", with another metric than the mission's" else "");
      (match claim with
       | Some _ -> Printf.printf "the plan of %d steps is optimal, metric %s\n" (List.length plan) evidence.claim
       | None -> print_endline "there is no plan");
      0
    end
    else (print_endline "not proved"; 30)

(* Names in messages may contain line ends, but only a proved statement may start a line with "proved:". *)
let print_reason message = Printf.printf "rejected: %s\n" (String.map (fun c -> if c < ' ' then ' ' else c) message)

let () =
  match Array.to_list Sys.argv with
  | _ :: directory :: (_ :: _ as evidence_files) ->
    exit (try check directory evidence_files with
      | Reader.Rejected message | Sys_error message -> print_reason message; 3
      | Stack_overflow -> print_reason "too deep for the stack"; 3
      | error -> print_reason (Printexc.to_string error); 3)
  | _ -> prerr_endline "usage: metaplan-proved-mission CERTIFICATE EVIDENCE..."; exit 2
