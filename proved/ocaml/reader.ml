(* Reads PDDL files and a plan as values of Lifted.v. This file is believed: it decides which
   problem the theorem is about. Constructs without a meaning in Lifted.v are rejected by name. *)
module C = Checker

exception Rejected of string
let reject format = Printf.ksprintf (fun message -> raise (Rejected message)) format

(* Numbers *)

let rec positive n =
  if n = 1 then C.XH else if n land 1 = 0 then C.XO (positive (n / 2)) else C.XI (positive (n / 2))
let rec nat n = if n = 0 then C.O else C.S (nat (n - 1))
let integer n = if n = 0 then C.Z0 else if n > 0 then C.Zpos (positive n) else C.Zneg (positive (-n))
let zero = { C.qnum = C.Z0; qden = C.XH }
let one = { C.qnum = integer 1; qden = C.XH }

let is_number text =
  let is_digit c = '0' <= c && c <= '9' in
  let digits text = text <> "" && String.for_all is_digit text in
  let unsigned = if text <> "" && text.[0] = '-' then String.sub text 1 (String.length text - 1) else text in
  match String.split_on_char '.' unsigned with
  | [whole] -> digits whole
  | [whole; fraction] -> digits whole && digits fraction
  | _ -> false

(* A decimal, such as -2.50, in lowest terms. *)
let decimal text =
  if not (is_number text) then reject "not a decimal: %s" text;
  let ten = integer 10 in
  let numerator = ref C.Z0 and denominator = ref (integer 1) and after_point = ref false in
  String.iter (function
    | '-' -> ()
    | '.' -> after_point := true
    | digit ->
      numerator := C.Z.add (C.Z.mul !numerator ten) (integer (Char.code digit - Char.code '0'));
      if !after_point then denominator := C.Z.mul !denominator ten) text;
  let numerator = if text.[0] = '-' then C.Z.mul (integer (-1)) !numerator else !numerator in
  C.qred { C.qnum = numerator; qden = C.Z.to_pos !denominator }

(* A decimal or a fraction, such as 7/2. *)
let fraction text = match String.split_on_char '/' text with
  | [numerator; denominator] ->
    let n = decimal numerator and d = decimal denominator in
    (match n.C.qden, d.C.qden, d.C.qnum with
     | C.XH, C.XH, C.Zpos qden -> C.qred { C.qnum = n.C.qnum; qden }
     | _ -> reject "not a fraction: %s" text)
  | _ -> decimal text

(* S-expressions *)

type expression = Word of string | List of expression list

(* Nesting limit; OCaml's stack suffices for it. *)
let max_depth = 1000

let expressions text =
  let length = String.length text and position = ref 0 in
  let rec skip_blanks () =
    if !position < length then
      match text.[!position] with
      | ' ' | '\n' | '\t' | '\r' -> incr position; skip_blanks ()
      | ';' -> while !position < length && text.[!position] <> '\n' do incr position done; skip_blanks ()
      | _ -> () in
  let rec list depth items =
    skip_blanks ();
    if depth > max_depth then reject "parentheses nest more than %d deep" max_depth;
    if !position = length then if depth = 0 then List.rev items else reject "a parenthesis is not closed"
    else match text.[!position] with
      | '(' -> incr position; let item = List (list (depth + 1) []) in list depth (item :: items)
      | ')' -> incr position; if depth = 0 then reject "a parenthesis is closed but not opened" else List.rev items
      | _ ->
        let start = !position in
        while !position < length && not (String.contains " \n\t\r();" text.[!position]) do incr position done;
        list depth (Word (String.lowercase_ascii (String.sub text start (!position - start))) :: items) in
  list 0 []

let word = function Word text -> text | List _ -> reject "a name is expected, not a list"
let is_variable name = name <> "" && name.[0] = '?'

(* Names with their types; [object] where none is written. *)
let rec typed = function
  | [] -> []
  | items ->
    let rec split names = function
      | Word "-" :: Word kind :: others -> List.rev names, kind, others
      | Word "-" :: _ -> reject "not covered: either"
      | item :: others -> split (word item :: names) others
      | [] -> List.rev names, "object", [] in
    let names, kind, others = split [] items in
    List.map (fun name -> name, kind) names @ typed others

(* Keys: predicates, functions, types and objects are numbered in one sequence. *)

let keys : (string, C.positive) Hashtbl.t = Hashtbl.create 1000
let key name =
  match Hashtbl.find_opt keys name with
  | Some key -> key
  | None -> let key = positive (Hashtbl.length keys + 1) in Hashtbl.add keys name key; key
let object_key name = key ("object " ^ name)
let type_key name = key ("type " ^ name)
let predicate_key name = key ("predicate " ^ name)
let function_key name = key ("function " ^ name)

let distinct what names =
  List.iteri (fun i name -> if List.mem name (List.filteri (fun j _ -> j < i) names) then reject "%s is declared twice: %s" what name) names

type problem = { task : C.problem; maximizes : bool; action_names : string list; object_names : string list }

let negative q = C.qred (C.qminus zero q)

(* [metric] replaces the metric of the problem: minimize or maximize, and an expression.
   [timed_literals] receives the timed initial literals, the last one first; without it, they are rejected.
   [other_objects] are names of objects without a type. *)
let problem ?metric ?timed_literals ?(other_objects = []) domain_text problem_text =
  let sections kind text = match expressions text with
    | [List (Word "define" :: List [Word other; Word _] :: sections)] when other = kind ->
      List.map (function List (Word name :: items) -> name, items | _ -> reject "a section is expected") sections
    | _ -> reject "(define (%s NAME) ...) is expected" kind in
  let domain = sections "domain" domain_text and problem = sections "problem" problem_text in
  let check_names allowed = List.iter (fun (name, _) -> if not (List.mem name allowed) then reject "not covered: %s" name) in
  check_names [":requirements"; ":types"; ":constants"; ":predicates"; ":functions"; ":derived"; ":action"; ":durative-action"] domain;
  check_names [":domain"; ":requirements"; ":objects"; ":init"; ":goal"; ":metric"] problem;
  let section sections name = match List.filter (fun (other, _) -> other = name) sections with
    | [] -> []
    | [_, items] -> items
    | _ -> reject "%s is written twice" name in

  (* Types and objects *)
  let supertypes = typed (section domain ":types") in
  let types = "object" :: List.concat_map (fun (name, parent) -> [name; parent]) supertypes in
  let rec is_below depth kind other =
    other = "object" || kind = other
    || depth > 0 && List.exists (fun (name, parent) -> name = kind && is_below (depth - 1) parent other) supertypes in
  let known_type name = if List.mem name types then name else reject "unknown type: %s" name in
  let objects = List.sort_uniq compare (typed (section domain ":constants") @ typed (section problem ":objects")) in
  distinct "an object" (List.map fst objects);
  List.iter (fun (_, kind) -> ignore (known_type kind)) objects;
  let members = Hashtbl.create 50 in
  List.iter (fun kind ->
    let is_member (_, own) = is_below (List.length types) own kind in
    Hashtbl.replace members (type_key kind) (List.map (fun (name, _) -> object_key name) (List.filter is_member objects))) types;
  let is_object name = List.mem_assoc name objects || List.mem name other_objects in
  let known_object name = if is_object name then object_key name else reject "unknown object: %s" name in

  let typed_variables =
    let read (name, kind) = if is_variable name then name, type_key (known_type kind) else reject "a variable is expected: %s" name in
    fun items -> List.map read (typed items) in
  let variables items =
    let variables = typed_variables items in
    distinct "a variable" (List.map fst variables); variables in

  (* Predicates and functions with their numbers of arguments *)
  let rec declarations = function
    | List (Word name :: arguments) :: others -> (name, List.length (typed_variables arguments)) :: declarations others
    | Word "-" :: Word "number" :: others -> declarations others
    | Word "-" :: Word kind :: _ -> reject "not covered: functions with values of type %s" kind
    | [] -> []
    | _ -> reject "a declaration is expected" in
  let predicates = declarations (section domain ":predicates") and functions = declarations (section domain ":functions") in
  distinct "a predicate" (List.map fst predicates);
  distinct "a function" (List.map fst functions);
  let derived_names = List.filter_map (function ":derived", List (Word name :: _) :: _ -> Some name | _ -> None) domain in
  let applied what declared name arguments = match List.assoc_opt name declared with
    | Some arity when arity = List.length arguments -> ()
    | Some arity -> reject "%s has %d arguments: %s" what arity name
    | None -> reject "not covered, or unknown as a %s: %s" what name in

  (* Terms, expressions and conditions; the scope lists the variables from the outermost. *)
  let term scope item =
    let name = word item in
    if not (is_variable name) then C.Object (known_object name)
    else
      let rec last found position = function
        | [] -> found
        | other :: others -> last (if other = name then Some position else found) (position + 1) others in
      match last None 0 scope with
      | Some position -> C.Var (nat position)
      | None -> reject "unknown variable: %s" name in
  let rec expression scope = function
    | Word "?duration" -> C.Duration
    | Word text -> C.Constant (decimal text)
    | List [Word "-"; a] -> C.Minus (C.Constant zero, expression scope a)
    | List [Word "-"; a; b] -> C.Minus (expression scope a, expression scope b)
    | List [Word "/"; a; b] -> C.Over (expression scope a, expression scope b)
    | List (Word "+" :: first :: others) ->
      List.fold_left (fun sum item -> C.Plus (sum, expression scope item)) (expression scope first) others
    | List (Word "*" :: first :: others) ->
      List.fold_left (fun product item -> C.Times (product, expression scope item)) (expression scope first) others
    | List (Word name :: arguments) ->
      applied "function" functions name arguments;
      C.Fluent (function_key name, List.map (term scope) arguments)
    | List _ -> reject "an expression is expected" in
  (* Applies [quantify] once for each variable, the first one outermost. *)
  let quantified quantify scope items body =
    let variables = variables items in
    List.fold_right (fun (_, kind) body -> quantify kind body) variables (body (scope @ List.map fst variables)) in
  let for_all kind body = C.Forall (kind, body) and each kind body = C.Each (kind, body) in
  let is_term = function Word name -> (is_variable name && name <> "?duration") || is_object name | List _ -> false in
  let rec condition scope = function
    | List [] -> C.Truth true
    | List (Word "and" :: items) -> conjunction (List.map (condition scope) items)
    | List (Word "or" :: items) -> List.fold_right (fun item other -> C.or0 (condition scope item) other) items (C.Truth false)
    | List [Word "not"; item] -> C.Not (condition scope item)
    | List [Word "imply"; a; b] -> C.imply (condition scope a) (condition scope b)
    | List [Word "forall"; List items; body] -> quantified for_all scope items (fun scope -> condition scope body)
    | List [Word "exists"; List items; body] -> quantified C.exists scope items (fun scope -> condition scope body)
    | List [Word "="; a; b] when is_term a && is_term b -> C.Same (term scope a, term scope b)
    | List [Word "="; a; b] -> C.equal0 (expression scope a) (expression scope b)
    | List [Word ">"; a; b] | List [Word "<"; b; a] -> C.Compare (true, expression scope a, expression scope b)
    | List [Word ">="; a; b] | List [Word "<="; b; a] -> C.Compare (false, expression scope a, expression scope b)
    | List (Word name :: arguments) ->
      applied "predicate" predicates name arguments;
      C.Atom (predicate_key name, List.map (term scope) arguments)
    | _ -> reject "a condition is expected"
  and conjunction = function
    | [] -> C.Truth true
    | [only] -> only
    | first :: others -> C.And (first, conjunction others) in
  let rec effect scope = function
    | List [] -> C.Nothing
    | List (Word "and" :: items) -> both (List.map (effect scope) items)
    | List [Word "when"; a; b] -> C.When (condition scope a, effect scope b)
    | List [Word "forall"; List items; body] ->
      quantified each scope items (fun scope -> effect scope body)
    | List [Word ("increase" | "decrease" | "assign" as change); List (Word name :: arguments); value] ->
      applied "function" functions name arguments;
      let value = expression scope value in
      let value = if change = "decrease" then C.Minus (C.Constant zero, value) else value in
      C.Change (change = "assign", function_key name, List.map (term scope) arguments, value)
    | List [Word "not"; List (Word name :: arguments)] -> put scope false name arguments
    | List (Word name :: arguments) -> put scope true name arguments
    | Word _ | List (List _ :: _) -> reject "an effect is expected"
  and put scope holds name arguments =
    applied "predicate" predicates name arguments;
    if List.mem name derived_names then reject "a derived predicate is in an effect: %s" name;
    C.Put (holds, predicate_key name, List.map (term scope) arguments)
  and both = function
    | [] -> C.Nothing
    | [only] -> only
    | first :: others -> C.Both (first, both others) in

  (* Derived predicates. The stratum of one is that of what it refers to, or the next one if the
     reference is negated. *)
  let derived = List.filter_map (function
    | ":derived", [List (Word name :: parameters); body] ->
      let parameters = variables parameters in
      applied "predicate" predicates name parameters;
      Some (name, { C.head = predicate_key name; head_types = List.map snd parameters; body = condition (List.map fst parameters) body })
    | ":derived", _ -> reject "(:derived (PREDICATE ...) CONDITION) is expected"
    | _ -> None) domain in
  let heads = List.sort_uniq compare (List.map (fun (_, rule) -> rule.C.head) derived) in
  let rec references positive = function
    | C.Atom (p, _) -> [p, positive]
    | C.Not f -> references (not positive) f
    | C.And (f, g) -> references positive f @ references positive g
    | C.Forall (_, f) -> references positive f
    | C.Truth _ | C.Same _ | C.Compare _ -> [] in
  let level = Hashtbl.create 10 in
  let level_of p = Option.value ~default:0 (Hashtbl.find_opt level p) in
  let rec raise_levels rounds =
    if rounds < 0 then reject "a derived predicate depends on its own negation";
    let raised = List.filter (fun (_, rule) ->
      let least (p, positive) = if List.mem p heads then level_of p + (if positive then 0 else 1) else 0 in
      let most = List.fold_left (fun most reference -> max most (least reference)) (level_of rule.C.head) (references true rule.C.body) in
      let is_raised = most > level_of rule.C.head in
      Hashtbl.replace level rule.C.head most; is_raised) derived in
    if raised <> [] then raise_levels (rounds - 1) in
  raise_levels (List.length heads * List.length heads);
  let strata = List.init (List.length heads) (fun i ->
    List.filter_map (fun (_, rule) -> if level_of rule.C.head = i then Some rule else None) derived) in

  (* The parts at start, over all and at end of what a durative action requires or does. *)
  let rec timed times read join quantify scope = function
    | List [Word ("at" | "over" as relation); Word time; item] ->
      let part = read scope item and none = join [] in
      (match relation ^ " " ^ time with
       | time when not (List.mem time times) -> reject "not covered: %s" time
       | "at start" -> part, none, none
       | "over all" -> none, part, none
       | _ -> none, none, part)
    | List [Word "when"; List [Word "at"; Word time; a]; List [Word "at"; Word other; b]] when time = other ->
      timed times read join quantify scope (List [Word "at"; Word time; List [Word "when"; a; b]])
    | List [Word "forall"; List items; body] ->
      let variables = variables items in
      let start, all, finish = timed times read join quantify (scope @ List.map fst variables) body in
      let wrap part = List.fold_right (fun (_, kind) body -> quantify kind body) variables part in
      wrap start, wrap all, wrap finish
    | List (Word "and" :: items) ->
      let parts = List.map (timed times read join quantify scope) items in
      join (List.map (fun (part, _, _) -> part) parts), join (List.map (fun (_, part, _) -> part) parts),
      join (List.map (fun (_, _, part) -> part) parts)
    | List [] -> join [], join [], join []
    | List (Word name :: _) -> reject "not covered in a durative action: %s" name
    | _ -> reject "at start, over all or at end is expected" in

  (* Actions *)
  let rec fields allowed = function
    | Word name :: item :: others when List.mem name allowed ->
      let others = fields allowed others in
      if List.mem_assoc name others then reject "%s is written twice" name;
      (name, item) :: others
    | [] -> []
    | Word name :: _ -> reject "not covered in an action: %s" name
    | _ -> reject "a field of an action is expected" in
  let action durative = function
    | Word name :: items ->
      let condition_name = if durative then ":condition" else ":precondition" in
      let fields = fields [":parameters"; condition_name; ":effect"; (if durative then ":duration" else ":effect")] items in
      let field name = Option.value ~default:(List []) (List.assoc_opt name fields) in
      let parameters = match field ":parameters" with List items -> variables items | Word _ -> reject "parameters are expected" in
      let scope = List.map fst parameters in
      let parameters = List.map snd parameters in
      if not durative then
        name, { C.parameters; duration = None; at_start = condition scope (field ":precondition");
                start_effect = effect scope (field ":effect"); over_all = C.Truth true; at_end = C.Truth true; end_effect = C.Nothing }
      else
        let duration = match field ":duration" with
          | List [Word "="; Word "?duration"; value] -> Some (expression scope value)
          | _ -> reject "not covered: a duration other than (= ?duration ...)" in
        let at_start, over_all, at_end = timed ["at start"; "over all"; "at end"] condition conjunction for_all scope (field ":condition") in
        let start_effect, _, end_effect = timed ["at start"; "at end"] effect both each scope (field ":effect") in
        name, { C.parameters; duration; at_start; start_effect; over_all; at_end; end_effect }
    | _ -> reject "the name of an action is expected" in
  let actions = List.filter_map (fun (name, items) -> match name with
    | ":action" -> Some (action false items)
    | ":durative-action" -> Some (action true items)
    | _ -> None) domain in
  distinct "an action" (List.map fst actions);

  (* Initial state *)
  let initial_atoms = ref C.M.empty and initial_values = ref C.M.empty in
  let ground arguments = List.map (fun item -> known_object (word item)) arguments in
  let set_value name arguments value =
    applied "function" functions name arguments;
    let fluent = function_key name, ground arguments in
    (match C.find_atom !initial_values fluent with
     | Some other when not (C.qeq_bool other value) -> reject "two initial values: %s" name
     | _ -> ());
    initial_values := C.add_atom fluent value !initial_values in
  let atom name arguments =
    applied "predicate" predicates name arguments;
    if List.mem name derived_names then reject "a derived predicate is in :init: %s" name;
    predicate_key name, ground arguments in
  let set_at time name arguments holds = match timed_literals with
    | Some literals -> literals := (decimal time, (atom name arguments, holds)) :: !literals
    | None -> reject "not covered: timed initial literals" in
  let negated = ref [] in
  List.iter (function
    | List [Word "="; List (Word name :: arguments); Word value] -> set_value name arguments (decimal value)
    | List [Word "at"; Word time; List [Word "not"; List (Word name :: arguments)]] when is_number time -> set_at time name arguments false
    | List [Word "at"; Word time; List (Word name :: arguments)] when is_number time -> set_at time name arguments true
    | List [Word "not"; List (Word name :: arguments)] -> negated := atom name arguments :: !negated
    | List (Word name :: arguments) -> initial_atoms := C.add_atom (atom name arguments) () !initial_atoms
    | _ -> reject "not covered in :init") (section problem ":init");
  if List.exists (fun atom -> C.find_atom !initial_atoms atom <> None) !negated then
    reject "an atom holds in :init and does not";
  if List.mem_assoc "total-cost" functions && C.find_atom !initial_values (function_key "total-cost", []) = None then
    set_value "total-cost" [] zero;

  (* Goal and metric: an expression over functions, and the weight of the total time. A metric to
     maximise is negated. Without a metric, a plan is measured by its total time if some action has
     a duration, and otherwise by its number of steps. *)
  let goal_formula = match section problem ":goal" with [goal] -> condition [] goal | _ -> reject "a goal is expected" in
  let rec weighted = function
    | List [Word "total-time"] -> one, C.Constant zero
    | List (Word "+" :: items) ->
      List.fold_left (fun (weight, sum) item -> let w, e = weighted item in C.qred (C.qplus weight w), C.Plus (sum, e))
        (zero, C.Constant zero) items
    | List [Word "*"; Word factor; item] | List [Word "*"; item; Word factor] ->
      let factor = decimal factor in
      let weight, value = weighted item in
      C.qred (C.qmult factor weight), C.Times (C.Constant factor, value)
    | item -> zero, expression [] item in
  let metric_items = match metric with Some items -> items | None -> section problem ":metric" in
  let maximizes, (per_time, metric), per_step = match metric_items with
    | [Word "minimize"; item] -> false, weighted item, zero
    | [Word "maximize"; item] ->
      let weight, value = weighted item in
      true, (negative weight, C.Minus (C.Constant zero, value)), zero
    | [] when List.exists (fun (_, action) -> action.C.duration <> None) actions -> false, (one, C.Constant zero), zero
    | [] -> false, (zero, C.Constant zero), one
    | _ -> reject "not covered: a metric other than minimize or maximize" in
  { task = { C.objects = (fun kind -> Option.value ~default:[] (Hashtbl.find_opt members kind));
             actions = List.map snd actions; strata; initial_atoms = !initial_atoms; initial_values = !initial_values;
             goal_formula; metric; per_time; per_step };
    maximizes; action_names = List.map fst actions; object_names = List.map fst objects @ other_objects }

(* The claim: the metric of an optimal plan, or that there is no plan. *)
let claim problem text =
  if text = "unsolvable" then None else Some (if problem.maximizes then negative (fraction text) else fraction text)

(* A plan: one step after another; start times and durations, as in 0.0: (go a b) [2.5], are not
   read. *)
let plan problem text =
  let step = function
    | List (Word name :: arguments) ->
      let rec position i = function
        | [] -> reject "unknown action: %s" name
        | other :: others -> if other = name then nat i else position (i + 1) others in
      let object_of item =
        if List.mem (word item) problem.object_names then object_key (word item) else reject "unknown object: %s" (word item) in
      Some (position 0 problem.action_names, List.map object_of arguments)
    | Word text when text.[0] = '[' || text.[String.length text - 1] = ':' -> None
    | _ -> reject "a step is expected" in
  List.filter_map step (expressions text)
