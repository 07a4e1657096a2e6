(* Checks certificates for a Pareto front with the function that theorem [front_optimal] is about.
   Believed, with reader.ml and front.ml. The directory has the files domain.pddl, problem.pddl, front.txt, and
   I/plan.txt for each point I, counted from 1. There is one file of evidence for each point, and one more.
   Exit statuses: 0 proved, 30 not proved, 3 rejected. *)
let check directory evidence_files =
  let read name = Front.read_file (Filename.concat directory name) in
  let problem direction item = Reader.problem ~metric:[direction; item] (read "domain.pddl") (read "problem.pddl") in
  let accepts first = Checker.check_front first.Reader.task in
  Front.check ~problem ~accepts ~statement:"proved: " read evidence_files

let () =
  match Array.to_list Sys.argv with
  | _ :: directory :: (_ :: _ as evidence_files) ->
    exit (try check directory evidence_files with
      | Reader.Rejected message | Sys_error message -> Printf.printf "rejected: %s\n" message; 3
      | Stack_overflow -> print_endline "rejected: too deep for the stack"; 3
      | error -> Printf.printf "rejected: %s\n" (Printexc.to_string error); 3)
  | _ -> prerr_endline "usage: metaplan-proved-front DIRECTORY EVIDENCE..."; exit 2
