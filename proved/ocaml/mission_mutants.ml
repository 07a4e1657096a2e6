(* Tests the checker of missions with random changes of the knowledge base, of its claimed facts and of the problem
   file, for an unchanged claim and unchanged evidence. The judge reads the facts of the knowledge base without rules
   for bindings, and writes the problem as PDDL. For a plain domain, it uses the explicit domain of the certificate, which
   the changes do not concern. The test fails if actions have other results than in the judge's problem, or if a claim
   is accepted that is false for this problem. The judge shares with the checker the reader of PDDL, the derivations and
   the semantics of actions. *)
module C = Checker
open Reader

let read_file path =
  let channel = open_in_bin path in
  Fun.protect ~finally:(fun () -> close_in channel) (fun () -> really_input_string channel (in_channel_length channel))

(* The judge's problem *)

let tomasys = "http://metacontrol.org/tomasys#"
let rec decimal_text (q : C.q) =
  let int_of_positive p = let rec int = function C.XH -> 1 | C.XO p -> 2 * int p | C.XI p -> 2 * int p + 1 in int p in
  let denominator = int_of_positive q.C.qden in
  let numerator = match q.C.qnum with C.Z0 -> 0 | C.Zpos p -> int_of_positive p | C.Zneg p -> - int_of_positive p in
  Printf.sprintf "%.6f" (float_of_int numerator /. float_of_int denominator)
and text = function Word word -> word | List items -> "(" ^ String.concat " " (List.map text items) ^ ")"
let sections text = match expressions text with
  | [List (Word "define" :: head :: sections)] -> head, sections
  | _ -> failwith "sections"
let section name sections = List.concat_map (function List (Word other :: items) when other = name -> items | _ -> []) sections

let judged domain_text problem_text facts =
  let iris = Hashtbl.create 500 in
  List.iter (fun (iri, key) -> Hashtbl.replace iris key iri) (Mission.all_names ());
  let name key = let iri = Hashtbl.find iris key in
    String.lowercase_ascii (match String.rindex_opt iri '#' with Some i -> String.sub iri (i + 1) (String.length iri - i - 1) | None -> iri) in
  let all local = List.filter_map (fun (p, l) -> if p = Knowledge.name_key (tomasys ^ local) then Some l else None) facts in
  let members local = List.filter_map (function [C.Name n] -> Some n | _ -> None) (all local) in
  let values local n = List.filter_map (function [C.Name m; x] when n = m -> Some x | _ -> None) (all local) in
  let names local n = List.filter_map (function C.Name m -> Some m | _ -> None) (values local n) in
  let numbers local n = List.filter_map (function C.Literal (C.Numeric q) -> Some q | _ -> None) (values local n) in
  let designs = members "FunctionDesign" in
  let estimates d = List.concat_map (fun e ->
    List.concat_map (fun kind -> List.map (fun q -> name kind, q) (numbers "hasValue" e)) (names "isQAtype" e)) (names "hasQAestimation" d) in
  let is_false local d = List.mem (C.Literal (C.Boolean false)) (values local d) in
  let atom p names = List (Word p :: List.map (fun n -> Word (name n)) names) in
  let _, domain = sections domain_text in
  let head, problem = sections problem_text in
  let stated = section ":init" problem in
  let declared what = List.filter_map (function List (Word name :: items) -> Some (name, List.length (typed items)) | _ -> None) (section what domain) in
  let types = List.map fst (typed (section ":types" domain)) in
  let objects = List.concat_map (fun (kind, local) -> if List.mem kind types then List.map (fun n -> name n, kind) (members local) else [])
      ["function", "Function"; "functiondesign", "FunctionDesign"; "action", "Action"] in
  let known = List.map fst (typed (section ":objects" problem) @ typed (section ":constants" domain)) in
  let objects = List.concat_map (fun (n, kind) -> if List.mem n known then [] else [Word n; Word "-"; Word kind]) objects in
  let without_prefix f = if String.length f > 3 && String.sub f 0 3 = "fd_" then String.sub f 3 (String.length f - 3) else f in
  let meets bound d =
    let kind = List.map name (names "isQAtype" bound) in
    let own d = List.filter_map (fun (k, q) -> if List.mem k kind then Some q else None) (estimates d) in
    let all limit test = List.for_all (fun m -> List.for_all (fun q -> test q m) (own d)) (numbers limit bound) in
    let concerned f = List.exists (fun d -> own d <> []) (List.filter (fun d -> List.mem f (names "solvesF" d)) designs) in
    if own d = [] then not (List.exists concerned (names "solvesF" d))
    else all "hasMinimum" (fun q m -> C.qle_bool m q) && all "hasMaximum" (fun q m -> C.qle_bool q m) in
  let atoms (p, arity) = match p with
    | "fd_solve_f" -> List.concat_map (fun d -> List.map (fun f -> atom p [d; f]) (names "solvesF" d)) designs
    | "fd_available" ->
      List.map (fun d -> atom p [d]) (List.filter (fun d -> not (is_false "fd_realisability" d || is_false "fd_available" d)) designs)
    | "a_req_f" ->
      List.filter_map (fun a ->
        let functions = List.sort (fun f g -> compare (Hashtbl.find iris f) (Hashtbl.find iris g)) (names "requiresF" a) in
        if List.length functions = arity - 1 then Some (atom p (a :: functions)) else None) (members "Action")
    | p when String.length p > 9 && String.sub p 0 9 = "fd_meets_" ->
      let bounds = List.filter (fun b -> "fd_meets_" ^ name b = p) (members "Requirement") in
      List.concat_map (fun b -> List.map (fun d -> atom p [d]) (List.filter (meets b) designs)) bounds
    | _ -> [] in
  let has_value fluent = List.exists (function List [Word "="; other; _] -> other = fluent | _ -> false) stated in
  let equal fluent q = if has_value fluent then None else Some (List [Word "="; fluent; Word (decimal_text q)]) in
  let numbers_of (f, arity) = match arity with
    | 1 -> List.concat_map (fun d -> List.filter_map (fun (kind, q) ->
        if kind = f || kind = without_prefix f then equal (atom f [d]) q else None) (estimates d)) designs
    | 0 -> List.concat_map (fun m ->
        if List.mem (C.Literal (C.Boolean true)) (values "isMeasured" m) && List.exists (fun kind -> name kind = f) (names "isQAtype" m)
        then List.filter_map (equal (List [Word f])) (numbers "hasValue" m) else []) (members "QAvalue")
    | _ -> [] in
  let added = function
    | List (Word ":objects" :: items) -> List (Word ":objects" :: objects @ items)
    | List (Word ":init" :: items) ->
      List (Word ":init" :: items @ List.concat_map atoms (declared ":predicates") @ List.concat_map numbers_of (declared ":functions"))
    | section -> section in
  Reader.problem domain_text (text (List (Word "define" :: head :: List.map added problem)))

(* Every instance of an action has the same result in both problems: from the initial state, and from the state in which
   also all atoms hold that actions change. *)
let agree (problem : C.problem) (judged : Reader.problem) =
  let other = judged.task in
  let changed = List.filter_map (fun (is_number, p, _) -> if is_number then None else Some p) (Exhaustive.changed_heads other) in
  let all world = { world with C.holds_in = (fun (p, l) -> List.mem p changed || world.C.holds_in (p, l)) } in
  let signature = Exhaustive.signature judged in
  let result pddl world action env =
    Option.map (fun (next, d) -> signature next, C.qred d) (C.step pddl true (C.derived_world pddl world) action env) in
  let instances pddl action = List.sort compare (C.instances pddl (fun _ -> false) action.C.parameters []) in
  List.for_all2 (fun action other_action ->
    let envs = instances problem action in
    envs = instances other other_action
    && List.for_all (fun change -> List.for_all (fun env ->
      result problem (change (C.initial problem)) action env = result other (change (C.initial other)) other_action env) envs)
      [Fun.id; all]) problem.C.actions other.C.actions

exception Too_large

(* A plan with a smaller metric, for actions that do not lower it *)
let is_beaten (problem : Reader.problem) names bound =
  let pddl = problem.task in
  let steps = List.concat (List.mapi (fun i action ->
    List.map (fun env -> nat i, action, env) (C.instances pddl (C.pruned pddl names action) action.C.parameters [])) pddl.C.actions) in
  let signature = Exhaustive.signature problem and visited = Hashtbl.create 1000 and queue = Queue.create () in
  let metric world spent = C.final_metric pddl world spent in
  let is_better world spent = match metric world spent with Some m -> not (C.qle_bool bound m) | None -> false in
  let add world spent =
    let key = signature world, C.qred spent in
    if is_better world spent && not (Hashtbl.mem visited key) then begin
      Hashtbl.replace visited key (); Queue.add (Exhaustive.memoized world, spent) queue
    end in
  add (C.initial pddl) zero;
  let rec visit () =
    if Hashtbl.length visited > 30_000 then raise Too_large;
    if Queue.is_empty queue then false
    else
      let world, spent = Queue.pop queue in
      C.execute pddl true world spent [] <> None || begin
        List.iter (fun (_, action, env) -> match C.step pddl true world action env with
          | Some (next, d) -> add next (C.qred (C.qplus spent (C.qplus (C.qmult pddl.C.per_time d) pddl.C.per_step)))
          | None -> ()) steps;
        visit ()
      end in
  visit ()
let is_optimal (problem : Reader.problem) names plan bound =
  (match C.execute problem.task false (C.initial problem.task) zero plan with
   | Some (world, spent) -> (match C.final_metric problem.task world spent with Some m -> C.qeq_bool m bound | None -> false)
   | None -> false) && not (is_beaten problem names bound)

(* Random changes *)

let pick list = List.nth list (Random.int (List.length list))
let change_at i change list = List.concat (List.mapi (fun j item -> if i = j then change item else [item]) list)
let change_one change list = if list = [] then list else change_at (Random.int (List.length list)) change list
let numbers = ["0"; "0.5"; "1"; "1.5"; "2"; "3"; "5"; "20"; "90"]
let change_symbol symbols = function
  | C.Literal (C.Numeric _) -> C.Literal (C.Numeric (decimal (pick numbers)))
  | C.Literal (C.Boolean b) -> C.Literal (C.Boolean (not b))
  | _ -> pick symbols
let change_fact symbols (p, l) = p, change_one (fun s -> [change_symbol symbols s]) l
let rec change_expression names = function
  | Word word when is_number word -> Word (pick (List.tl numbers))          (* 0 as a duration adds conditions *)
  | Word _ -> Word (pick names)
  | List [] -> List []
  | List (Word "=" :: items) -> List (Word "=" :: change_one (fun item -> [change_expression names item]) items)
  | List (head :: items) -> List (head :: change_one (fun item -> [change_expression names item]) items)
let change_problem text_ =
  let head, sections_ = sections text_ in
  let names = List.map fst (typed (section ":objects" sections_)) in
  let change = function
    | List (Word (":init" | ":goal" as name) :: items) when name = ":init" || Random.int 4 = 0 ->
      List (Word name :: change_one (fun item -> if name = ":init" && Random.int 3 = 0 then [] else [change_expression names item]) items)
    | section -> section in
  text (List (Word "define" :: head :: List.map change sections_))

let () =
  let directory = Sys.argv.(1) and count = int_of_string Sys.argv.(3) in
  Random.init (int_of_string Sys.argv.(4));
  let read name = read_file (Filename.concat directory name) in
  let origin = Json.json (read "origin.json") in
  let domain_text = Json.string (Json.field origin "domain") and problem_text = Json.string (Json.field origin "problem") in
  let knowledge = Knowledge.knowledge_base (read "knowledge.nt") (read "origin.json") in
  let all_steps knowledge = Derive.steps knowledge.C.implications (List.map (fun fact -> fact, C.Stated) knowledge.C.stated) in
  let mission knowledge steps problem_text =
    let fields = match origin with Json.Object fields -> fields | _ -> failwith "origin.json" in
    let fields = List.map (fun (name, item) -> name, if name = "problem" then Json.String problem_text else item) fields in
    Mission.read ~derive:Derive.steps knowledge steps (Json.Object fields) (read "problem.pddl") in
  let original = mission knowledge (all_steps knowledge) problem_text in
  let evidence = Evidence.read original.problem.action_names (read_file Sys.argv.(2)) in
  let plan = Reader.plan original.problem (read "plan.txt") and claim = Reader.claim original.problem evidence.claim in
  let bound = match claim with Some m -> m | None -> failwith "a plan is expected" in
  let linked { Mission.mission; steps; _ } =
    let index = C.index_of (List.map fst steps) and orders = Derive.orders mission steps in
    if C.check_derivations mission.C.mission_knowledge (Knowledge.levels mission.C.mission_knowledge) steps && C.can_fill mission index orders
    then Some (C.fill mission index orders) else None in
  let accepts { Mission.mission; steps; _ } =
    C.check_mission mission (Knowledge.levels mission.C.mission_knowledge) steps (Derive.orders mission steps) evidence.ground_task
      evidence.names evidence.case evidence.goal_case evidence.argument evidence.labels_at plan claim in
  if not (accepts original) then failwith "the certificate itself is not accepted";
  let is_plain = List.exists (fun (_, addition) -> addition <> None) original.mission.C.schemas in
  let judge steps problem_text = judged (if is_plain then read "domain.pddl" else domain_text) problem_text (List.map fst steps) in
  let names_of locals = List.map (fun local -> Knowledge.name_key (tomasys ^ local)) locals in
  (* In a plain domain, changes of these facts change the actions, and so do changes of the attributes that are estimated
     for some design of a function. *)
  let actions_from = names_of ["Action"; "Function"; "Requirement"; "requiresF"; "requiresQuality"; "inContext"; "isQAtype"] in
  let concerns steps = List.sort_uniq compare (List.filter (fun (p, _) -> p = key "concerns") (List.map fst steps)) in
  let is_judged { Mission.steps; _ } = not is_plain || concerns steps = concerns original.steps in
  let with_facts change =
    let is_changed (p, _) = not is_plain || not (List.mem p actions_from) in
    let changed, kept = List.partition is_changed knowledge.C.stated in
    { knowledge with C.stated = change changed @ kept } in
  let symbols = List.sort_uniq compare (List.concat_map snd knowledge.C.stated) in
  let failures = List.concat_map (fun (p, l) ->
    let is local = p = Knowledge.name_key (tomasys ^ local) in
    let text value = C.Literal (Knowledge.literal value (Knowledge.xsd ^ "string")) in
    if is "Component" then [Knowledge.name_key (tomasys ^ "c_status"), l @ [text "FALSE"]]
    else if is "FunctionDesign" then [Knowledge.name_key (tomasys ^ "fd_realisability"), l @ [C.Literal (C.Boolean false)]]
    else []) knowledge.C.stated in
  let accepted = ref 0 and rejected = ref 0 and unlinked = ref 0 and unjudged = ref 0 and undecided = ref 0 and unreadable = ref 0 in
  for i = 1 to count do
    let knowledge, problem_text, false_facts = match Random.int 6 with
      | 0 | 1 -> with_facts (change_one (fun _ -> [])), problem_text, false
      | 2 -> with_facts (change_one (fun fact -> [change_fact symbols fact])), problem_text, false
      | 3 -> { knowledge with C.stated = pick failures :: knowledge.C.stated }, problem_text, false
      | 4 -> knowledge, problem_text, true
      | _ -> knowledge, change_problem problem_text, false in
    let right = all_steps knowledge in
    (* Other facts than those that hold: one is missing, or one more is stated. *)
    let steps = if not false_facts then right
      else if Random.bool () then change_one (fun _ -> []) right else right @ [pick failures, C.Stated] in
    match mission knowledge steps problem_text with
    | exception (Rejected _ | Failure _ | Invalid_argument _ | Not_found) -> incr unreadable
    | changed when not (is_judged changed) -> incr unjudged
    | changed ->
      match linked changed with
      | exception Rejected _ -> incr unreadable
      | None -> incr unlinked
      | Some problem ->
        if List.sort_uniq compare (List.map fst steps) <> List.sort_uniq compare (List.map fst right) then
          (Printf.printf "false facts are accepted (change %d)\n" i; exit 1);
        let judged = judge right problem_text in
        if not (agree problem judged) then (Printf.printf "the problem is not that of the judge (change %d)\n" i; exit 1);
        let is_accepted = accepts changed in
        if not is_accepted then incr rejected
        else match is_optimal judged evidence.names plan bound with
          | exception Too_large -> incr undecided
          | false -> Printf.printf "a false claim is accepted (change %d)\n" i; exit 1
          | true -> incr accepted
  done;
  Printf.printf "%d changed missions: %d with the judge's problem, for which %d true claims and no false claim are accepted" count
    (!accepted + !rejected + !undecided) !accepted;
  Printf.printf "; %d without a problem, %d not judged" !unlinked (!unjudged + !unreadable);
  if !undecided > 0 then Printf.printf "; %d accepted claims not decided" !undecided;
  print_newline ();
  if !accepted + !undecided = 0 || !rejected = 0 then (print_endline "no claim is accepted, or all are"; exit 1)
