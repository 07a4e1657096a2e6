(* Compares the semantics of Lifted.v and Timed.v, with their readers, with metaplan's validator: random
   problems and random plans. Every other problem has timed initial literals and no derived predicates. A plan without steps of duration 0 must have the same verdict and metric; a
   valid plan with such steps must be executable with the same metric. *)
module C = Checker
module R = Reader

let usage = "usage: semantics METAPLAN PROBLEMS SEED KEPT_DIRECTORY"

let pick items = List.nth items (Random.int (List.length items))
let chance percent = Random.int 100 < percent
let form name parts = "(" ^ String.concat " " (name :: parts) ^ ")"
let several most make = List.init (1 + Random.int most) (fun _ -> make ())

(* Random PDDL. The scope lists variables; every object and variable has type t or a subtype. *)

let kinds = ["t"; "t1"; "t2"]
let objects = ["o1"; "o2"; "o3"; "c"]
(* A new variable, or one that shadows another. *)
let variable scope = if scope <> [] && chance 30 then pick scope else "?v" ^ string_of_int (List.length scope)
let term scope = pick (objects @ scope @ scope)

let rec expression depth scope timed =
  let deeper () = expression (depth - 1) scope timed in
  match Random.int (if depth = 0 then 6 else 11) with
  | 0 | 1 -> pick ["0"; "1"; "1"; "2"; "0.5"; "-1"]
  | 2 -> "(f)"
  | 3 | 4 -> form "g" [term scope]
  | 5 -> if timed then "?duration" else if chance 50 then "(u)" else "(f)"
  | 6 | 7 -> form "+" [deeper (); deeper ()]
  | 8 -> form "-" (deeper () :: (if chance 70 then [deeper ()] else []))
  | 9 -> form "*" [deeper (); deeper ()]
  | _ -> form "/" [deeper (); deeper ()]

(* Predicates of atoms in conditions; [derived] of them are derived. *)
let derived = ref 0
let atom scope = match Random.int (4 + !derived) with
  | 4 -> form "d0" [term scope]
  | 5 -> "(d1)"
  | 6 -> form "d2" [term scope; term scope]
  | 0 -> "(a)"
  | 1 -> "(b)"
  | 2 -> form "q" [term scope]
  | _ -> form "r" [term scope; term scope]

let rec condition depth scope timed =
  let deeper scope = condition (depth - 1) scope timed in
  match Random.int (if depth = 0 then 6 else 12) with
  | 0 | 1 | 2 -> atom scope
  | 3 -> form "=" [term scope; term scope]
  | 4 | 5 -> form (pick ["<"; "<="; ">"; ">="; "="]) [expression (Random.int 2) scope timed; expression 0 scope timed]
  | 6 | 7 -> form "not" [deeper scope]
  | 8 -> form "and" (several 3 (fun () -> deeper scope))
  | 9 -> form "or" (several 3 (fun () -> deeper scope))
  | 10 -> form "imply" [deeper scope; deeper scope]
  | _ ->
    let variable = variable scope in
    form (pick ["forall"; "exists"]) ["(" ^ variable ^ " - " ^ pick kinds ^ ")"; deeper (scope @ [variable])]

let changeable scope =
  let number = !derived in
  derived := 0;
  let atom = atom scope in
  derived := number; atom
(* The rules of three derived predicates; the last one is recursive. *)
let rules () =
  let rule head body = form ":derived" [head; body] in
  derived := 0;
  let d0 = rule "(d0 ?x - t)" (condition 2 ["?x"] false) in
  derived := 1;
  let d1 = rule "(d1)" (condition 2 [] false) in
  derived := 2;
  let d2 = rule "(d2 ?x - t ?y - t1)" (condition 1 ["?x"; "?y"] false) in
  let step = rule "(d2 ?x - t ?y - t)" ("(exists (?z - t) (and (d2 ?x ?z) (r ?z ?y)))") in
  derived := 3;
  [d0; d1; d2; step]
let rec effect depth scope timed =
  let deeper scope = effect (depth - 1) scope timed in
  match Random.int (if depth = 0 then 7 else 10) with
  | 0 | 1 -> changeable scope
  | 2 | 3 -> form "not" [changeable scope]
  | 4 -> form "increase" ["(total-cost)"; pick ["1"; "2"; "0.5"]]
  | 5 | 6 -> form (pick ["increase"; "decrease"; "assign"]) [pick ["(f)"; "(u)"; form "g" [term scope]]; expression 1 scope timed]
  | 7 -> form "and" (several 3 (fun () -> deeper scope))
  | 8 -> form "when" [condition 1 scope timed; deeper scope]
  | _ ->
    let variable = variable scope in
    form "forall" ["(" ^ variable ^ " - " ^ pick kinds ^ ")"; deeper (scope @ [variable])]

let action i =
  let scope = List.filteri (fun j _ -> j < Random.int 3) ["?x"; "?y"] in
  let parameters = "(" ^ String.concat " " (List.map (fun name -> name ^ " - " ^ pick kinds) scope) ^ ")" in
  let name = Printf.sprintf "act%d :parameters %s" i parameters in
  if chance 50 then
    form ":action" [name; ":precondition"; condition 2 scope false; ":effect"; form "and" (several 3 (fun () -> effect 2 scope false))]
  else
    let duration = if chance 60 then pick ["1"; "2.5"; "0"] else expression 1 scope false in
    let timed_condition () = match Random.int 3 with
      | 0 -> form "at start" [condition 1 scope true]
      | 1 -> form "over all" [condition 1 scope true]
      | _ -> form "at end" [condition 1 scope true] in
    let timed_effect () = form (pick ["at start"; "at end"]) [effect 1 scope true] in
    form ":durative-action" [name; ":duration"; form "=" ["?duration"; duration]; ":condition"; form "and" (several 3 timed_condition);
                             ":effect"; form "and" (several 4 timed_effect)]

let domain timed =
  let rules = if timed then (derived := 0; []) else rules () in
  form "define" ([
    "(domain d)"; "(:requirements :adl :numeric-fluents :durative-actions)"; "(:types t1 t2 - t)"; "(:constants c - t)";
    "(:predicates (a) (b) (q ?x - t) (r ?x ?y - t) (d0 ?x - t) (d1) (d2 ?x ?y - t))"; "(:functions (total-cost) (f) (u) (g ?x - t))"; ] @ rules @ [action 0; action 1; action 2])
let event_time () = pick ["0"; "0.5"; "1"; "1"; "2"; "2"; "2.5"; "3"; "3"; "4"; "5.25"; "6"]
let problem timed =
  let event () =
    let atom = changeable [] in
    form "at" [event_time (); if chance 50 then atom else form "not" [atom]] in
  let events = if timed then several 6 event else [] in
  let maybe text = if chance 50 then text else "" in
  let value name = if chance 20 then "" else (form "=" [name; pick ["0"; "1"; "1"; "2"; "0.5"; "-1"]]) in
  form "define" [
    "(problem p)"; "(:domain d)"; "(:objects o1 o2 - t1 o3 - t2)";
    form ":init" (["(= (total-cost) 0)"; maybe "(a)"; maybe "(b)"; value "(f)"] @ List.map (fun o -> value (form "g" [o])) objects
                  @ List.map (fun o -> maybe (form "q" [o])) objects @ List.map (fun o -> maybe (form "r" [o; pick objects])) objects
                  @ events);
    form ":goal" [if chance 75 then "(or (a) (not (a)))" else condition 2 [] false];
    form ":metric" ["minimize"; pick ["(total-cost)"; "(+ (total-cost) (* 2 (total-time)))"; "(total-time)"; "(+ (total-cost) (f))"]]]

(* Random plans: mostly of steps that can be executed *)

let plan problem =
  let steps = List.concat (List.mapi (fun i action ->
      List.map (fun env -> R.nat i, action, env) (C.instances problem (fun _ -> false) action.C.parameters [])) problem.C.actions) in
  let rec extend length world =
    if length = 0 then []
    else
      let successors = List.filter_map (fun (i, action, env) ->
          Option.map (fun (world, _) -> (i, env), world) (C.step problem true (C.derived_world problem world) action env)) steps in
      if successors = [] || chance 5 then
        let i, _, env = pick steps in
        (i, env) :: extend (length - 1) world
      else
        let step, world = pick successors in
        step :: extend (length - 1) world in
  if steps = [] then [] else extend (Random.int 5) (C.initial problem)

let plan_text ?(starts = []) problem plan =
  let name_of = Hashtbl.create 20 in
  List.iter (fun name -> Hashtbl.replace name_of (R.object_key name) name) problem.R.object_names;
  let rec position = function C.O -> 0 | C.S n -> 1 + position n in
  let start i = match List.nth_opt starts i with Some n -> Printf.sprintf "%d.%02d: " (n / 4) (n mod 4 * 25) | None -> "" in
  String.concat "" (List.mapi (fun position_in_plan (i, env) ->
      start position_in_plan ^ form (List.nth problem.R.action_names (position i)) (List.map (Hashtbl.find name_of) env) ^ "\n") plan)

(* With timed initial literals: steps with start times, most of which are multiples of 0.25 that are not before the end of
   the step before *)
let quarter n = R.decimal (Printf.sprintf "%d.%02d" (n / 4) (n mod 4 * 25))
let timed_plan problem events =
  let steps = List.concat (List.mapi (fun i action ->
      List.map (fun env -> R.nat i, action, env) (C.instances problem (fun _ -> false) action.C.parameters [])) problem.C.actions) in
  let quarters = List.init 40 Fun.id in
  let rec extend length world now =
    if length = 0 then []
    else
      let possible = List.filter (fun n -> C.qle_bool now (quarter n)) quarters in
      let few = List.filteri (fun i _ -> i < 12) possible in
      if few = [] then []
      else
        let starts = if chance 50 then [List.hd few] else few in
        let successors = List.concat_map (fun start ->
            List.filter_map (fun (i, action, env) ->
              Option.map (fun (world, d) -> (start, (i, env)), world, C.qred (C.qplus (quarter start) d))
                (C.timed_step problem events true world now (quarter start) action env)) steps) starts in
        if successors = [] || chance 8 then
          let i, _, env = pick steps in
          let start = pick few in
          (start, (i, env)) :: extend (length - 1) world (quarter start)     (* the validator sorts steps by start times *)
        else
          let step, world, now = pick successors in
          step :: extend (length - 1) world now in
  if steps = [] then [] else extend (Random.int 5) (C.initial problem) R.zero

(* Verdicts: the metric of a valid plan, or none *)

let metric_of problem = function
  | Some (world, spent) -> C.final_metric problem world spent
  | None -> None
let verdict zero problem plan = match C.execute problem zero (C.initial problem) R.zero plan with
  | Some (world, spent) -> C.final_metric problem world spent
  | None -> None

let write_file path text =
  let channel = open_out_bin path in
  Fun.protect ~finally:(fun () -> close_out channel) (fun () -> output_string channel text)

type answer = Valid of C.q | Invalid | Unread

(* The validator rounds a metric that is no decimal. *)
let tolerance = R.decimal ("0." ^ String.make 29 '0' ^ "1")
let equal value other =
  C.qle_bool (C.qminus value other) tolerance && C.qle_bool (C.qminus other value) tolerance

(* The validator's first line is "valid, metric M, ..." for a valid plan. *)
let validate program directory =
  let answer = Filename.concat directory "answer" in
  let file name = Filename.quote (Filename.concat directory name) in
  let status = Sys.command (Printf.sprintf "%s validate %s %s %s > %s 2>&1" (Filename.quote program) (file "domain.pddl")
                              (file "problem.pddl") (file "plan.txt") (Filename.quote answer)) in
  let channel = open_in_bin answer in
  let lines = String.split_on_char '\n' (really_input_string channel (in_channel_length channel)) in
  close_in channel;
  let valid = List.find_map (fun line -> match String.split_on_char ' ' line with
      | "valid," :: "metric" :: value :: _ -> Some (List.hd (String.split_on_char ',' value))
      | _ -> None) lines in
  match status, valid with
  | 0, Some value -> Valid (R.fraction value)
  | 0, None -> Unread
  | 1, _ | 30, _ | 20, _ | 10, _ -> Invalid
  | _ -> Unread

let () =
  match Sys.argv with
  | [| _; metaplan; count; seed; kept |] ->
    Random.init (int_of_string seed);
    ignore (Sys.command ("mkdir -p " ^ Filename.quote kept));
    let timed_valid = ref 0 and valid = ref 0 and invalid = ref 0 and unread = ref 0 and zero = ref 0 and different = ref 0 in
    for i = 1 to int_of_string count do
      let timed = i mod 2 = 0 in
      let domain_text = domain timed in
      let problem_text = problem timed in
      let timed_literals = ref [] in
      let problem = R.problem ~timed_literals domain_text problem_text in
      let pddl, events = if timed then Timed.task_with_events problem !timed_literals else problem.R.task, [] in
      for j = 1 to 3 do
        let starts, plan = if timed then List.split (timed_plan pddl events) else [], plan pddl in
        let text = plan_text ~starts problem plan in
        let directory = Filename.concat kept (Printf.sprintf "%s-%d-%d" seed i j) in
        ignore (Sys.command ("mkdir -p " ^ Filename.quote directory));
        write_file (Filename.concat directory "domain.pddl") domain_text;
        write_file (Filename.concat directory "problem.pddl") problem_text;
        write_file (Filename.concat directory "plan.txt") text;
        let verdict zero =
          if not timed then verdict zero pddl plan
          else metric_of pddl (C.timed_execute pddl events zero (C.initial pddl) R.zero R.zero (List.combine (Timed.start_times text) plan)) in
        let strict = verdict false and lenient = verdict true in
        let agrees = match validate metaplan directory with
          | Unread -> incr unread; true
          | Valid value -> incr valid; if timed then incr timed_valid; if strict = None then incr zero; (match lenient with Some other -> equal value other | None -> false)
          | Invalid -> incr invalid; strict = None in
        if agrees then ignore (Sys.command ("rm -r " ^ Filename.quote directory)) else incr different
      done
    done;
    Printf.printf "seed %s: %d valid plans (%d with steps of duration 0, %d with timed initial literals), %d invalid, %d not read by metaplan; %d verdicts differ\n"
      seed !valid !zero !timed_valid !invalid !unread !different;
    exit (if !different = 0 then 0 else 1)
  | _ -> prerr_endline usage; exit 2
