(* Finds derivations of the facts that the rules of bindings add to a knowledge base. Not believed. *)
module C = Checker

let rec int_of_nat = function C.O -> 0 | C.S n -> 1 + int_of_nat n

let steps rules given =
  let facts = Hashtbl.create 500 and added = ref [] and count = ref 0 in
  let rows p = Option.value ~default:[] (Hashtbl.find_opt facts p) in
  let insert (p, l) = incr count; Hashtbl.replace facts p ((l, Reader.positive !count) :: rows p) in
  List.iter (fun (fact, _) -> insert fact) given;
  let value bindings = function C.RuleVariable x -> List.assoc_opt x bindings | C.Symbol s -> Some s in
  let rec unify bindings = function
    | [], [] -> Some bindings
    | t :: ts, s :: l ->
      (match value bindings t, t with
       | Some other, _ -> if other = s then unify bindings (ts, l) else None
       | None, C.RuleVariable x -> unify ((x, s) :: bindings) (ts, l)
       | None, C.Symbol _ -> None)
    | _ -> None in
  let matches bindings patterns =
    List.fold_left (fun all (p, arguments) ->
      List.concat_map (fun (bindings, supports) -> List.filter_map (fun (l, number) ->
        Option.map (fun bindings -> bindings, number :: supports) (unify bindings (arguments, l))) (rows p)) all)
      [bindings, []] patterns in
  let instance bindings (p, arguments) = p, List.map (fun t -> Option.get (value bindings t)) arguments in
  let holds (p, l) = List.mem_assoc l (rows p) in
  let satisfied bindings = function
    | C.Present _ -> true
    | C.Absent pattern -> not (holds (instance bindings pattern))
    | C.Test (test, x, y) -> C.satisfies test (Option.get (value bindings x)) (Option.get (value bindings y))
    | C.Count (n, local, inner) ->
      let values (found, _) = List.map (fun x -> List.assoc x found) local in
      List.length (List.sort_uniq compare (List.map values (matches bindings inner))) = int_of_nat n in
  let level_of = Knowledge.levels { C.stated = []; implications = rules; same_as = Knowledge.same_as } in
  let leveled = List.filter_map (fun rule -> match rule.C.conclusions with
    | [C.Concludes ((p, _) as pattern)] -> Some (int_of_nat (level_of p), pattern, rule.C.premises)
    | _ -> None) rules in
  let apply changed (_, pattern, premises) =
    let positive = List.filter_map (function C.Present pattern -> Some pattern | _ -> None) premises in
    List.fold_left (fun changed (bindings, supports) ->
      let fact = instance bindings pattern in
      if holds fact || not (List.for_all (satisfied bindings) premises) then changed
      else (insert fact; added := (fact, C.Derived (List.rev supports)) :: !added; true)) changed (matches [] positive) in
  for n = 0 to List.fold_left (fun n (level, _, _) -> max n level) 0 leveled do
    let here = List.filter (fun (level, _, _) -> level = n) leveled in
    while List.fold_left apply false here do () done
  done;
  given @ List.rev !added

(* The order of the functions of each action: by the IRIs of the individuals. *)
let orders mission steps =
  let names = List.map (fun (iri, key) -> key, iri) (Mission.all_names ()) in
  List.map (fun (_, addition) -> match addition with
    | None -> []
    | Some { C.requirement; _ } ->
      let functions = List.filter_map (fun (fact, _) -> match fact with
        | p, [C.Name f] when p = requirement -> Some (List.assoc f names, f)
        | _ -> None) steps in
      List.map (fun (_, f) -> mission.C.object_for f) (List.sort compare functions)) mission.C.schemas
