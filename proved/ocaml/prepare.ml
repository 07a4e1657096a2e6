(* Turns a certificate of format 3 into the evidence that check.ml reads, and finds the case trees.
   Not believed: a mistake in this file makes the checker reject, and cannot make it accept a false
   claim. *)
module C = Checker
module R = Reader

open Json

(* The items of a field, which may be absent. *)
let items object_ name = match optional object_ name with Some item -> array item | None -> []
let nth list i = match List.nth_opt list i with Some item -> item | None -> R.reject "JSON: no position %d" i

(* Text of the evidence *)

let list write items = "(" ^ String.concat " " (List.rev (List.rev_map write items)) ^ ")"
let pair write_first write_second item = match array item with
  | [first; second] -> "(" ^ write_first first ^ " " ^ write_second second ^ ")"
  | _ -> R.reject "JSON: a pair is expected"
let numbers item = list number (array item)
let fact = pair number number
let literal = pair fact (function Bool holds -> string_of_bool holds | _ -> R.reject "JSON: true or false is expected")
let quantity tables item =
  let table item = match array item with
    | [slots; i] -> "(" ^ numbers slots ^ " " ^ numbers (nth tables (int i)) ^ ")"
    | _ -> R.reject "JSON: a table is expected" in
  "(" ^ number (field item "constant") ^ " " ^ list table (items item "tables") ^ ")"
let linear tables item = "(" ^ list (pair number number) (items item "factors") ^ " " ^ quantity tables (field item "quantity") ^ ")"
let condition tables item =
  Printf.sprintf "(%s %s %s)" (list fact (items item "facts"))
    (list (fun clause -> list literal (array clause)) (items item "clauses"))
    (list (linear tables) (items item "comparisons"))

let task_text task =
  let variables = array (field task "variables") and tables = array (field task "tables") in
  let sizes = List.map (fun values -> List.length (array values)) variables in
  let basic = int (field task "basic") in
  let derived = List.filteri (fun i _ -> i >= basic) (List.mapi (fun i size -> Printf.sprintf "(%d %d)" i (size - 1)) sizes) in
  let exclusion item = "(" ^ numbers (field item "slots") ^ " " ^ list numbers (items item "combinations") ^ ")" in
  let operator item =
    let designs = array (nth (array (field task "uses")) (int (field item "uses"))) in
    let sizes = list (fun use -> match array use with
      | [_; suitable] -> string_of_int (List.length (array suitable))
      | _ -> R.reject "JSON: a slot is expected") designs in
    let conditional item = "(" ^ list literal (items item "condition") ^ " " ^ list fact (items item "effects") ^ ")" in
    Printf.sprintf "(%s %s %s %s %s %s %s)\n" sizes
      (list exclusion (array (nth (array (field task "exclusions")) (int (field item "exclusions")))))
      (condition tables (field item "condition")) (list fact (items item "effects")) (list conditional (items item "conditional"))
      (list (pair number (linear tables)) (items item "changes")) (quantity tables (field item "cost")) in
  let layer item = list (pair fact (condition tables)) (items item "rules") in
  Printf.sprintf "(task %d %s %s %s %s\n%s\n%s %s)\n" basic (list Fun.id derived) (list string_of_int sizes)
    (numbers (field task "values")) (numbers (field task "numbers")) (list operator (array (field task "operators")))
    (list layer (array (field task "axioms"))) (condition tables (field task "goal"))

let argument_text argument =
  let bounds item = list (function Null -> "infinite" | item -> number item) (array (field item "values")) in
  let potential item = Printf.sprintf "(%s %s)\n" (numbers (field item "pattern")) (bounds item) in
  let need item = Printf.sprintf "(%s %s %s)\n" (number (field item "number")) (numbers (field item "pattern")) (bounds item) in
  let label item = match array item with
    | [values; amounts; paid] -> Printf.sprintf "(%s %s %s)\n" (numbers values) (numbers amounts) (number paid)
    | _ -> R.reject "JSON: a label is expected" in
  Printf.sprintf "(argument %s %s %s)\n" (list potential (items argument "potentials")) (list need (items argument "needs"))
    (list label (items argument "labels"))

(* Names of keys, without the word that says what the key is for. *)
let names_of_keys () =
  let names = Hashtbl.create 1000 in
  Hashtbl.iter (fun name key ->
    let space = String.index name ' ' in
    Hashtbl.replace names key (String.sub name 0 space, String.sub name (space + 1) (String.length name - space - 1))) R.keys;
  names

(* The derived atoms that may hold, if the atoms of the witness may hold and may not hold. *)
let derivable problem names witness =
  let pddl = problem.R.task in
  let key (p, arguments) = p :: arguments in
  let possible = Hashtbl.create 1000 in
  List.iter (fun atom -> Hashtbl.replace possible (key atom) ()) witness;
  let is_derived p = C.is_derived pddl p in
  let is_changing p = is_derived p || List.mem p names in
  let rec may wanted env = function
    | C.Truth b -> b = wanted
    | C.Atom (p, terms) -> (match C.ground env terms with
        | None -> false
        | Some arguments when is_changing p -> not wanted || Hashtbl.mem possible (p :: arguments)
        | Some arguments -> (C.find_atom pddl.C.initial_atoms (p, arguments) <> None) = wanted)
    | C.Same (t, u) -> (match C.object_of env t, C.object_of env u with Some a, Some b -> (a = b) = wanted | _ -> false)
    | C.Compare _ -> true
    | C.Not f -> may (not wanted) env f
    | C.And (f, g) -> if wanted then may true env f && may true env g else may false env f || may false env g
    | C.Forall (kind, f) ->
      let test o = may wanted (env @ [o]) f in
      if wanted then List.for_all test (pddl.C.objects kind) else List.exists test (pddl.C.objects kind) in
  let derived = ref [] in
  List.iter (fun rules ->
    let rec rounds instances =
      let is_new, others = List.partition (fun ((_, env), body) -> may true env body) instances in
      List.iter (fun (atom, _) ->
        if not (Hashtbl.mem possible (key atom)) then (Hashtbl.replace possible (key atom) (); derived := atom :: !derived)) is_new;
      if is_new <> [] then rounds others in
    rounds (C.rule_instances pddl rules)) pddl.C.strata;
  List.rev !derived

(* The ranges of numbers in the witness, as invariants. *)
let ranges witness =
  let fluent name = match R.expressions name with
    | [R.List [R.Word "-"; _]] | [] -> R.reject "a fluent is expected"
    | _ -> name in
  List.concat_map (fun item -> match array item with
    | [String name; least; most] ->
      let bound factor sign = function
        | Null -> []
        | value -> [Printf.sprintf "(false ((%s %s)) %s)" (fluent name) factor (sign (string value))] in
      let negated value = if value.[0] = '-' then String.sub value 1 (String.length value - 1) else "-" ^ value in
      bound "1" negated least @ bound "-1" Fun.id most
    | _ -> R.reject "a range is expected") (items witness "numbers")

let names_text (changing_predicates, changing_functions) invariants equivalent problem task witness =
  let names = names_of_keys () in
  let heads_of_effects =
    List.concat_map (fun action -> C.effect_heads action.C.start_effect @ C.effect_heads action.C.end_effect) problem.R.task.C.actions in
  let heads = heads_of_effects @ List.map (fun rule -> rule.C.head) (List.concat problem.R.task.C.strata) in
  let heads what = List.sort_uniq compare (List.filter_map (fun key ->
      let kind, name = Hashtbl.find names key in if kind = what then Some name else None) heads) in
  let basic = int (field task "basic") in
  let variable i values =
    let last = List.length (array values) - 1 in
    let atoms = List.mapi (fun x atom -> x, string atom) (array values) in
    Printf.sprintf "(%d %s)\n" i (list (fun (x, atom) -> Printf.sprintf "(%d %s)" x atom) (List.filter (fun (x, _) -> x < last) atoms)) in
  let variables = List.filteri (fun i _ -> i < basic) (List.mapi variable (array (field task "variables"))) in
  let fluents = List.mapi (fun i fluent -> Printf.sprintf "(%d %s)" i (string fluent)) (array (field task "fluents")) in
  let derived_variable i values =
    let last = List.length (array values) - 1 in
    (* Variables for parts of conditions have no atom. *)
    let is_atom x atom = x < last && (string atom).[0] = '(' in
    List.mapi (fun x atom -> x, atom) (array values) |> List.filter (fun (x, atom) -> is_atom x atom)
    |> List.map (fun (x, atom) -> Printf.sprintf "(%d ((%d %d) %s))" i x last (string atom)) in
  let derived = List.concat (List.filteri (fun i _ -> i >= basic) (List.mapi derived_variable (array (field task "variables")))) in
  let read_atom text = Evidence.atom (List.hd (R.expressions text)) in
  let changing = List.filter (fun key -> fst (Hashtbl.find names key) = "predicate") heads_of_effects in
  let may_hold = List.map string (items witness "atoms") in
  let name key = snd (Hashtbl.find names key) in
  let derivable = List.map (fun (p, arguments) -> list name (p :: arguments)) (derivable problem changing (List.map read_atom may_hold)) in
  let group item = list string (array item) in
  Printf.sprintf "(names %s %s %s %s %s %s %b %s %s %s %s)\n" (list Fun.id variables) (list Fun.id fluents)
    (list Fun.id (List.sort_uniq compare (heads "predicate" @ changing_predicates))) (list Fun.id (heads "function" @ changing_functions)) (list Fun.id (may_hold @ derivable)) (list Fun.id derived) equivalent (list Fun.id invariants) (list group (items witness "exclusive"))
    (number (field task "number_scale")) (number (field (field task "objective") "scale"))

let integer_text number =
  let rec decimal = function    (* digits, the least first *)
    | C.XH -> [1]
    | C.XO p -> double 0 (decimal p)
    | C.XI p -> double 1 (decimal p)
  and double carry = function
    | [] -> if carry = 0 then [] else [carry]
    | digit :: others -> let n = 2 * digit + carry in (n mod 10) :: double (n / 10) others in
  let text p = String.concat "" (List.rev_map string_of_int (decimal p)) in
  match number with C.Z0 -> "0" | C.Zpos p -> text p | C.Zneg p -> "-" ^ text p
let fraction_text q = integer_text q.C.qnum ^ "/" ^ integer_text (C.Zpos q.C.qden)

let tree_text names tree =
  let name key = snd (Hashtbl.find names key) in
  let atom (head, arguments) = list name (head :: arguments) in
  let rec nat = function C.O -> 0 | C.S n -> 1 + nat n in
  let rec text = function
    | C.Decided None -> "(nothing)"
    | C.Decided (Some (i, choice)) -> Printf.sprintf "(operator %d %s)" (nat i) (list integer_text choice)
    | C.Impossible -> "(impossible)"
    | C.SplitAtom (a, yes, no) -> Printf.sprintf "(atom %s %s %s)" (atom a) (text yes) (text no)
    | C.SplitForm ((terms, constant), yes, no) ->
      Printf.sprintf "(form %s %s %s %s)" (list (fun (fluent, q) -> Printf.sprintf "(%s %s)" (atom fluent) (fraction_text q)) terms)
        (fraction_text constant) (text yes) (text no) in
  text tree

(* Case trees *)

type split = Atom of C.atom | Form of C.form

(* Atoms and linear forms on which a formula or an effect depends. *)
let splits_of problem names duration =
  let visited = Hashtbl.create 20 in
  let rec formula env = function
    | C.Truth _ | C.Same _ -> []
    | C.Atom (p, terms) -> (match C.ground env terms with
        | Some arguments when names.C.changing p -> Atom (p, arguments) :: bodies (p, arguments)
        | _ -> [])
    | C.Compare (_, a, b) -> (match C.symbolic_expression problem names C.unchanged duration env (C.Minus (a, b)) with
        | C.Is ((_ :: _, _) as form) -> [Form form]
        | _ -> [])
    | C.Not f -> formula env f
    | C.And (f, g) -> formula env f @ formula env g
    | C.Forall (kind, f) -> List.concat_map (fun o -> formula (env @ [o]) f) (problem.C.objects kind)
  (* What the rules of a derived atom without a variable depend on. *)
  and bodies atom =
    if Hashtbl.mem visited atom || not (C.is_derived problem (fst atom)) || C.find_atom names.C.derived_of atom <> None then []
    else begin
      Hashtbl.replace visited atom ();
      List.concat_map (fun rule -> if C.is_rule_of problem atom rule then formula (snd atom) rule.C.body else [])
        (List.concat problem.C.strata)
    end in
  let rec effect env = function
    | C.Nothing | C.Put _ | C.Change _ -> []
    | C.Both (a, b) -> effect env a @ effect env b
    | C.When (f, a) -> formula env f @ effect env a
    | C.Each (kind, a) -> List.concat_map (fun o -> effect (env @ [o]) a) (problem.C.objects kind) in
  formula, effect

(* Atoms that the values of a ground condition stand for. *)
let splits_of_condition names condition =
  let atom (v, x) = match C.M.find v names.C.variables with
    | Some atoms -> (match List.assoc_opt x atoms with Some atom -> [Atom atom] | None -> List.map (fun (_, atom) -> Atom atom) atoms)
    | None -> (match C.M.find v names.C.derived_atoms with Some ((_, _), atom) -> [Atom atom] | None -> []) in
  List.concat_map atom (condition.C.facts @ List.map fst (List.concat condition.C.clauses))

exception No_tree
exception No_invariant of string

let max_splits = 14

(* A tree whose leaves [leaf] accepts: tries the candidates, and splits on what is not known. *)
let search problem task names leaf candidates splits knowledge =
  let rec tree depth (knowledge : C.knowledge) =
    match List.find_opt (leaf knowledge) candidates with
    | Some candidate -> C.Decided candidate
    | None when C.contradictory problem task names knowledge -> C.Impossible
    | None when depth = max_splits -> raise No_tree
    | None ->
      let negated form = C.plus_form (C.constant R.zero) { C.qnum = C.Zneg C.XH; qden = C.XH } form in
      let is_open = function
        | Atom atom -> C.base_truth problem task names knowledge atom = None
        | Form form -> not (C.implied knowledge false form) && not (C.implied knowledge true (negated form)) in
      match List.find_opt is_open splits with
      | None -> raise No_tree
      | Some (Atom atom) ->
        let known holds = tree (depth + 1) { knowledge with C.literals = (atom, holds) :: knowledge.C.literals } in
        C.SplitAtom (atom, known true, known false)
      | Some (Form form) ->
        let known strict form = tree (depth + 1) { knowledge with C.bounds = (strict, form) :: knowledge.C.bounds } in
        C.SplitForm (form, known false form, known true (negated form)) in
  tree 0 knowledge

(* The name of the action of operators that wait for a timed initial literal; no PDDL action has a blank in its name. *)
let wait = " wait"

(* Operators of an action with their arguments: an object, or the objects that may fill a slot. *)
let operators_by_action task =
  let name item = String.lowercase_ascii (string item) in
  let objects = Array.of_list (List.map name (array (field task "objects"))) in
  let slots = List.map (fun slot -> List.map (fun i -> objects.(int i)) (array slot)) (array (field task "slots")) in
  let designs = List.map (fun uses -> List.map (fun use -> match array use with
      | [slot; suitable] -> List.map (fun i -> nth (nth slots (int slot)) (int i)) (array suitable)
      | _ -> R.reject "JSON: a slot is expected") (array uses)) (array (field task "uses")) in
  let schemas = List.map name (array (field task "schemas")) in
  let by_action = Hashtbl.create 100 in
  List.iteri (fun i operator ->
    let uses = nth designs (int (field operator "uses")) in
    let arguments = List.map (fun argument -> match optional argument "object", optional argument "slot" with
        | Some o, _ -> `Object (objects.(int o))
        | _, Some slot -> `Slot (int slot)
        | _ -> R.reject "JSON: an argument is expected") (array (field operator "arguments")) in
    match List.nth_opt schemas (int (field operator "schema")) with
    | Some name -> Hashtbl.add by_action name (i, arguments, uses)
    | None -> Hashtbl.add by_action wait (i, arguments, uses)) (array (field task "operators"));
  by_action

(* The choice for which an operator is the instance with these arguments. *)
let choice_for arguments uses instance =
  let rec position i name = function [] -> None | other :: others -> if other = name then Some i else position (i + 1) name others in
  let choices = Array.make (List.length uses) None in
  let matches argument name = match argument with
    | `Object other -> other = name
    | `Slot slot -> choices.(slot) <- position 0 name (List.nth uses slot); choices.(slot) <> None in
  if List.length arguments = List.length instance && List.for_all2 matches arguments instance
  then Some (List.map (fun choice -> R.integer (Option.value ~default:0 choice)) (Array.to_list choices)) else None

let claim_text manifest = match field manifest "claim" with
  | String "unsolvable" -> "unsolvable"
  | claim -> string (field (field claim "optimal") "metric")

(* Atoms on which the preconditions and conditional effects of operators depend. *)
let splits_of_operators ground_task names candidates =
  List.concat_map (function
    | Some (i, _) -> (match C.nth_error ground_task.C.operators i with
        | Some operator ->
          splits_of_condition names operator.C.precondition
          @ List.concat_map (fun (literals, _) ->
              splits_of_condition names { C.facts = List.map fst literals; clauses = []; comparisons = [] }) operator.C.conditional
        | None -> [])
    | None -> []) candidates

(* Comparisons in the preconditions of operators. *)
let forms_of_operators ground_task names candidates =
  let forms = List.concat_map (function
    | Some (i, choice) -> (match C.nth_error ground_task.C.operators i with
        | Some operator ->
          List.filter_map (fun linear -> C.form_of names linear operator.C.slot_sizes choice) operator.C.precondition.C.comparisons
        | None -> [])
    | None -> []) candidates in
  List.map (fun form -> Form form) (List.sort_uniq compare forms)

(* A common multiple of denominators *)
let common_multiple = List.fold_left (fun multiple q ->
  let reduced = C.qred { C.qnum = C.Zpos multiple; qden = q.C.qden } in
  C.Z.to_pos (C.Z.mul reduced.C.qnum (C.Zpos q.C.qden))) C.XH

(* The names of the atoms for phases and waits and of the clock in the ground task cannot be read; these cannot be in
   a PDDL file. *)
let rename_times text =
  let replace (old, renamed) text = String.concat renamed (
    let rec parts start i =
      if i + String.length old > String.length text then [String.sub text start (String.length text - start)]
      else if String.sub text i (String.length old) = old
      then let next = i + String.length old in String.sub text start (i - start) :: parts next next
      else parts start (i + 1) in
    parts 0 0) in
  List.fold_right replace ["\"(the phase ", "\"(#phase "; "\"(has waited)\"", "\"(#waited)\""; "\"(the clock)\"", "\"(#clock)\""] text

(* Start times of a plan. A written time may be rounded down, to less than the end of the step before. *)
let exact_starts task events starts plan =
  let rec exact world now = function
    | [] -> []
    | (written, (i, env)) :: others ->
      let start = if C.qle_bool now written then written else now in
      start :: match Option.bind (C.nth_error task.C.actions i) (fun action -> C.timed_step task events true world now start action env) with
        | Some (next, d) -> exact next (C.qred (C.qplus start d)) others
        | None -> List.map fst others in
  exact (C.initial task) R.zero (List.combine starts plan)

(* The case trees of the passages of all instances, and of the waits *)
let timed_cases output keys task events timeline ground_task names by_action action_names =
  let pddl = C.extended task events timeline in
  (* Values that a variable cannot have because their atoms never hold, for example in a task without waits *)
  let never = List.concat_map (fun (_, atoms) -> List.map snd atoms) (C.M.elements names.C.variables)
              |> List.filter (fun atom -> C.base_truth pddl ground_task names { C.literals = []; bounds = [] } atom = Some false) in
  let search leaf candidates splits knowledge =
    let knowledge = { knowledge with C.literals = List.map (fun atom -> atom, false) never @ knowledge.C.literals } in
    let tree = search pddl ground_task names leaf candidates splits knowledge in
    List.fold_left (fun tree atom -> C.SplitAtom (atom, C.Impossible, tree)) tree never in
  Printf.bprintf output "(passages";
  List.iter2 (fun name action ->
    let instances = C.instances pddl (fun env -> C.static_false pddl names env action.C.at_start) action.C.parameters [] in
    List.iter (fun env ->
      let objects = List.map (fun key -> snd (Hashtbl.find keys key)) env in
      let instance = String.concat " " (name :: objects) in
      let candidates = List.filter_map (fun (i, arguments, uses) ->
          Option.map (fun choice -> Some (R.nat i, choice)) (choice_for arguments uses objects)) (List.rev (Hashtbl.find_all by_action name)) in
      match C.fixed_duration task events names timeline action env with
      | None -> R.reject "not covered: a duration that changes: (%s)" instance
      | Some None -> ()
      | Some (Some (_, q)) when C.less q R.zero -> ()
      | Some (Some (d, q)) ->
        let formula, effect = splits_of pddl names d in
        let splits = formula env action.C.at_start @ formula env action.C.over_all @ formula env action.C.at_end
                     @ effect env action.C.start_effect @ effect env action.C.end_effect
                     @ splits_of_operators ground_task names candidates @ forms_of_operators ground_task names candidates @ [Atom timeline.C.waited] in
        List.iter (fun passage ->
          if C.feasible events passage q then
            match search (C.timed_leaf task events ground_task names timeline action env passage d q) (candidates @ [None]) splits
                    (C.start_knowledge task events names timeline action env passage d q) with
            | C.Decided None -> ()
            | tree ->
              let rec int = function C.O -> 0 | C.S n -> 1 + int n in
              let ((a, b), c), e = passage in
              Printf.bprintf output "\n((%s) %s %s)" instance (list (fun n -> string_of_int (int n)) [a; b; c; e]) (tree_text keys tree)
            | exception No_tree -> raise (No_invariant instance)) (C.passages events)) instances)
    action_names task.C.actions;
  Printf.bprintf output ")\n(waits";
  let candidates = List.rev_map (fun (i, _, uses) -> Some (R.nat i, List.map (fun _ -> C.Z0) uses)) (Hashtbl.find_all by_action wait) in
  List.iteri (fun i event ->
    let knowledge = C.with_invariants names { C.literals = [List.nth timeline.C.phase_atoms i, true]; bounds = [] } in
    match search (C.wait_leaf task events ground_task names timeline (R.nat i) event) (candidates @ [None])
            (splits_of_operators ground_task names candidates) knowledge with
    | tree -> Printf.bprintf output "\n%s" (tree_text keys tree)
    | exception No_tree -> raise (No_invariant "a wait")) events;
  Buffer.add_string output ")\n"

(* The evidence with these invariants *)
let prepare_with invariants_of directory =
  let output = Buffer.create 100000 in
  let read name =
    let channel = open_in_bin (Filename.concat directory name) in
    Fun.protect ~finally:(fun () -> close_in channel) (fun () -> really_input_string channel (in_channel_length channel)) in
  let timed_literals = ref [] in
  let problem = R.problem ~timed_literals (read "domain.pddl") (read "problem.pddl") in
  let is_timed = !timed_literals <> [] in
  let timed_task, events = if is_timed then Timed.task_with_events problem !timed_literals else problem.R.task, [] in
  let read_json name = json (if is_timed then rename_times (read name) else read name) in
  let task = read_json "task.json" in
  let argument = argument_text (json (read "argument.json")) in
  let claim_and_task = "(claim " ^ claim_text (json (read "manifest.json")) ^ ")\n" ^ task_text task in
  let witness = read_json "witness.json" in
  let keys = names_of_keys () in
  let changed_by_events = List.concat_map (fun event -> List.map (fun ((p, _), _) -> snd (Hashtbl.find keys p)) event.C.sets) events in
  let changing = if is_timed then "#phase" :: "#waited" :: changed_by_events, ["#clock"] else [], [] in
  let clock_range = if is_timed then ["(false (((#clock) 1)) 0)"] else [] in
  let with_names equivalent =
    let others = claim_and_task ^ names_text changing (clock_range @ invariants_of witness) equivalent problem task witness in
    others, Evidence.read problem.R.action_names (others ^ "(argument () () ()) (goal-case (nothing)) (cases)") in
  let follows (_, evidence) =
    let task = evidence.Evidence.ground_task in
    fst (C.ground_rules_ok problem.R.task task evidence.names task.C.layers) in
  let equivalent = with_names true in
  let others, evidence = if follows equivalent then equivalent else with_names false in
  let ground_task = evidence.Evidence.ground_task and names = evidence.Evidence.names in
  let timeline =
    let atom text = Evidence.atom (List.hd (R.expressions text)) in
    let timeline = { C.grid = C.XH; phase_atoms = List.init (List.length events + 1) (fun i -> atom (Printf.sprintf "(#phase phase %d)" i));
                     waited = atom "(#waited)"; clock = Evidence.fluent (List.hd (R.expressions "(#clock)")) } in
    let durations = if not is_timed then [] else
      List.concat_map (fun action ->
        List.filter_map (fun env -> match C.fixed_duration timed_task events names timeline action env with
          | Some (Some (_, q)) -> Some q
          | Some None | None -> None)
          (C.instances timed_task (fun env -> C.static_false timed_task names env action.C.at_start) action.C.parameters [])) timed_task.C.actions in
    { timeline with C.grid = common_multiple (List.map (fun event -> event.C.time) events @ durations) } in
  let pddl = if is_timed then C.extended timed_task events timeline else problem.R.task in
  let keys = names_of_keys () in
  let rules = C.ground_rules ground_task in
  List.iteri (fun stratum here -> List.iter (fun ((p, arguments), body) ->
    if not (C.rule_ok pddl ground_task names (R.nat stratum) rules ((p, arguments), body)) then
      let name key = snd (Hashtbl.find keys key) in
      R.reject "not covered: no rule of the task is found for the derived atom %s" (list name (p :: arguments)))
    (C.rule_instances pddl here)) pddl.C.strata;
  let search = search pddl ground_task names in
  let formula_splits, _ = splits_of pddl names C.Undefined in
  let goal_case =
    try search (C.goal_leaf pddl ground_task names) [None]
        (formula_splits [] pddl.C.goal_formula @ splits_of_condition names ground_task.C.goal)
        (C.with_invariants names (C.conjuncts pddl names C.unchanged C.Undefined [] pddl.C.goal_formula))
    with No_tree -> R.reject "no case tree is found for the goal" in
  Buffer.add_string output others;
  Buffer.add_string output argument;
  Printf.bprintf output "(goal-case %s)\n" (tree_text keys goal_case);
  let by_action = operators_by_action task in
  if is_timed then begin
    let atom (head, arguments) = list (fun key -> snd (Hashtbl.find keys key)) (head :: arguments) in
    Printf.bprintf output "(timeline %s %s %s %s)\n" (integer_text (C.Zpos timeline.C.grid)) (list atom timeline.C.phase_atoms)
      (atom timeline.C.waited) (atom timeline.C.clock);
    if Sys.file_exists (Filename.concat directory "plan.txt") then begin
      let text = read "plan.txt" in
      let starts = exact_starts timed_task events (Timed.start_times text) (R.plan problem text) in
      Printf.bprintf output "(starts %s)\n" (String.concat " " (List.map fraction_text starts))
    end;
    timed_cases output keys timed_task events timeline ground_task names by_action problem.R.action_names
  end;
  if not is_timed && Hashtbl.mem by_action wait then R.reject "not covered: waiting";
  Buffer.add_string output "(cases";
  if not is_timed then List.iter2 (fun name action ->
    let instances = C.instances pddl (C.pruned pddl names action) action.C.parameters [] in
    List.iter (fun env ->
      let objects = List.map (fun key -> snd (Hashtbl.find keys key)) env in
      let candidates = List.filter_map (fun (i, arguments, uses) ->
          Option.map (fun choice -> Some (R.nat i, choice)) (choice_for arguments uses objects)) (Hashtbl.find_all by_action name) in
      let formula, effect = splits_of pddl names (C.symbolic_duration pddl names action env) in
      let splits = formula env action.C.at_start @ formula env action.C.over_all @ formula env action.C.at_end
                   @ effect env action.C.start_effect @ effect env action.C.end_effect @ splits_of_operators ground_task names candidates in
      match search (C.instance_leaf pddl ground_task names action env) (candidates @ [None]) splits
              (C.with_invariants names (C.gathered pddl ground_task names action env)) with
      | C.Decided None -> ()
      | tree -> Printf.bprintf output "\n((%s) %s)" (String.concat " " (name :: objects)) (tree_text keys tree)
      | exception No_tree -> raise (No_invariant (String.concat " " (name :: objects)))) instances)
    problem.R.action_names pddl.C.actions;
  Buffer.add_string output ")\n";
  output

(* Most tasks need no ranges of numbers. *)
let prepare directory =
  print_string (Buffer.contents (
    try prepare_with (fun _ -> []) directory
    with No_invariant _ -> prepare_with ranges directory))

let () =
  match Sys.argv with
  | [| _; directory |] -> (try prepare directory with
    | R.Rejected message -> prerr_endline ("rejected: " ^ message); exit 3
    | No_invariant instance -> prerr_endline ("rejected: no case tree is found for (" ^ instance ^ ")"); exit 3)
  | _ -> prerr_endline "usage: metaplan-proved-prepare CERTIFICATE > EVIDENCE"; exit 2
