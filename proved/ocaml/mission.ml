(* Reads the mission of a certificate as a value of Mission.v: the mission's PDDL files, and its knowledge base with the
   bindings of PDDL symbols as rules. Believed for missions, with knowledge.ml, json.ml and reader.ml. Individuals are
   called by their local names, or by the names in origin.json; names are compared without case, as in PDDL. *)
module C = Checker
open Reader
open Json
open Knowledge

(* Names. All names of the knowledge base have a key. *)

let local_name iri =
  let after i = String.sub iri (i + 1) (String.length iri - i - 1) in
  let name = match String.rindex_opt iri '#', String.rindex_opt iri '/' with
    | Some i, _ | None, Some i -> after i
    | None, None -> iri in
  if name = "" then iri else name
let all_names () = List.sort compare (Hashtbl.fold (fun name key names ->
  if starts "name " name then (local "name " name, key) :: names else names) keys [])
let is_pddl_name name =
  name <> "" && String.for_all (function 'a' .. 'z' | '0' .. '9' | '-' | '_' | '.' -> true | _ -> false) name

(* Rules *)

let v name = C.RuleVariable (variable name)
let yes pattern = C.Present pattern and no pattern = C.Absent pattern and is key = C.Symbol (C.Name key)
let ( ==> ) premises pattern = { C.premises = with_local premises; conclusions = [C.Concludes pattern] }
let never premises = { C.premises = premises; conclusions = [] }
let number q = C.Symbol (C.Literal (C.Numeric q))

(* Terms of TOMASys, which have names in several namespaces *)
let namespaces = ["http://metacontrol.org/tomasys#"; "http://www.metacontrol.org/tomasys#"; "http://www.metacontrol.org/suave#"]
let term name = key ("term " ^ name)
let a_class name = fun x -> term name, [x] and a_property name = fun x y -> term name, [x; y]
let design = a_class "FunctionDesign" and action_class = a_class "Action" and value_class = a_class "QAvalue"
and solves = a_property "solvesF" and requires = a_property "requiresF" and realisable = a_property "fd_realisability"
and available = a_property "fd_available" and estimation = a_property "hasQAestimation" and attribute = a_property "isQAtype"
and has_value = a_property "hasValue" and minimum = a_property "hasMinimum" and maximum = a_property "hasMaximum"
and requires_quality = a_property "requiresQuality" and context = a_property "inContext" and measured = a_property "isMeasured"
let vocabulary =
  let x = v "x" and y = v "y" in
  let rule arguments (name, iri) = [yes (name_key iri, arguments)] ==> (term name, arguments) in
  let everywhere name = List.map (fun namespace -> name, namespace ^ name) namespaces in
  let only_first name = name, List.hd namespaces ^ name in
  List.map (rule [x]) (List.concat_map everywhere ["FunctionDesign"; "Action"; "QAvalue"])
  @ List.map (rule [x; y]) (List.concat_map everywhere ["solvesF"; "requiresF"; "fd_realisability"; "hasQAestimation"; "isQAtype"])
  @ List.map (rule [x; y]) (List.map only_first
      ["fd_available"; "hasMinimum"; "hasMaximum"; "requiresQuality"; "inContext"; "isMeasured"; "hasValue"])
  @ List.map (rule [x; y]) ["hasValue", List.nth namespaces 1 ^ "qa_has_value"; "hasValue", List.nth namespaces 2 ^ "hasValue"]

(* What a design is estimated to have of an attribute, and whether some design of a function has an estimate *)
let estimated d kind value = key "estimated", [d; kind; value] and is_estimated d kind = key "is estimated", [d; kind]
and concerns kind f = key "concerns", [kind; f]
and measured_value e = key "measured value", [e] and is_measured kind = key "is measured", [kind]
and measurement kind value = key "measurement", [kind; value]
let yes_boolean = constant (C.Boolean true) and no_boolean = constant (C.Boolean false)
let estimates =
  let d = v "d" and e = v "e" and kind = v "kind" and x = v "x" and y = v "y" and f = v "f" in
  [ [yes (design d); yes (estimation d e); yes (attribute e kind); yes (has_value e x)] ==> estimated d kind x;
    [yes (estimated d kind x)] ==> is_estimated d kind;
    [yes (is_estimated d kind); yes (solves d f)] ==> concerns kind f;
    [yes (measured_value e); yes (attribute e kind)] ==> is_measured kind;
    [yes (measured_value e); yes (attribute e kind); yes (has_value e x)] ==> measurement kind x;
    [yes (value_class e); yes (measured e yes_boolean)] ==> measured_value e;
    never [yes (estimated d kind x); yes (estimated d kind y); C.Test (C.Different, x, y)];
    never [yes (estimated d kind x); C.Test (C.Outside C.AnyNumber, x, x)] ]

let is_available d = [yes (design d); no (realisable d no_boolean); no (available d no_boolean)]

type query = Class of string | Solves | Available | Requires of string option | Estimation of string | Measured of string
           | Chosen of string | Action of string

let query text =
  let kind, name = match String.index_opt text ':' with
    | Some i -> String.sub text 0 i, String.sub text (i + 1) (String.length text - i - 1)
    | None -> text, "" in
  match kind, name with
  | "solves", "" -> Solves | "available", "" -> Available | "requires", "" -> Requires None
  | "class", name -> Class name | "requires", name -> Requires (Some name) | "estimation", name -> Estimation name
  | "measured", name -> Measured name | "chosen", name -> Chosen name | "action", name -> Action name
  | _ -> reject "not covered: the binding %s" text

type t = { mission : C.mission; problem : Reader.problem; steps : (C.data * C.reason) list; other_metric : bool }

(* The mission of a knowledge base with derivations of its facts. [derive] adds the derivations of the facts of given
   rules. Neither [derive] nor [steps] are believed: if [check_mission] accepts, exactly these facts hold. [metric]
   replaces that of the certificate. *)
let read ~derive ?metric knowledge steps origin problem_text =
  let text name = string (field origin name) in
  let sections text = match expressions text with
    | [List (_ :: _ :: sections)] ->
      List.map (function List (Word name :: items) -> name, items | _ -> reject "a section is expected") sections
    | _ -> reject "(define ...) is expected" in
  let all name sections = List.concat_map (fun (other, items) -> if other = name then items else []) sections in
  let domain = sections (text "domain") and own = sections (text "problem") and certified = sections problem_text in

  (* Individuals *)
  let pairs name = match optional origin name with
    | None -> []
    | Some (Object fields) ->
      (* Readers of JSON disagree about names that occur twice. Those of PDDL symbols have no case. *)
      let written symbol = if name = "bindings" then String.lowercase_ascii symbol else symbol in
      let names = List.map (fun (symbol, _) -> written symbol) fields in
      if List.length (List.sort_uniq compare names) < List.length names then reject "origin.json: a name occurs twice";
      List.map (fun (name, value) -> name, string value) fields
    | Some _ -> reject "origin.json: names are expected" in
  let names = all_names () in
  let renamed = List.map (fun (name, object_name) ->
    match List.filter (fun (iri, _) -> iri = name || local_name iri = name) names with
    | [iri, _] -> iri, object_name
    | _ -> reject "not covered: <%s>, which is not the name of one individual" name) (pairs "names") in
  if List.length (List.sort_uniq compare (List.map fst renamed)) < List.length renamed then
    reject "origin.json: an individual has two names";
  let called iri = String.lowercase_ascii (match List.assoc_opt iri renamed with Some name -> name | None -> local_name iri) in
  let iri_of = Hashtbl.create 500 in
  List.iter (fun (iri, key) -> Hashtbl.replace iri_of key iri) names;
  let object_for key = match Hashtbl.find_opt iri_of key with
    | Some iri when is_pddl_name (called iri) -> object_key (called iri)
    | Some iri -> reject "not covered: <%s>, whose name is not a PDDL name" iri
    | None -> reject "not covered: an individual without a name" in

  (* Objects of the certificate that are individuals can occur in the files. The user may choose another metric. *)
  let is_called = Hashtbl.create 500 in
  List.iter (fun (iri, _) -> Hashtbl.replace is_called (called iri) ()) names;
  let is_individual name = Hashtbl.mem is_called name && not (is_number name) in
  let other_objects = List.filter is_individual (List.map fst (typed (all ":objects" certified))) in
  let metric = Option.value metric ~default:(all ":metric" certified) in
  let problem = Reader.problem ~metric ~other_objects (text "domain") (text "problem") in

  (* The facts of a class or property of TOMASys. Attribute types have different names. *)
  let facts_of term = List.filter_map (fun ((p, l), _) ->
    if List.exists (fun namespace -> p = name_key (namespace ^ term)) namespaces then Some l else None) steps in
  let values_of property =
    let values = List.filter_map (function [_; value] -> Some value | _ -> None) (facts_of property) in
    List.sort_uniq compare values in
  let with_iris = List.filter_map (function C.Name key -> Some (Hashtbl.find iri_of key, key) | C.Literal _ -> None) in
  let attributes = List.map (fun (iri, key) -> called iri, key) (with_iris (values_of "isQAtype")) in
  distinct "an attribute" (List.map fst attributes);
  let attribute_named name =
    List.filter_map (fun (other, key) -> if other = String.lowercase_ascii name then Some key else None) attributes in

  (* Bindings *)
  let bindings = List.map (fun (symbol, text) -> String.lowercase_ascii symbol, query text) (pairs "bindings") in
  let binding default name = match List.assoc_opt name bindings with Some query -> Some query | None -> default name in
  let class_of = binding (function
    | "function" -> Some (Class "Function") | "action" -> Some (Class "Action") | "component" -> Some (Class "Component")
    | "functiondesign" | "function_design" | "function-design" -> Some (Class "FunctionDesign")
    | _ -> None) in
  let predicate_query = binding (fun name -> match name with
    | "fd_available" -> Some Available
    | "a_req_f" -> Some (Requires None)
    | "fd_solve_f" | "fd_solves_f" | "inferred-solvesf" | "solvesf" -> Some Solves
    | name when Filename.check_suffix name "_requires_f" -> Some (Requires (Some (Filename.chop_suffix name "_requires_f")))
    | _ -> None) in
  let supertypes = typed (all ":types" domain) in
  let is_design kind = match class_of kind with Some (Class name) -> local_name name = "FunctionDesign" | _ -> false in
  let actions = List.filter_map (function
    | (":action" | ":durative-action"), Word name :: items ->
      let rec parameters = function
        | Word ":parameters" :: List items :: _ -> List.map fst (typed items)
        | _ :: items -> parameters items
        | [] -> [] in
      Some (name, parameters items)
    | _ -> None) domain in
  let known_actions = facts_of "Action" in
  let individuals_of name = List.filter (fun (iri, key) ->
    let is_action own = match List.assoc_opt name bindings with
      | Some (Action wanted) -> wanted = own || wanted = iri
      | _ -> List.mem (String.lowercase_ascii own) [name; "a_" ^ name] in
    List.mem [C.Name key] known_actions && List.exists is_action [called iri; local_name iri]) names in
  (* A domain is plain if it has no type of designs, and if the knowledge base requires functions for its actions. *)
  let is_plain =
    not (List.exists (fun (kind, _) -> is_design kind) supertypes)
    && List.exists (fun (name, _) -> List.exists (fun (_, individual) ->
      List.exists (fun l -> List.hd l = C.Name individual) (facts_of "requiresF")) (individuals_of name)) actions in
  let supertypes = if is_plain then supertypes @ ["function", "object"; "functiondesign", "object"] else supertypes in
  let x = v "x" and d = v "d" and f = v "f" and a = v "a" and kind = v "kind" in
  let rules = ref (vocabulary @ estimates) and bound = ref [] in
  let add key more = bound := key :: !bound; rules := more @ !rules in

  (* Types: members of classes, also in types above *)
  List.iter (fun (name, parent) ->
    add (type_key name) [];
    add (type_key parent) [[yes (type_key name, [x])] ==> (type_key parent, [x])];
    add (type_key "object") [[yes (type_key name, [x])] ==> (type_key "object", [x])];
    match class_of name with
    | Some (Class wanted) ->
      let is_wanted (iri, _) = if String.contains wanted ':' then iri = wanted else local_name iri = wanted in
      let rule (_, key) = [yes (key, [x])] ==> (type_key name, [x]) in
      add (type_key name) (List.map rule (List.filter is_wanted names))
    | _ -> ()) supertypes;

  (* Predicates. Required functions are listed in the order of their IRIs. *)
  let declared = List.filter_map (function List (Word name :: items) -> Some (name, typed items) | _ -> None) in
  let predicates = declared (all ":predicates" domain) and functions = declared (all ":functions" domain) in
  let initially = List.filter_map (function
    | List (Word "=" :: List (Word name :: _) :: _) | List [Word "not"; List (Word name :: _)] | List (Word name :: _) ->
      Some name
    | _ -> None) (all ":init" own) in
  let solve p = add (predicate_key p) [[yes (design d); yes (solves d f)] ==> (predicate_key p, [d; f])]
  and avail p = add (predicate_key p) [is_available d ==> (predicate_key p, [d])] in
  if is_plain then (solve "fd_solve_f"; avail "fd_available");
  let before = key "before" in
  let required = List.sort compare (with_iris (values_of "requiresF")) in
  let order = List.concat_map (fun (iri, f) -> List.filter_map (fun (other, g) ->
    if iri < other then Some (before, [C.Name f; C.Name g]) else None) required) required in
  let require p count only =
    let fs = List.init count (fun i -> v (Printf.sprintf "f%d" i)) in
    let rec increasing = function f :: (g :: _ as fs) -> yes (before, [f; g]) :: increasing fs | _ -> [] in
    let rule a = [yes (action_class a)] @ List.map (fun f -> yes (requires a f)) fs @ increasing fs
      @ [C.Count (nat count, [], [requires a (v "g")])] ==> (predicate_key p, a :: fs) in
    let is_wanted wanted (iri, _) = called iri = wanted || String.lowercase_ascii (local_name iri) = wanted in
    add (predicate_key p) (match only with
      | None -> [rule a]
      | Some wanted -> List.map (fun (_, key) -> rule (is key)) (List.filter (is_wanted (String.lowercase_ascii wanted)) names)) in
  List.iter (fun (name, parameters) -> match predicate_query name, parameters with
    | Some Solves, [_; _] -> solve name
    | Some Available, [_] ->
      if List.mem name initially then reject "not covered: %s in the problem file" name;
      avail name
    | Some (Requires only), _ :: functions -> require name (List.length functions) only
    | _ -> ()) predicates;

  (* Functions: estimates of designs, and measured values. In MROS, names of measured values begin with obs_. *)
  let unless pattern = C.Count (nat 0, [], [pattern]) in
  List.iter (fun (iri, key) -> if starts "obs_" (called iri) then
    let e = is key in
    let rule = [yes (value_class e); unless (measured e (v "any")); unless (estimation (v "any") e)] ==> measured_value e in
    rules := rule :: !rules) names;
  let estimated_kinds name = match attribute_named name with
    | [] when starts "fd_" name -> attribute_named (local "fd_" name)
    | _ :: _ when starts "fd_" name && attribute_named (local "fd_" name) <> [] ->
      reject "not covered: two attributes for %s" name
    | kinds -> kinds in
  List.iter (fun (name, parameters) ->
    let by_name make = binding (fun name -> Some (make name)) name in
    let f = function_key name in
    match parameters with
    | [_, kind] ->
      (match by_name (fun name -> Estimation name) with
       | Some (Estimation attribute) when List.mem_assoc name bindings || is_design kind ->
         let rule kind = [yes (estimated d (is kind) x)] ==> (f, [d; x]) in
         add f (List.map rule (estimated_kinds attribute))
       | Some (Estimation attribute) when estimated_kinds attribute <> [] ->
         reject "not covered: %s is a function of %s, and an attribute" name kind
       | _ -> ())
    | [] ->
      (match by_name (fun name -> Measured name) with
       | Some (Measured wanted) ->
         add f (List.map (fun kind -> [yes (measurement (is kind) x)] ==> (f, [x])) (attribute_named wanted))
       | _ -> ())
    | _ -> ()) functions;

  (* Plain domains: the functions that each action requires, and the designs that its bounds rule out *)
  let text name = C.Literal (literal name (xsd ^ "string")) in
  let contexts = values_of "inContext" in
  let places = List.filter (fun (name, _) -> List.mem (text name) contexts) predicates in
  if List.exists (fun context -> not (List.exists (fun (name, _) -> text name = context) places)) contexts then
    reject "not covered: a context that is not the name of a predicate in lower case";
  let sum_key attribute = key ("sum of " ^ attribute) and required_key name = key ("required by " ^ name)
  and ruled_out_key name place = key ("ruled out by " ^ name ^ " in " ^ place) in
  if is_plain then List.iter (fun (name, _) -> List.iter (fun (_, individual) ->
    let a = is individual and b = v "b" and m = v "m" in
    add (required_key name) [[yes (action_class a); yes (requires a f)] ==> (required_key name, [f])];
    let rules_out place where =
      let p = ruled_out_key name place in
      let bound = [yes (action_class a); yes (requires_quality a b); where; yes (attribute b kind); yes (concerns kind f);
                   yes (design d); yes (solves d f)] in
      let outside limit small large =
        bound @ [yes (estimated d kind x); yes (limit b m); C.Test (C.Less, small, large)] ==> (p, [d; f]) in
      add p [outside minimum x m; outside maximum m x; bound @ [no (is_estimated d kind)] ==> (p, [d; f])] in
    rules_out "" (unless (context b (v "any")));
    List.iter (fun (place, _) -> rules_out place (yes (context b (C.Symbol (text place))))) places) (individuals_of name)) actions;
  (* Functions that may be sums over the chosen designs: bound ones, and those with the name of an estimated attribute *)
  let candidates = List.filter_map (fun (name, parameters) ->
    if not is_plain || parameters <> [] || List.mem name initially then None
    else match List.assoc_opt name bindings with
      | Some (Chosen attribute) ->
        if attribute_named attribute = [] then reject "not covered: %s, an attribute without facts" attribute;
        Some (name, attribute, true)
      | _ -> Some (name, name, false)) functions in
  List.iter (fun (_, attribute, _) ->
    List.iter (fun kind ->
      let kind = is kind and sum = sum_key attribute in
      add sum [[yes (estimated d kind x); yes (solves d f)] ==> (sum, [d; f; x]);
               [yes (design d); yes (solves d f); no (concerns kind f)] ==> (sum, [d; f; number zero])])
      (attribute_named attribute)) candidates;

  let mission_knowledge =
    { knowledge with C.stated = order @ knowledge.C.stated; implications = !rules @ knowledge.C.implications } in
  let steps = derive !rules (steps @ List.map (fun fact -> fact, C.Stated) order) in
  let rows p = List.filter_map (fun ((q, l), _) -> if p = q then Some l else None) steps in
  let is_estimated_only kind =
    List.exists (List.mem (C.Name kind)) (rows (key "is estimated")) && not (List.mem [C.Name kind] (rows (key "is measured"))) in
  let chosen = List.filter (fun (_, attribute, is_bound) ->
    is_bound || List.exists is_estimated_only (attribute_named attribute)) candidates in
  let addition (name, parameters) =
    let position place (argument, _) =
      let rec find i = function
        | [] -> reject "not covered: the context %s of %s" place name
        | other :: others -> if other = argument then i else find (i + 1) others in
      C.Var (nat (find 0 parameters)) in
    let context (place, arguments) =
      let p = ruled_out_key name place in
      if rows p = [] then None else Some (C.Atom (predicate_key place, List.map (position place) arguments), p) in
    { C.requirement = required_key name; design_type = type_key "functiondesign"; solves = predicate_key "fd_solve_f";
      available = predicate_key "fd_available";
      sums = List.map (fun (name, attribute, _) -> function_key name, sum_key attribute) chosen;
      ruled_out = (C.Truth true, ruled_out_key name "") :: List.filter_map context places } in
  let schema action names = action, if is_plain then Some (addition names) else None in
  let schemas = List.map2 schema problem.task.C.actions actions and bound_symbols = List.sort_uniq compare !bound in
  { mission = { C.mission_knowledge; files = problem.task; schemas; bound_symbols; object_for };
    problem; steps; other_metric = metric <> all ":metric" own }
