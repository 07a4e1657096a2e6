(* Checks a certificate with the function that theorem [optimal] is about, or with timed.ml if there
   are timed initial literals. Believed. Exit statuses:
   0 proved, 30 not proved, 3 rejected. *)
let read_file path =
  let channel = open_in_bin path in
  Fun.protect ~finally:(fun () -> close_in channel) (fun () -> really_input_string channel (in_channel_length channel))

let check directory evidence_file =
  let read name = read_file (Filename.concat directory name) in
  let timed_literals = ref [] in
  let problem = Reader.problem ~timed_literals (read "domain.pddl") (read "problem.pddl") in
  if !timed_literals <> [] then Timed.check problem !timed_literals read (read_file evidence_file) else
  let plan = if Sys.file_exists (Filename.concat directory "plan.txt") then Reader.plan problem (read "plan.txt") else [] in
  let evidence = Evidence.read problem.Reader.action_names (read_file evidence_file) in
  let claim = Reader.claim problem evidence.Evidence.claim in
  if not (Checker.check_certificate problem.Reader.task evidence.ground_task evidence.names evidence.case evidence.goal_case
            evidence.argument evidence.labels_at plan claim)
  then (print_endline "not proved"; 30)
  else begin
    (match claim with
     | Some _ -> Printf.printf "proved: the plan of %d steps is optimal, metric %s\n" (List.length plan) evidence.claim
     | None -> print_endline "proved: there is no plan");
    0
  end

let () =
  match Sys.argv with
  | [| _; directory; evidence_file |] ->
    exit (try check directory evidence_file with
      | Reader.Rejected message -> Printf.printf "rejected: %s\n" message; 3
      | Stack_overflow -> print_endline "rejected: too deep for the stack"; 3
      | Sys_error message -> Printf.printf "rejected: %s\n" message; 3
      | error -> Printf.printf "rejected: %s\n" (Printexc.to_string error); 3)
  | _ -> prerr_endline "usage: metaplan-proved-check CERTIFICATE EVIDENCE"; exit 2
