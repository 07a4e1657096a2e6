(* Changes the files of a certificate at random, and compares what metaplan-verify and the proved
   checker answer. Keeps the certificates that only one of them accepts. The formula and the
   knowledge base are left out: the proved checker does not read them. If the claim is that
   there is no plan, an exhaustive search decides whether it is true. *)
module R = Reader

let usage = "usage: differential METAPLAN_VERIFY CERTIFICATE COUNT SEED KEPT_DIRECTORY"

let read_file path =
  let channel = open_in_bin path in
  Fun.protect ~finally:(fun () -> close_in channel) (fun () -> really_input_string channel (in_channel_length channel))
let write_file path text =
  let channel = open_out_bin path in
  Fun.protect ~finally:(fun () -> close_out channel) (fun () -> output_string channel text)

let random_item items = List.nth items (Random.int (List.length items))

(* Changes of text that has integers and strings, such as JSON: replaces one by another, or an
   integer by a near one. *)
let mutate_tokens text =
  let length = String.length text in
  let rec tokens position =
    if position >= length then []
    else match text.[position] with
      | '"' ->
        let stop = String.index_from text (position + 1) '"' + 1 in
        (position, String.sub text position (stop - position)) :: tokens stop
      | '-' | '0' .. '9' ->
        let stop = ref (position + 1) in
        while !stop < length && text.[!stop] >= '0' && text.[!stop] <= '9' do incr stop done;
        (position, String.sub text position (!stop - position)) :: tokens !stop
      | _ -> tokens (position + 1) in
  let tokens = tokens 0 in
  let position, token = random_item tokens in
  let replacement = match int_of_string_opt token with
    | Some n when Random.int 3 > 0 -> string_of_int (n + random_item [-100; -10; -2; -1; 1; 2; 10; 100])
    | _ -> snd (random_item (List.filter (fun (_, other) -> (other.[0] = '"') = (token.[0] = '"')) tokens)) in
  let after = position + String.length token in
  String.sub text 0 position ^ replacement ^ String.sub text after (length - after)

let rec text_of = function
  | R.Word word -> word
  | R.List items -> "(" ^ String.concat " " (List.map text_of items) ^ ")"
let rec subexpressions item = item :: (match item with R.List items -> List.concat_map subexpressions items | R.Word _ -> [])

let mutate_pddl text =
  let expressions = R.expressions text in
  let places = List.concat_map subexpressions expressions in
  let words = List.filter (function R.Word _ -> true | R.List _ -> false) places in
  let lists = List.filter (function R.List _ -> true | R.Word _ -> false) places in
  let target = if Random.bool () then random_item words else random_item lists in
  let replacement = match target with
    | R.Word word when R.is_number word && Random.int 3 > 0 -> [R.Word (random_item ["0"; "1"; "2"; "3"; "0.5"; "7"; "100"; "1000"])]
    | R.Word _ -> [random_item words]
    | R.List items -> (match Random.int 5 with
        | 0 -> []
        | 1 -> [target; target]
        | 2 -> [R.List [R.Word "not"; target]]
        | 3 -> [R.List (List.rev items)]
        | _ -> [random_item lists]) in
  let rec change item =
    if item == target then replacement
    else match item with R.List items -> [R.List (List.concat_map change items)] | R.Word _ -> [item] in
  String.concat "\n" (List.map text_of (List.concat_map change expressions))

let mutate_plan text =
  let lines = String.split_on_char '\n' text in
  match Random.int 3 with
  | 0 -> String.concat "\n" (List.filteri (let removed = Random.int (List.length lines) in fun i _ -> i <> removed) lines)
  | 1 -> String.concat "\n" (List.concat (List.mapi (let doubled = Random.int (List.length lines) in fun i line ->
      if i = doubled then [line; line] else [line]) lines))
  | _ -> mutate_pddl text

let files = ["domain.pddl", mutate_pddl; "problem.pddl", mutate_pddl; "plan.txt", mutate_plan; "task.json", mutate_tokens;
             "argument.json", mutate_tokens; "witness.json", mutate_tokens]

let run command = match Sys.command command with n -> n
let quote = Filename.quote

(* The claimed metric; none if the claim is that there is no plan. *)
let claim certificate =
  let manifest = read_file (Filename.concat certificate "manifest.json") in
  let rec find marker position =
    if position + String.length marker > String.length manifest then None
    else if String.sub manifest position (String.length marker) = marker then Some (position + String.length marker)
    else find marker (position + 1) in
  match find "\"metric\": \"" 0 with
  | Some start -> Some (String.sub manifest start (String.index_from manifest start '"' - start))
  | None when find "\"unsolvable\"" 0 <> None -> None
  | None -> failwith "the manifest has no claim"

let write_manifest directory files metric =
  let entry (name, _) =
    let path = Filename.concat directory name in
    let digest_file = path ^ ".sha256" in
    ignore (run (Printf.sprintf "sha256sum < %s > %s" (quote path) (quote digest_file)));
    let digest = String.sub (read_file digest_file) 0 64 in
    Sys.remove digest_file;
    Printf.sprintf {|{"name": "%s", "bytes": %d, "sha256": "%s"}|} name (String.length (read_file path)) digest in
  write_file (Filename.concat directory "manifest.json")
    (Printf.sprintf {|{"format": "metaplan-certificate/3", "claim": %s, "refutation": {"none": "left out"},
  "files": [%s]}|} (match metric with Some metric -> Printf.sprintf {|{"optimal": {"metric": "%s"}}|} metric | None -> {|"unsolvable"|})
       (String.concat ",\n" (List.map entry files)))

(* The judge of the claim that there is no plan. *)
let exhaustive_answer directory =
  let read name = read_file (Filename.concat directory name) in
  let timed_literals = ref [] in
  match R.problem ~timed_literals (read "domain.pddl") (read "problem.pddl") with
  | exception R.Rejected _ -> "not read"
  | problem when !timed_literals <> [] ->
    (match Timed.task_with_events problem !timed_literals with
     | exception R.Rejected _ -> "not read"
     | task, events ->
       let plans zero = Exhaustive.timed_plans zero 3 task events (R.decimal "0.001") () in
       if plans false <> Seq.Nil then "plan" else if plans true <> Seq.Nil then "unclear" else "too large")
  | problem ->
    match Exhaustive.search false 5000 problem, Exhaustive.search true 5000 problem with
    | Exhaustive.Plan _, _ -> "plan"
    | _, Exhaustive.No_plan -> "no plan"
    | Exhaustive.No_plan, Exhaustive.Plan _ -> "unclear"     (* start and end of a step of duration 0 may interfere *)
    | Exhaustive.Too_large, _ | _, Exhaustive.Too_large -> "too large"

let () =
  match Sys.argv with
  | [| program; verify; certificate; count; seed; kept |] ->
    Random.init (int_of_string seed);
    let programs = Filename.dirname program in
    let work = Filename.temp_file "differential" "" in
    Sys.remove work;
    ignore (run (Printf.sprintf "mkdir -p %s %s" (quote work) (quote kept)));
    let metric = claim certificate in
    let files = if metric = None then List.filter (fun (name, _) -> name <> "plan.txt") files else files in
    let counts = Hashtbl.create 10 and judged = Hashtbl.create 4 in
    let increment counts case = Hashtbl.replace counts case (1 + Option.value ~default:0 (Hashtbl.find_opt counts case)) in
    let copy () = List.iter (fun (name, _) -> write_file (Filename.concat work name) (read_file (Filename.concat certificate name))) files in
    (* What the two checkers accept. *)
    let verdicts metric =
      write_manifest work files metric;
      let outputs = Filename.concat work "answer" and evidence = Filename.concat work "evidence" in
      let rust = run (Printf.sprintf "%s %s > %s 2>&1" (quote verify) (quote work) (quote (outputs ^ "-verify"))) in
      let prepared = run (Printf.sprintf "%s/metaplan-proved-prepare %s > %s 2> %s" (quote programs) (quote work) (quote evidence) (quote (outputs ^ "-prepare"))) in
      let proved =
        if prepared <> 0 then 1
        else run (Printf.sprintf "timeout 100 %s/metaplan-proved-check %s %s > %s 2>&1" (quote programs) (quote work) (quote evidence) (quote (outputs ^ "-check"))) in
      rust = 0, proved = 0 in
    copy ();
    if verdicts metric <> (true, true) then failwith "not both checkers accept the unchanged certificate";
    for i = 1 to int_of_string count do
      copy ();
      let mutated = random_item files in
      let path = Filename.concat work (fst mutated) in
      write_file path (snd mutated (read_file path));
      let case = verdicts (if Random.int 8 = 0 then Option.map mutate_tokens metric else metric) in
      if fst case <> snd case then
        ignore (run (Printf.sprintf "cp -r %s %s" (quote work)
          (quote (Filename.concat kept (Printf.sprintf "%s-%s-%d-%s" (if fst case then "verify" else "check") seed i (fst mutated))))));
      increment counts case;
      if metric = None then begin
        let answer = exhaustive_answer work and accepted = case <> (false, false) in
        increment judged (accepted, answer);
        if accepted && answer = "plan" || snd case && answer = "unclear" then begin
          Printf.printf "accepted although there is a plan: %s\n" work; exit 1
        end
      end
    done;
    ignore (run (Printf.sprintf "rm -r %s" (quote work)));
    let of_case counts case = Option.value ~default:0 (Hashtbl.find_opt counts case) in
    let count = of_case counts in
    Printf.printf "%s, seed %s: both accept %d, both reject %d, only metaplan-verify accepts %d, only the proved checker accepts %d\n"
      certificate seed (count (true, true)) (count (false, false)) (count (true, false)) (count (false, true));
    if metric = None then
      List.iter (fun accepted ->
        let count answer = of_case judged (accepted, answer) in
        Printf.printf "%s: there is a plan for %d, there is no plan for %d, unclear %d, too large %d, not read %d\n"
          (if accepted then "accepted by a checker" else "rejected by both") (count "plan") (count "no plan") (count "unclear") (count "too large")
          (count "not read")) [true; false]
  | _ -> prerr_endline usage; exit 2
