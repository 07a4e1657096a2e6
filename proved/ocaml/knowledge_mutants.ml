(* Tests the checker of derivations with random changes of a certificate: of the claimed facts and their reasons, of the
   stated facts, and of the rules. Fails if a false claim is accepted. The judge computes all facts stratum by
   stratum. It shares with the checker the built-ins, [Knowledge.levels] and all readers, which it does not test. *)
module C = Checker

let read_file path =
  let channel = open_in_bin path in
  Fun.protect ~finally:(fun () -> close_in channel) (fun () -> really_input_string channel (in_channel_length channel))

(* The judge: the facts of the stable model, or nothing if a constraint is violated or two names are equal. *)

exception Inconsistent

let rec int_of_nat = function C.O -> 0 | C.S n -> 1 + int_of_nat n
let value bindings = function C.RuleVariable x -> List.assoc_opt x bindings | C.Symbol s -> Some s
let instance bindings (p, arguments) = p, List.map (fun t -> Option.get (value bindings t)) arguments
let rec agree bindings = function
  | [], [] -> Some bindings
  | t :: ts, s :: l ->
    (match value bindings t, t with
     | Some other, _ -> if other = s then agree bindings (ts, l) else None
     | None, C.RuleVariable x -> agree ((x, s) :: bindings) (ts, l)
     | None, C.Symbol _ -> None)
  | _ -> None
let matches facts patterns =
  List.fold_left (fun all (p, arguments) ->
    List.concat_map (fun bindings -> List.filter_map (fun l -> agree bindings (arguments, l)) (Hashtbl.find_all facts p)) all)
    [[]] patterns
let holds facts (p, l) = List.mem l (Hashtbl.find_all facts p)
let premise_holds facts bindings = function
  | C.Present _ -> true
  | C.Absent pattern -> not (holds facts (instance bindings pattern))
  | C.Test (test, x, y) -> C.satisfies test (Option.get (value bindings x)) (Option.get (value bindings y))
  | C.Count (n, local, inner) ->
    let known = List.filter (fun (x, _) -> not (List.mem x local)) bindings in
    let all = List.filter (fun found -> List.for_all (fun (x, s) -> List.assoc_opt x found = None || List.assoc_opt x found = Some s) known)
        (matches facts inner) in
    let tuples = List.sort_uniq compare (List.map (fun found -> List.map (fun x -> List.assoc_opt x found) local) all) in
    List.length tuples = int_of_nat n
let model ({ C.stated; implications; _ } as knowledge_base) =
  let level_of = Knowledge.levels knowledge_base in
  let level p = int_of_nat (level_of p) in
  let facts = Hashtbl.create 500 in
  let add (p, l) = if holds facts (p, l) then false else (Hashtbl.add facts p l; true) in
  List.iter (fun fact -> ignore (add fact)) stated;
  let solutions { C.premises; _ } =
    let positive = List.filter_map (function C.Present pattern -> Some pattern | _ -> None) premises in
    List.filter (fun bindings -> List.for_all (premise_holds facts bindings) premises) (matches facts positive) in
  let round n = List.fold_left (fun changed ({ C.conclusions; _ } as rule) ->
    let here = List.filter_map (function C.Concludes (p, _ as pattern) when level p = n -> Some pattern | _ -> None) conclusions in
    if here = [] then changed else
      List.fold_left (fun changed bindings ->
        List.fold_left (fun changed pattern -> add (instance bindings pattern) || changed) changed here) changed (solutions rule))
    false implications in
  let rec stratum n = if round n then stratum n in
  let predicates = List.concat_map (fun { C.conclusions; _ } ->
    List.filter_map (function C.Concludes (p, _) -> Some p | C.Equates _ -> None) conclusions) implications in
  for n = 0 to List.fold_left (fun n p -> max n (level p)) 0 predicates do stratum n done;
  List.iter (fun ({ C.conclusions; _ } as rule) ->
    let all = solutions rule in
    if conclusions = [] && all <> [] then raise Inconsistent;
    List.iter (function
      | C.Equates (x, y) -> if List.exists (fun bindings -> value bindings x <> value bindings y) all then raise Inconsistent
      | C.Concludes _ -> ()) conclusions) implications;
  List.sort_uniq compare (Hashtbl.fold (fun p l all -> (p, l) :: all) facts [])

(* Random changes *)

let pick list = List.nth list (Random.int (List.length list))
let change_at i change list = List.concat (List.mapi (fun j item -> if i = j then change item else [item]) list)
let change_one change list = if list = [] then list else change_at (Random.int (List.length list)) change list
let other_symbol symbols = fun _ -> [pick symbols]
let change_fact symbols (p, l) = p, change_one (other_symbol symbols) l
(* The relations p with a rule p(x, y) -> p(y, x) *)
let symmetric { C.implications; _ } = List.filter_map (function
  | { C.premises = [C.Present (p, [C.RuleVariable x; C.RuleVariable y])];
      conclusions = [C.Concludes (q, [C.RuleVariable z; C.RuleVariable w])] } when p = q && x = w && y = z && x <> y -> Some p
  | _ -> None) implications
let change_step symbols symmetric facts steps =
  match Random.int 6 with
  | 0 -> change_one (fun _ -> []) steps
  | 1 -> change_one (fun (fact, reason) -> [change_fact symbols fact, reason]) steps
  | 2 -> change_one (fun step -> [step; change_fact symbols (pick facts), C.Stated]) steps
  | 3 ->
    let support () = Reader.positive (1 + Random.int (List.length steps)) in
    change_one (fun (fact, reason) -> match reason with
      | C.Stated -> [fact, C.Derived [support ()]]
      | C.Derived supports -> [fact, C.Derived (change_one (fun _ -> [support ()]) supports)]) steps
  | 4 ->
    let moved = pick steps in
    change_one (fun step -> [moved; step]) (List.filter (fun step -> step <> moved) steps)
  | _ ->
    (* a cycle: two facts that support each other *)
    let n = List.length steps in
    let fact, opposite =
      if symmetric = [] then let fact = change_fact symbols (pick facts) in fact, fact
      else let p = pick symmetric and a = pick symbols and b = pick symbols in (p, [a; b]), (p, [b; a]) in
    steps @ [fact, C.Derived [Reader.positive (n + 2)]; opposite, C.Derived [Reader.positive (n + 1)]]
let change_premise symbols premise =
  let argument t = match Random.int 3 with 0 -> C.Symbol (pick symbols) | _ -> t in
  match premise with
  | C.Present (p, l) when Random.int 4 = 0 -> [C.Absent (p, l)]
  | C.Present (p, l) -> [C.Present (p, List.map argument l)]
  | C.Absent (p, l) when Random.bool () -> [C.Present (p, l)]
  | C.Absent _ -> []
  | C.Test (_, x, y) when Random.bool () ->
    [C.Test (pick [C.Less; C.LessOrEqual; C.Identical; C.NotIdentical; C.Different; C.Outside C.AnyInteger; C.Outside C.AnyText], x, y)]
  | C.Test (test, x, y) -> [C.Test (test, y, x)]
  | C.Count (n, local, inner) -> if Random.bool () then [] else [C.Count (C.S n, local, inner)]
let change_knowledge symbols ({ C.stated; implications; _ } as knowledge_base) =
  match Random.int 4 with
  | 0 -> { knowledge_base with C.stated = change_one (fun _ -> []) stated }
  | 1 -> { knowledge_base with C.stated = change_one (fun fact -> [change_fact symbols fact]) stated }
  | 2 -> { knowledge_base with C.implications = change_one (fun _ -> []) implications }
  | _ ->
    let change rule = [{ rule with C.premises = change_one (change_premise symbols) rule.C.premises }] in
    { knowledge_base with C.implications = change_one change implications }

let () =
  let directory = Sys.argv.(1) and count = int_of_string Sys.argv.(2) in
  Random.init (int_of_string Sys.argv.(3));
  let read name = read_file (Filename.concat directory name) in
  let knowledge_base = Knowledge.knowledge_base (read "knowledge.nt") (read "origin.json") in
  let steps = Knowledge.derivations (read "derivations.json") in
  let facts = List.map fst steps in
  let symbols = List.sort_uniq compare (List.concat_map snd facts) in
  let accepted = ref 0 and rejected_true = ref 0 and rejected_false = ref 0 in
  for _ = 1 to count do
    let changed_steps, changed_base =
      if Random.bool () then change_step symbols (symmetric knowledge_base) facts steps, knowledge_base
      else steps, change_knowledge symbols knowledge_base in
    let is_true =
      try model changed_base = List.sort_uniq compare (List.map fst changed_steps) with Inconsistent | Invalid_argument _ -> false in
    let is_accepted = C.check_derivations changed_base (Knowledge.levels changed_base) changed_steps in
    if is_accepted && not is_true then (print_endline "a false claim is accepted"; exit 1);
    incr (if is_accepted then accepted else if is_true then rejected_true else rejected_false)
  done;
  Printf.printf "%d changed derivations: %d true ones accepted, %d true ones rejected, %d false ones rejected\n" count
    !accepted !rejected_true !rejected_false;
  if !accepted = 0 || !rejected_false = 0 then (print_endline "no true claim is accepted, or no claim is false"; exit 1)
