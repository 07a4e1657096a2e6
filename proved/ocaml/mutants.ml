(* Changes evidence at random and offers it for false statements: none may be accepted. As a
   control, the same evidence is offered for the true statement. Prints the seed, and a mutant that
   was accepted wrongly. *)
module C = Checker
module R = Reader

let rec text = function
  | R.Word word -> word
  | R.List items -> "(" ^ String.concat " " (List.map text items) ^ ")"

let random_item items = List.nth items (Random.int (List.length items))
let rec subexpressions item = item :: (match item with R.List items -> List.concat_map subexpressions items | R.Word _ -> [])

(* Applies a change at one random place below a list. *)
let rec at_random_place change item = match item with
  | R.List (_ :: _ as items) when Random.int 6 > 0 ->
    let place = Random.int (List.length items) in
    R.List (List.mapi (fun i item -> if i = place then at_random_place change item else item) items)
  | item -> change item

let shifted delta word = match int_of_string_opt word with Some n -> string_of_int (n + delta) | None -> word
let rec shift_all delta = function
  | R.Word word -> R.Word (shifted delta word)
  | R.List items -> R.List (List.map (shift_all delta) items)

let is_integer word = int_of_string_opt word <> None
let is_integer_item = function R.Word word -> is_integer word | R.List _ -> false

(* Replaces the integer at one random place, by a near one or by another of the section. *)
let mutate_integer integers item =
  let target = Random.int (List.length integers) and place = ref (-1) in
  let rec change = function
    | R.Word word when is_integer word ->
      incr place;
      if !place <> target then R.Word word
      else if Random.int 4 = 0 then random_item integers
      else R.Word (shifted (random_item [-100; -10; -2; -1; 1; 2; 10; 100]) word)
    | R.Word word -> R.Word word
    | R.List items -> R.List (List.map change items) in
  change item

let mutate_structure other_places item = match item, Random.int 5 with
  | R.List (_ :: items), 0 -> R.List items
  | R.List (first :: items), 1 -> R.List (first :: first :: items)
  | R.List items, 2 -> R.List (List.rev items)
  | R.List _, 3 -> shift_all (random_item [-10; -1; 1; 10; 100; 204]) item
  | _ -> random_item other_places

let mutate_section section =
  let places = subexpressions section in
  match List.filter is_integer_item places, section with
  | (_ :: _ as integers), _ when Random.int 3 > 0 -> mutate_integer integers section
  | _, R.List (name :: parts) ->
    (match at_random_place (mutate_structure places) (R.List parts) with
     | R.List parts -> R.List (name :: parts)
     | R.Word _ -> section)
  | _, (R.Word _ | R.List []) -> section

let mutate sections =
  let rec repeat n sections =
    if n = 0 then sections else
      let place = 1 + Random.int (List.length sections - 1) in          (* section 0 is the claim *)
      repeat (n - 1) (List.mapi (fun i section -> if i = place then mutate_section section else section) sections) in
  repeat (1 + Random.int 3) sections

type statement = { name : string; holds : Evidence.t -> bool }

let statement name problem plan claim =
  let holds (evidence : Evidence.t) =
    C.check_certificate problem evidence.ground_task evidence.names evidence.case evidence.goal_case evidence.argument
      evidence.labels_at plan claim in
  { name; holds }

(* The metric of a plan, if it can be executed. *)
let metric problem plan = match C.execute problem false (C.initial problem) R.zero plan with
  | Some (world, spent) -> C.final_metric problem world spent
  | None -> None

(* Plans that begin with one or two more steps; not all of them can be executed to the end. *)
let longer_plans problem plan =
  let steps = List.concat (List.mapi (fun i action ->
      List.map (fun env -> i, action, env) (C.instances problem (fun _ -> false) action.C.parameters [])) problem.C.actions) in
  let successors world = List.filter_map (fun (i, action, env) ->
      Option.map (fun (world, _) -> (R.nat i, env), world) (C.step problem false (C.derived_world problem world) action env)) steps in
  let extend (prefix, world) = List.map (fun (step, world) -> prefix @ [step], world) (successors world) in
  let once = extend ([], C.initial problem) in
  List.map (fun (prefix, _) -> prefix @ plan) (once @ List.concat_map extend once)

(* False statements: a longer plan with a greater metric is optimal; there is no plan; and the
   original claim where one more action reaches the goal for nothing. *)
let false_statements problem plan best =
  let worse = List.find_map (fun plan -> match metric problem plan with
      | Some value when not (C.qle_bool value best) -> Some (statement "a worse plan" problem plan (Some value))
      | _ -> None) (longer_plans problem plan) in
  let rec goal_effect = function
    | C.Atom (p, terms) -> Some (C.Put (true, p, terms))
    | C.And (f, g) -> (match goal_effect f, goal_effect g with Some a, Some b -> Some (C.Both (a, b)) | _ -> None)
    | _ -> None in
  let shortcut = match goal_effect problem.C.goal_formula with
    | Some effect when not (C.qle_bool best R.zero) ->
      let truth = C.Truth true in
      let action = { C.parameters = []; duration = None; at_start = truth; start_effect = effect; over_all = truth; at_end = truth;
                     end_effect = C.Nothing } in
      [statement "a shortcut to the goal" { problem with C.actions = problem.C.actions @ [action] } plan (Some best)]
    | _ -> [] in
  Option.to_list worse @ [statement "no plan" problem [] None] @ shortcut

(* Changed problems that have a plan, as the exhaustive search shows: that there is no plan is false for
   them. One more action reaches the goal, an action has no condition or other effects, one more atom
   holds initially, a number is 1000, or the goal is one atom. *)
let solvable_problems (problem : R.problem) =
  let pddl = problem.task in
  let truth = C.Truth true in
  let rec positive_atoms = function
    | C.Atom (p, terms) -> [p, terms]
    | C.And (f, g) -> positive_atoms f @ positive_atoms g
    | _ -> [] in
  let goal_atoms = positive_atoms pddl.C.goal_formula in
  let reach_goal = List.fold_left (fun effect (p, terms) -> C.Both (effect, C.Put (true, p, terms))) C.Nothing goal_atoms in
  let shortcut = { C.parameters = []; duration = None; at_start = truth; start_effect = reach_goal; over_all = truth; at_end = truth;
                   end_effect = C.Nothing } in
  let changed_action i action = { pddl with C.actions = List.mapi (fun j other -> if i = j then action else other) pddl.C.actions } in
  let changed_actions = List.concat (List.mapi (fun i action ->
      changed_action i { action with C.at_start = truth }
      :: changed_action i { action with C.over_all = truth; at_end = truth }
      :: List.filter_map (fun (other : C.action) ->
          if List.length other.parameters > List.length action.C.parameters then None
          else Some (changed_action i { action with C.start_effect = other.start_effect; end_effect = other.end_effect }))
        pddl.C.actions) pddl.C.actions) in
  let objects = List.map R.object_key problem.object_names in
  let more_atoms = List.concat_map (fun (is_number, p, n) ->
      if is_number then [] else List.map (fun arguments ->
          { pddl with C.initial_atoms = C.add_atom (p, arguments) () pddl.C.initial_atoms }) (Exhaustive.tuples objects n))
      (Exhaustive.changed_heads pddl) in
  let greater_numbers = List.map (fun (f, _) ->
      { pddl with C.initial_values = C.add_atom f (R.decimal "1000") pddl.C.initial_values }) (C.all_entries pddl.C.initial_values) in
  let easier_goals = List.map (fun (p, terms) -> { pddl with C.goal_formula = C.Atom (p, terms) }) goal_atoms in
  let candidates = { pddl with C.actions = pddl.C.actions @ [shortcut] } :: changed_actions @ more_atoms @ greater_numbers @ easier_goals in
  List.filter (fun task -> match Exhaustive.search true 2000 { problem with task } with
      | Exhaustive.Plan _ -> true
      | Exhaustive.No_plan | Exhaustive.Too_large -> false) candidates

(* Statements about a task with timed initial literals *)
let timed_statement name problem events plan claim =
  let holds (evidence : Evidence.t) =
    C.check_timed problem events evidence.ground_task evidence.names evidence.timeline evidence.passage_case evidence.wait_case
      evidence.goal_case evidence.argument evidence.labels_at plan claim in
  { name; holds }

(* Changed tasks: an event is missing, earlier or later, or one of its literals is missing or negated; an action has a
   condition, an effect or its duration less; one more atom holds initially; one more action reaches the goal; or the
   goal is one atom. *)
let changed_timed_tasks (problem : R.problem) pddl events =
  let truth = C.Truth true in
  let rec positive_atoms = function
    | C.Atom (p, terms) -> [p, terms]
    | C.And (f, g) -> positive_atoms f @ positive_atoms g
    | _ -> [] in
  let goal_atoms = positive_atoms pddl.C.goal_formula in
  let each change items = List.concat (List.mapi (fun i item ->
      List.map (fun changed -> List.concat (List.mapi (fun j other -> if i = j then changed else [other]) items)) (change item)) items) in
  let in_order events =
    let rec ordered = function
      | { C.time; _ } :: ({ C.time = next; _ } :: _ as others) -> not (C.qle_bool next time) && ordered others
      | _ -> true in
    ordered (List.filter (fun { C.time; _ } -> not (C.qle_bool time R.zero)) events) in
  let change_event { C.time; sets } =
    [] :: List.map (fun delta -> [{ C.time = C.qred (C.qplus time (R.decimal delta)); sets }]) ["-2"; "-0.5"; "1"; "5"]
    @ List.map (fun sets -> [{ C.time; sets }]) (each (fun (atom, holds) -> [[]; [atom, not holds]]) sets) in
  let change_action action =
    [ [{ action with C.at_start = truth }]; [{ action with C.over_all = truth }]; [{ action with C.at_end = truth }];
      [{ action with C.start_effect = C.Nothing }]; [{ action with C.end_effect = C.Nothing }];
      [{ action with C.duration = Option.map (fun _ -> C.Constant (R.decimal "0.5")) action.C.duration }] ] in
  let reach_goal = List.fold_left (fun effect (p, terms) -> C.Both (effect, C.Put (true, p, terms))) C.Nothing goal_atoms in
  let shortcut = { C.parameters = []; duration = None; at_start = truth; start_effect = reach_goal; over_all = truth; at_end = truth;
                   end_effect = C.Nothing } in
  let objects = List.map R.object_key problem.R.object_names in
  let more_atoms = List.concat_map (fun (is_number, p, n) ->
      if is_number then [] else List.map (fun arguments ->
          { pddl with C.initial_atoms = C.add_atom (p, arguments) () pddl.C.initial_atoms }) (Exhaustive.tuples objects n))
      (Exhaustive.changed_heads pddl) in
  List.map (fun actions -> { pddl with C.actions }, events)
    ((pddl.C.actions @ [shortcut]) :: each change_action pddl.C.actions)
  @ List.map (fun task -> task, events)
    (more_atoms @ List.map (fun (p, terms) -> { pddl with C.goal_formula = C.Atom (p, terms) }) goal_atoms)
  @ List.map (fun events -> pddl, events) (List.filter in_order (each change_event events))

let rec first n seq = if n = 0 then [] else match seq () with Seq.Nil -> [] | Seq.Cons (item, others) -> item :: first (n - 1) others

(* False statements: a plan is optimal, where the search finds a better one, or there is no plan, where it finds one. *)
let false_timed_statements problem pddl events plan claim =
  let moment = R.decimal "0.001" and max_steps = max 2 (List.length plan) in
  let plans (task, events) = Exhaustive.timed_plans true max_steps task events moment in
  let is_better value (_, other) = not (C.qle_bool value other) in
  let about name (task, events) =
    let plans = plans (task, events) in
    let no_plan = if first 1 plans = [] then [] else [timed_statement (name ^ ": no plan") task events [] None] in
    let same_plan = match claim, C.timed_execute task events false (C.initial task) R.zero R.zero plan with
      | Some _, Some (world, spent) -> (match C.final_metric task world spent with
          | Some value when first 1 (Seq.filter (is_better value) plans) <> [] -> [timed_statement (name ^ ": the same plan") task events plan (Some value)]
          | _ -> [])
      | _ -> [] in
    no_plan @ same_plan in
  let worse = match claim with
    | None -> []
    | Some best ->
      let strict = Exhaustive.timed_plans false (max_steps + 1) pddl events moment in
      first 3 (Seq.filter (fun (_, value) -> not (C.qle_bool value best)) strict)
      |> List.map (fun (plan, value) -> timed_statement "a worse plan" pddl events plan (Some value)) in
  worse @ about "the original task" (pddl, events) @ List.concat_map (about "a changed task") (changed_timed_tasks problem pddl events)

let read_file path =
  let channel = open_in_bin path in
  Fun.protect ~finally:(fun () -> close_in channel) (fun () -> really_input_string channel (in_channel_length channel))

let () =
  let directory = Sys.argv.(1) and count = int_of_string Sys.argv.(3) and seed = int_of_string Sys.argv.(4) in
  Random.init seed;
  let read name = read_file (Filename.concat directory name) in
  let timed_literals = ref [] in
  let problem = R.problem ~timed_literals (read "domain.pddl") (read "problem.pddl") in
  let evidence_text = read_file Sys.argv.(2) in
  let names = problem.R.action_names @ ["shortcut"] in
  let original = Evidence.read names evidence_text in
  let claim = R.claim problem original.claim in
  let plan_text = if claim = None then "" else read "plan.txt" in
  let plan = R.plan problem plan_text in
  let true_statement, false_statements =
    if !timed_literals <> [] then
      let pddl, events = Timed.task_with_events problem !timed_literals in
      let plan = List.combine original.Evidence.starts plan in
      timed_statement "the true statement" pddl events plan claim, false_timed_statements problem pddl events plan claim
    else
      statement "the true statement" problem.R.task plan claim, match claim with
      | Some best -> false_statements problem.R.task plan best
      | None -> List.map (fun problem -> statement "no plan of a solvable problem" problem [] None) (solvable_problems problem) in
  if not (true_statement.holds original) then failwith "the certificate itself is not accepted";
  if false_statements = [] then failwith "there is no false statement";
  let sections = R.expressions evidence_text in
  let unreadable = ref 0 and true_accepted = ref 0 and true_rejected = ref 0 in
  for _ = 1 to count do
    let mutant = String.concat "\n" (List.map text (mutate sections)) in
    match Evidence.read names mutant with
    | exception (R.Rejected _ | Failure _ | Invalid_argument _ | Not_found) -> incr unreadable
    | evidence ->
      if true_statement.holds evidence then incr true_accepted else incr true_rejected;
      List.iter (fun statement ->
        if statement.holds evidence then begin
          Printf.printf "accepted for a false statement (%s), seed %d:\n%s\n" statement.name seed mutant; exit 1
        end) false_statements
  done;
  Printf.printf "seed %d: %d mutants, %d of them unreadable; %d accepted and %d not accepted for the true statement; none of them accepted for %s\n"
    seed count !unreadable !true_accepted !true_rejected (if !timed_literals <> [] then Printf.sprintf "%d false statements" (List.length false_statements) else match claim with
      | Some _ -> String.concat ", " (List.map (fun s -> s.name) false_statements)
      | None -> Printf.sprintf "%d solvable problems" (List.length false_statements))
