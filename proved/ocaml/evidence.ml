(* Reads the evidence that prepare.ml writes: claim, ground task, names, argument and case trees.
   Nothing in it is believed: the theorem holds for any evidence. Required of this file is only that
   it returns immutable values (or functions of tables that do not change any more) and prints
   nothing. *)
module C = Checker
open Reader

let list read = function
  | List items -> List.rev (List.rev_map read items)          (* needs no stack for long lists *)
  | Word text -> reject "a list is expected, not %s" text
let pair read_first read_second = function
  | List [first; second] -> read_first first, read_second second
  | _ -> reject "a pair is expected"
let whole item = let number = decimal (word item) in if number.C.qden = C.XH then number.C.qnum else reject "an integer is expected"
let small item = match int_of_string_opt (word item) with
  | Some n when n >= 0 -> n
  | _ -> reject "a position is expected, not %s" (word item)
(* Variables and numbers count from 0 in the evidence, and from 1 in Coq. *)
let position item = positive (small item + 1)
let map_of_list values =
  List.fold_left (fun (map, i) value -> C.M.add (positive (i + 1)) value map, i + 1) (C.M.empty, 0) values |> fst
let map read item = map_of_list (list read item)

(* Ground task *)

let fact = pair position whole
let literal = pair fact (fun item -> word item = "true")
let quantity = function
  | List [constant; tables] ->
    { C.base = whole constant; tables = list (pair (list (fun item -> nat (small item))) (map whole)) tables }
  | _ -> reject "a quantity is expected"
let linear item = let factors, offset = pair (list (pair position whole)) quantity item in { C.factors; offset }
let ground_condition = function
  | List [facts; clauses; comparisons] ->
    { C.facts = list fact facts; clauses = list (list literal) clauses; comparisons = list linear comparisons }
  | _ -> reject "a condition is expected"
let operator = function
  | List [sizes; excluded; pre; effects; conditional; changes; cost] ->
    { C.slot_sizes = list whole sizes;
      excluded = list (pair (list (fun item -> nat (small item))) (list (list whole))) excluded;
      precondition = ground_condition pre; effects = list fact effects; conditional = list (pair (list literal) (list fact)) conditional;
      number_effects = list (pair position linear) changes; cost = quantity cost }
  | _ -> reject "an operator is expected"
let ground_task = function
  | [basic; derived; sizes; values; numbers; operators; layers; goal] ->
    let numbers = list whole numbers in
    { C.basic_count = whole basic; derived = list fact derived; domain_size = map whole sizes;
      numbers = List.mapi (fun i _ -> positive (i + 1)) numbers;
      init = { C.var_values = map whole values; num_values = map_of_list numbers };
      operators = list operator operators; layers = list (list (pair fact ground_condition)) layers;
      goal = ground_condition goal }
  | _ -> reject "a task is expected"

(* Argument: a bound is an integer, or infinite. *)

let table pattern entries =
  { C.pattern = list position pattern; table_values = map (fun item -> if item = Word "infinite" then None else Some (whole item)) entries }
let label = function
  | List [values; numbers; path_cost] -> { C.label_state = { C.var_values = map whole values; num_values = map whole numbers }; path_cost = whole path_cost }
  | _ -> reject "a label is expected"
let argument = function
  | [potentials; needs; labels] ->
    { C.potentials = list (function List [pattern; entries] -> table pattern entries | _ -> reject "a potential is expected") potentials;
      needs = list (function List [n; pattern; entries] -> position n, table pattern entries | _ -> reject "a need is expected") needs;
      labels = map label labels }
  | _ -> reject "an argument is expected"

(* Names *)

let atom_of name_key = function
  | List (name :: arguments) -> name_key (word name), List.map (fun item -> object_key (word item)) arguments
  | _ -> reject "an atom is expected"
let atom = atom_of predicate_key and fluent = atom_of function_key
let form factors constant = list (pair fluent (fun item -> fraction (word item))) factors, fraction (word constant)
let invariant = function
  | List [strict; factors; constant] -> word strict = "true", form factors constant
  | _ -> reject "an invariant is expected"
let set insert items = List.fold_left insert C.M.empty items
let names = function
  | [variables; fluents; predicates; functions; may_hold; derived; equivalent; invariants; exclusive; scale; cost_scale] ->
    let variables = list (pair position (list (pair whole atom))) variables and fluents = list (pair position fluent) fluents in
    let derived = list (pair position (pair (pair whole whole) atom)) derived in
    let changing = set (fun set key -> C.M.add key () set) (list (fun item -> predicate_key (word item)) predicates
                                                           @ list (fun item -> function_key (word item)) functions) in
    { C.variables = set (fun map (v, atoms) -> C.M.add v atoms map) variables;
      fluents = set (fun map (n, fluent) -> C.M.add n fluent map) fluents;
      fact_of = set (fun map (v, (x, atom)) -> C.add_atom atom (v, x) map)
          (List.concat_map (fun (v, atoms) -> List.map (fun value -> v, value) atoms) variables);
      number_of = set (fun map (n, fluent) -> C.add_atom fluent n map) fluents;
      changing = (fun key -> C.M.find key changing <> None);
      may_hold = set (fun map atom -> C.add_atom atom () map) (list atom may_hold);
      derived_atoms = set (fun map (v, value) -> C.M.add v value map) derived;
      derived_of = set (fun map (v, ((x, _), atom)) -> C.add_atom atom (v, x) map) derived;
      equivalent = word equivalent = "true";
      invariants = list invariant invariants;
      exclusive = list (list atom) exclusive;
      scale = C.Z.to_pos (whole scale); cost_scale = C.Z.to_pos (whole cost_scale) }
  | _ -> reject "names are expected"

(* Case trees *)

let rec tree = function
  | List [Word "nothing"] -> C.Decided None
  | List [Word "operator"; i; choice] -> C.Decided (Some (nat (small i), list whole choice))
  | List [Word "impossible"] -> C.Impossible
  | List [Word "atom"; a; yes; no] -> C.SplitAtom (atom a, tree yes, tree no)
  | List [Word "form"; factors; constant; yes; no] -> C.SplitForm (form factors constant, tree yes, tree no)
  | _ -> reject "a case tree is expected"

module Cases = Map.Make (struct type t = string * C.positive list let compare = compare end)
(* The hash depends on all values, since many states differ in a few variables only. *)
module Values = Hashtbl.Make (struct
  type t = C.z list
  let equal = List.equal (fun a b -> a == b || a = b)
  let hash = List.fold_left (fun hash value -> 31 * hash + Hashtbl.hash value) 0
end)

type t = {
  claim : string; ground_task : C.task; names : C.names; argument : C.argument;
  labels_at : C.state -> C.positive list;     (* the labels whose variables have the values of a state *)
  case : C.nat -> C.positive list -> C.case_tree; goal_case : C.case_tree;
  timeline : C.timeline; passage_case : C.nat -> C.positive list -> C.passage -> C.case_tree; wait_case : C.nat -> C.case_tree;
  starts : C.q list }                         (* start times of the steps of the plan *)

(* For timed initial literals: the atoms of the ground task that represent time, and the trees of the
   passages of each instance and of the waits *)
let timeline = function
  | [denominator; phases; waited; clock] ->
    { C.grid = C.Z.to_pos (whole denominator); phase_atoms = list atom phases; waited = atom waited; clock = fluent clock }
  | [] -> { C.grid = C.XH; phase_atoms = []; waited = C.XH, []; clock = C.XH, [] }
  | _ -> reject "a timeline is expected"

let read action_names text =
  let sections = List.map (function List (Word name :: items) -> name, items | _ -> reject "a section is expected") (expressions text) in
  let section name = match List.assoc_opt name sections with Some items -> items | None -> reject "there is no section %s" name in
  let only name = match section name with [item] -> item | _ -> reject "%s has one part" name in
  let ground_task = ground_task (section "task") and argument = argument (section "argument") in
  let basics = C.basics ground_task in
  let values state = List.map (C.var_value state) basics in
  let labels = Values.create 1000 in
  List.iter (fun (i, label) ->
    let key = values label.C.label_state in
    Values.replace labels key (i :: Option.value ~default:[] (Values.find_opt labels key))) (C.M.elements argument.C.labels);
  let cases = List.fold_left (fun map item ->
      let (name, arguments), tree = pair (function
        | List (name :: arguments) -> word name, List.map (fun item -> object_key (word item)) arguments
        | _ -> reject "an instance of an action is expected") tree item in
      Cases.add (name, arguments) tree map) Cases.empty (section "cases") in
  let optional name = Option.value ~default:[] (List.assoc_opt name sections) in
  let rec int = function C.O -> 0 | C.S n -> 1 + int n in
  let passages = List.fold_left (fun map item -> match item with
      | List [List (name :: arguments); passage; item] ->
        Cases.add (word name ^ String.concat " " ("" :: List.map string_of_int (list small passage)),
                   List.map (fun item -> object_key (word item)) arguments) (tree item) map
      | _ -> reject "a case of a passage is expected") Cases.empty (optional "passages") in
  let waits = Array.of_list (List.map tree (optional "waits")) in
  let rec nth names = function C.O -> List.hd names | C.S n -> nth (List.tl names) n in
  { claim = word (only "claim"); ground_task; names = names (section "names"); argument;
    labels_at = (fun state -> Option.value ~default:[] (Values.find_opt labels (values state)));
    case = (fun action arguments ->
      Option.value ~default:(C.Decided None) (Cases.find_opt (nth action_names action, arguments) cases));
    goal_case = tree (only "goal-case"); timeline = timeline (optional "timeline");
    passage_case = (fun action arguments (((a, b), c), d) ->
      let name = String.concat " " (nth action_names action :: List.map (fun n -> string_of_int (int n)) [a; b; c; d]) in
      Option.value ~default:(C.Decided None) (Cases.find_opt (name, arguments) passages));
    wait_case = (fun i -> let i = int i in if i < Array.length waits then waits.(i) else C.Decided None);
    starts = List.map (fun item -> fraction (word item)) (optional "starts") }
