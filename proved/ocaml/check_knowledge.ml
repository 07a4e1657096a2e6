(* Checks the derivations of a certificate with the function that theorem [knowledge] is about. Believed for
   knowledge bases, with knowledge.ml. Exit statuses: 0 proved, 30 not proved, 3 rejected. *)
let read_file path =
  let channel = open_in_bin path in
  Fun.protect ~finally:(fun () -> close_in channel) (fun () -> really_input_string channel (in_channel_length channel))

let check directory =
  let read name = read_file (Filename.concat directory name) in
  let knowledge_base = Knowledge.knowledge_base (read "knowledge.nt") (read "origin.json") in
  let steps = Knowledge.derivations (read "derivations.json") in
  if Checker.check_derivations knowledge_base (Knowledge.levels knowledge_base) steps then begin
    let facts = List.sort_uniq compare (List.map fst steps) in
    let is_derived (_, reason) = reason <> Checker.Stated in
    let derived = List.sort_uniq compare (List.map fst (List.filter is_derived steps)) in
    Printf.printf "proved: exactly the %d facts hold, %d of them by rules\n" (List.length facts) (List.length derived);
    0
  end
  else (print_endline "not proved"; 30)

(* Names in messages may contain line ends, but only a proved statement may start a line with "proved:". *)
let print_reason message = Printf.printf "rejected: %s\n" (String.map (fun c -> if c < ' ' then ' ' else c) message)

let () =
  match Sys.argv with
  | [| _; directory |] ->
    exit (try check directory with
      | Reader.Rejected message | Sys_error message -> print_reason message; 3
      | error -> print_reason (Printexc.to_string error); 3)
  | _ -> prerr_endline "usage: metaplan-proved-knowledge CERTIFICATE"; exit 2
