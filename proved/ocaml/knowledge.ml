(* Reads the knowledge base of a certificate as a value of Datalog.v: N-Triples, rule files, later changes, and
   the derivations. Believed for knowledge bases, with json.ml and reader.ml: it decides which facts are stated,
   and which rules the axioms of OWL 2 RL [1] mean. Constructs that it does not know are rejected by name.
   [1] OWL 2 Web Ontology Language Profiles, W3C 2012, section 4.3. *)
module C = Checker
open Reader
open Json

let xsd = "http://www.w3.org/2001/XMLSchema#" and rdf = "http://www.w3.org/1999/02/22-rdf-syntax-ns#"
and rdfs = "http://www.w3.org/2000/01/rdf-schema#" and owl = "http://www.w3.org/2002/07/owl#"
and swrl = "http://www.w3.org/2003/11/swrl#" and swrlb = "http://www.w3.org/2003/11/swrlb#"

(* Names and values *)

let starts prefix text =
  String.length text >= String.length prefix && String.sub text 0 (String.length prefix) = prefix
let local prefix name = String.sub name (String.length prefix) (String.length name - String.length prefix)
let name_key name = key ("name " ^ name)
let same_as = name_key (owl ^ "sameAs")

(* Names with a meaning of their own; as classes, properties or individuals, they are not covered. *)
let is_reserved name = List.exists (fun prefix -> starts prefix name)
    [owl; rdf; rdfs; xsd; swrl; swrlb; "http://swrl.stanford.edu/"; "http://sqwrl.stanford.edu/"; "urn:metaplan:"]
let plain name = if is_reserved name then reject "not covered: <%s>" name else name_key name

let literal text datatype =
  let number () =
    if starts "+-" text then reject "not a decimal: %s" text;
    C.Numeric (decimal (if starts "+" text then local "+" text else text)) in
  match if starts xsd datatype then local xsd datatype else "" with
  | "string" -> C.Text (List.map (fun c -> integer (Char.code c)) (List.of_seq (String.to_seq text)))
  | "boolean" ->
    (match text with
     | "true" | "1" -> C.Boolean true
     | "false" | "0" -> C.Boolean false
     | _ -> reject "not a boolean: %s" text)
  | "decimal" -> number ()
  | "integer" when not (String.contains text '.') -> number ()
  | _ -> reject "not covered: the value %s of the datatype <%s>" text datatype

(* N-Triples *)

type node = Iri of string | Blank of string | Value of C.xsd_value | Annotation (* text in a language *)

let triple number line =
  let position = ref 0 in
  let fail () = reject "N-Triples: line %d: a statement is expected" number in
  let peek () = if !position < String.length line then line.[!position] else '\n' in
  let rec skip () = if peek () = ' ' || peek () = '\t' then (incr position; skip ()) in
  let until close =
    let buffer = Buffer.create 40 in
    let rec characters () = match peek () with
      | '\n' -> fail ()
      | c when c = close -> incr position
      | '\\' ->
        let escape = if !position + 1 < String.length line then line.[!position + 1] else fail () in
        position := !position + 2;
        let code length = add_character buffer (hexadecimal line !position length); position := !position + length in
        (match escape with
         | 'u' -> code 4 | 'U' -> code 8
         | 'n' -> Buffer.add_char buffer '\n' | 't' -> Buffer.add_char buffer '\t' | 'r' -> Buffer.add_char buffer '\r'
         | 'b' -> Buffer.add_char buffer '\b' | 'f' -> Buffer.add_char buffer '\012'
         | '"' | '\'' | '\\' -> Buffer.add_char buffer escape
         | _ -> fail ());
        characters ()
      | c -> Buffer.add_char buffer c; incr position; characters () in
    incr position; characters (); Buffer.contents buffer in
  let word () =
    let start = !position in
    while not (List.mem (peek ()) [' '; '\t'; '\n']) do incr position done;
    String.sub line start (!position - start) in
  let node () =
    skip ();
    match peek () with
    | '<' ->
      let iri = until '>' in
      if not (String.contains iri ':') then fail ();                (* a relative IRI *)
      Iri iri
    | '_' -> Blank (word ())
    | '"' ->
      let text = until '"' in
      (match peek () with
       | '@' -> ignore (word ()); Annotation
       | '^' ->
         incr position;
         if peek () <> '^' then fail ();
         incr position;
         if peek () = '<' then Value (literal text (until '>')) else fail ()
       | _ -> Value (literal text (xsd ^ "string")))
    | _ -> fail () in
  skip ();
  if peek () = '\n' || peek () = '#' then None
  else begin
    let subject = node () in
    let predicate = match node () with Iri iri -> iri | _ -> fail () in
    let value = node () in
    skip ();
    if peek () <> '.' then fail ();
    incr position; skip ();
    if peek () <> '\n' && peek () <> '#' then fail ();
    Some (subject, predicate, value)
  end

(* Rules as text: SWRL with [not] and [count] *)

type token = Mark of string | Full of string | Name of string | Logical of string | Quoted of string | Numeral of string

let label = "[...]"

let tokens text =
  let length = String.length text in
  let is_part c = match c with 'a' .. 'z' | 'A' .. 'Z' | '0' .. '9' | '_' | '-' -> true | _ -> false in
  let rec scan_while keep i = if i < length && keep text.[i] then scan_while keep (i + 1) else i in
  (* A name may contain full stops but not end with one. *)
  let rec word i =
    let i = scan_while is_part i in
    if i + 1 < length && text.[i] = '.' && is_part text.[i + 1] then word (i + 1) else i in
  let between i j = String.sub text i (j - i) in
  let closing close i = match String.index_from_opt text i close with
    | Some j -> j
    | None -> reject "rules: %c is missing" close in
  let closing_in_line close i =
    let j = closing close i in
    if String.contains (between i j) '\n' then reject "rules: %c is missing in a line" close;
    j in
  let rec next i found =
    let mark length = next (i + length) (Mark (between i (i + length)) :: found) in
    if i >= length then List.rev found
    else match text.[i] with
      | ' ' | '\n' | '\t' | '\r' -> next (i + 1) found
      | '#' -> next (scan_while (fun c -> c <> '\n') i) found
      | '?' ->
        let j = scan_while is_part (i + 1) in
        if j = i + 1 then reject "rules: a variable without a name";
        next j (Logical (between (i + 1) j) :: found)
      | '<' -> let j = closing_in_line '>' i in next (j + 1) (Full (between (i + 1) j) :: found)
      | '[' -> let j = closing_in_line ']' i in next (j + 1) (Mark label :: found)
      | '"' ->
        let j = closing '"' (i + 1) in
        let content = between (i + 1) j in
        if String.contains content '\\' then reject "not covered: an escape in a rule";
        next (j + 1) (Quoted content :: found)
      | '@' -> let j = scan_while is_part (i + 1) in next j (Mark (between i j) :: found)
      | '-' when i + 1 < length && text.[i + 1] = '>' -> mark 2
      | '0' .. '9' | '-' ->
        let j = scan_while (fun c -> '0' <= c && c <= '9') (i + 1) in
        let is_fraction = j + 1 < length && text.[j] = '.' && '0' <= text.[j + 1] && text.[j + 1] <= '9' in
        let j = if is_fraction then scan_while (fun c -> '0' <= c && c <= '9') (j + 1) else j in
        next j (Numeral (between i j) :: found)
      | '^' when i + 1 < length && text.[i + 1] = '^' -> reject "not covered: a datatype in a rule"
      | '^' | ',' | '(' | ')' | '{' | '}' | '|' | '=' | '.' -> mark 1
      | c when is_part c || c = ':' ->
        let j = word i in
        let j = if j < length && text.[j] = ':' then word (j + 1) else j in
        next j (Name (between i j) :: found)
      | c -> reject "rules: unexpected character %C" c in
  next 0 []

(* A test of a built-in; the result names the test of Datalog.v. *)
let comparison name x y = match name with
  | "lessThan" -> C.Test (C.Less, x, y)
  | "lessThanOrEqual" -> C.Test (C.LessOrEqual, x, y)
  | "greaterThan" -> C.Test (C.Less, y, x)
  | "greaterThanOrEqual" -> C.Test (C.LessOrEqual, y, x)
  | "equal" -> C.Test (C.Identical, x, y)
  | "notEqual" -> C.Test (C.NotIdentical, x, y)
  | _ -> reject "not covered: the built-in %s" name
let variable name = key ("variable " ^ name)
let constant value = C.Symbol (C.Literal value)

let variables_of_pattern (_, arguments) =
  List.filter_map (function C.RuleVariable x -> Some x | C.Symbol _ -> None) arguments
(* In a count, variables that occur elsewhere in the body have their value from there. *)
let with_local body =
  let outer i = List.concat (List.mapi (fun j premise -> if i = j then [] else match premise with
    | C.Present pattern | C.Absent pattern -> variables_of_pattern pattern
    | C.Test (_, x, y) -> variables_of_pattern ((), [x; y])
    | C.Count _ -> []) body) in
  List.mapi (fun i premise -> match premise with
    | C.Count (n, _, inner) ->
      let outer = outer i in
      let local = List.filter (fun x -> not (List.mem x outer)) (List.concat_map variables_of_pattern inner) in
      C.Count (n, List.sort_uniq compare local, inner)
    | premise -> premise) body

let rules text =
  let input = ref (tokens text) and prefixes = ref ["swrlb", swrlb; "xsd", xsd; "rdf", rdf; "rdfs", rdfs; "owl", owl] in
  let next () = match !input with
    | token :: others -> input := others; token
    | [] -> reject "rules: the text ends within a rule" in
  let accept token = match !input with other :: others when other = token -> input := others; true | _ -> false in
  let expect mark = if not (accept (Mark mark)) then reject "rules: %s is expected" mark in
  let resolved name = match String.index_opt name ':' with
    | Some i ->
      (match List.assoc_opt (String.sub name 0 i) !prefixes with
       | Some iri -> iri ^ String.sub name (i + 1) (String.length name - i - 1)
       | None -> reject "rules: the prefix of %s is not declared" name)
    | None -> Option.value (List.assoc_opt "" !prefixes) ~default:"" ^ name in
  let argument () = match next () with
    | Logical name -> C.RuleVariable (variable name)
    | Quoted text -> (match !input with
        | Mark mark :: _ when mark.[0] = '@' -> reject "not covered: text in a language in a rule"
        | _ -> constant (literal text (xsd ^ "string")))
    | Numeral text -> constant (literal text (xsd ^ "decimal"))
    | Name ("true" | "false" as text) -> constant (literal text (xsd ^ "boolean"))
    | Name name -> C.Symbol (C.Name (plain (resolved name)))
    | Full iri -> C.Symbol (C.Name (plain iri))
    | Mark mark -> reject "rules: an argument is expected, not %s" mark in
  let rec separated read separators =
    let first = read () in
    if List.exists (fun mark -> accept (Mark mark)) separators then first :: separated read separators else [first] in
  let arguments () = expect "("; let items = separated argument [","] in expect ")"; items in
  let predicate = function
    | Name name -> resolved name
    | Full iri -> iri
    | _ -> reject "rules: a name is expected" in
  let pattern () = match next () with
    | Name ("sameAs" | "differentFrom" as name) -> reject "not covered: %s in a rule" name
    | name -> let key = plain (predicate name) in key, arguments () in
  let premise () = match !input with
    | Numeral n :: Mark "=" :: Name "count" :: others ->
      input := others;
      expect "{";
      let inner = separated pattern ["^"; ","] in
      expect "}";
      (match int_of_string_opt n with
       | Some n when n >= 0 && n < 1_000_000 -> C.Count (nat n, [], inner)
       | _ -> reject "not covered: count %s" n)
    | _ :: Mark "=" :: _ -> reject "not covered: an aggregate other than a number of matches"
    | Name "not" :: others when List.nth_opt others 0 <> Some (Mark "(") -> input := others; C.Absent (pattern ())
    | (Name _ | Full _ as name) :: others when starts swrlb (predicate name) ->
      input := others;
      (match arguments () with
       | [x; y] -> comparison (local swrlb (predicate name)) x y
       | _ -> reject "rules: a built-in has two arguments")
    | _ -> C.Present (pattern ()) in
  let rec read found = match !input with
    | [] -> List.rev found
    | (Mark ("@prefix") | Name "prefix") :: Name prefix :: Full iri :: others when prefix <> "" && prefix.[String.length prefix - 1] = ':' ->
      input := others;
      ignore (accept (Mark "."));
      prefixes := (String.sub prefix 0 (String.length prefix - 1), iri) :: !prefixes;
      read found
    | _ ->
      ignore (accept (Mark label));
      let premises = match !input with Mark "->" :: _ -> [] | _ -> separated premise ["^"; ","] in
      expect "->";
      let is_constraint = match !input with [] | Mark "." :: _ -> true | _ -> false in
      let conclusions = if is_constraint then [] else separated (fun () -> C.Concludes (pattern ())) ["^"; ","] in
      ignore (accept (Mark "."));
      read ({ C.premises = with_local premises; conclusions } :: found) in
  read []

(* Documents: the axioms of OWL 2 RL as rules *)

let annotations =
  List.map (fun name -> rdfs ^ name) ["comment"; "label"; "seeAlso"; "isDefinedBy"] @ [owl ^ "versionInfo"]
let at_most_listed = 16                     (* larger sets of disjoint classes are not covered *)

let document text =
  (* LF, CR and CR LF end a line. *)
  let lines = List.concat (List.mapi (fun i line ->
    List.map (fun part -> i + 1, part) (String.split_on_char '\r' line)) (String.split_on_char '\n' text)) in
  let triples = List.filter_map (fun (number, line) -> triple number line) lines in
  (* Blank nodes are numbered by their first occurrence, as in the derivations. *)
  let labels = Hashtbl.create 50 in
  let numbered = function
    | Blank label ->
      if not (Hashtbl.mem labels label) then Hashtbl.add labels label (Printf.sprintf "d0b%d" (Hashtbl.length labels));
      Blank (Hashtbl.find labels label)
    | node -> node in
  let triples = List.map (fun (subject, predicate, value) ->
    let subject = numbered subject in
    subject, predicate, numbered value) triples in
  let triples = List.sort_uniq compare triples in
  let by_subject = Hashtbl.create 1000 in
  List.iter (fun (subject, predicate, value) -> Hashtbl.add by_subject subject (predicate, value)) triples;
  let used = Hashtbl.create 100 in
  let described node = Hashtbl.replace used node (); Hashtbl.find_all by_subject node in
  let show = function Iri iri -> "<" ^ iri ^ ">" | Blank label -> label | Value _ -> "a value" | Annotation -> "text in a language" in
  let types node = List.filter_map (function
    | predicate, Iri kind when predicate = rdf ^ "type" -> Some kind
    | _ -> None) (Hashtbl.find_all by_subject node) in
  let is kind iri = List.mem kind (types (Iri iri)) in
  let kinds = List.map (fun kind -> owl ^ kind) ["ObjectProperty"; "DatatypeProperty"; "AnnotationProperty"] in
  let class_of iri = if is (owl ^ "Class") iri then plain iri else reject "not covered: <%s>, which is not declared as a class" iri in
  let property iri = match List.filter (fun kind -> is kind iri) kinds with
    | [kind] -> plain iri, local owl kind
    | _ -> reject "not covered: <%s>, which is not declared as a property of one kind" iri in
  let only_iri = function Iri iri -> iri | node -> reject "not covered: %s instead of a name" (show node) in
  (* A blank node without structure is an anonymous individual. *)
  let is_individual = function
    | Iri _ -> true
    | Blank _ as node ->
      List.for_all (function
        | predicate, Iri kind when predicate = rdf ^ "type" -> not (is_reserved kind)
        | predicate, _ -> not (is_reserved predicate) || List.mem predicate annotations) (Hashtbl.find_all by_subject node)
    | _ -> false in
  let class_node node = class_of (only_iri node) in
  let name_node = function
    | Blank label as node when is_individual node -> name_key ("urn:metaplan:anonymous:" ^ label)
    | node -> plain (only_iri node) in

  let x = C.RuleVariable (variable "x") and y = C.RuleVariable (variable "y") and z = C.RuleVariable (variable "z") in
  let facts = ref [] and rules = ref [] in
  let rule premises conclusions = rules := { C.premises; conclusions } :: !rules in
  let implies premises pattern = rule (List.map (fun premise -> C.Present premise) premises) [C.Concludes pattern] in
  let state predicate arguments = facts := (predicate, arguments) :: !facts in
  let field node name items = match List.filter (fun (predicate, _) -> predicate = name) items with
    | [_, value] -> value
    | _ -> reject "not covered: %s has not one %s" (show node) name in
  (* Rejects types other than [kinds], and predicates other than [allowed]. *)
  let only node kinds allowed items = List.iter (fun (predicate, value) ->
    let is_allowed =
      if predicate = rdf ^ "type" then List.exists (fun kind -> value = Iri kind) kinds else List.mem predicate allowed in
    if not is_allowed then reject "not covered: %s of %s" predicate (show node)) items in
  let members list =
    let rec after visited node =
      if node = Iri (rdf ^ "nil") then [] else begin
        if List.mem node visited then reject "not covered: a list that contains itself, %s" (show node);
        let items = described node in
        only node [rdf ^ "List"; swrl ^ "AtomList"] [rdf ^ "first"; rdf ^ "rest"] items;
        let first = field node (rdf ^ "first") items in
        first :: after (node :: visited) (field node (rdf ^ "rest") items)
      end in
    after [] list in
  let disjoint classes =
    if List.length classes > at_most_listed then reject "not covered: more than %d disjoint classes" at_most_listed;
    List.iteri (fun i a -> List.iteri (fun j b -> if i < j then rule [C.Present (a, [x]); C.Present (b, [x])] []) classes) classes in
  let data_range p node =
    let violated tests = rule (C.Present (p, [x; y]) :: tests) [] in
    match node with
    | Iri iri when starts xsd iri ->
      let kind = match local xsd iri with
        | "string" -> C.AnyText | "boolean" -> C.AnyBoolean | "decimal" -> C.AnyNumber | "integer" -> C.AnyInteger
        | _ -> reject "not covered: the datatype <%s>" iri in
      violated [C.Test (C.Outside kind, y, y)]
    | Blank _ ->
      let items = described node in
      only node [rdfs ^ "Datatype"; owl ^ "DataRange"] [owl ^ "oneOf"] items;
      violated (List.map (function
        | Value value -> C.Test (C.Different, y, constant value)
        | other -> reject "not covered: %s in a list of values" (show other)) (members (field node (owl ^ "oneOf") items)))
    | _ -> reject "not covered: the datatype %s" (show node) in
  (* SWRL in RDF *)
  let swrl_rule node =
    let items = described node in
    let argument = function
      | Iri iri when is (swrl ^ "Variable") iri -> C.RuleVariable (variable iri)
      | Iri iri -> C.Symbol (C.Name (plain iri))
      | Value value -> constant value
      | other -> reject "not covered: %s in a rule" (show other) in
    let atom node =
      let items = described node in
      let get name = field node (swrl ^ name) items in
      let only names = only node (types node) (List.map (fun name -> swrl ^ name) names) items in
      match types node with
      | [kind] when kind = swrl ^ "ClassAtom" ->
        only ["classPredicate"; "argument1"];
        C.Present (class_node (get "classPredicate"), [argument (get "argument1")])
      | [kind] when kind = swrl ^ "IndividualPropertyAtom" || kind = swrl ^ "DatavaluedPropertyAtom" ->
        only ["propertyPredicate"; "argument1"; "argument2"];
        C.Present (fst (property (only_iri (get "propertyPredicate"))), [argument (get "argument1"); argument (get "argument2")])
      | [kind] when kind = swrl ^ "BuiltinAtom" ->
        only ["builtin"; "arguments"];
        let name = only_iri (get "builtin") in
        (match List.map argument (members (get "arguments")) with
         | [x; y] when starts swrlb name -> comparison (local swrlb name) x y
         | _ -> reject "not covered: the built-in <%s>" name)
      | _ -> reject "not covered: an atom of a rule, %s" (show node) in
    only node (types node) ([swrl ^ "body"; swrl ^ "head"] @ annotations) items;
    let conclusion node = match atom node with
      | C.Present pattern -> C.Concludes pattern
      | _ -> reject "not covered: a built-in as a conclusion" in
    rule (List.map atom (members (field node (swrl ^ "body") items))) (List.map conclusion (members (field node (swrl ^ "head") items))) in

  let typed subject kind =
    let p () = fst (property (only_iri subject)) in
    let equates premises = rule (List.map (fun premise -> C.Present premise) premises) [C.Equates (y, z)] in
    let is_object () = snd (property (only_iri subject)) = "ObjectProperty" in
    let object_only () = if not (is_object ()) then reject "not covered: <%s> of %s" kind (show subject) in
    match if starts owl kind then local owl kind else "" with
    | "Ontology" | "Class" | "ObjectProperty" | "DatatypeProperty" | "AnnotationProperty" | "NamedIndividual" ->
      ignore (only_iri subject); ignore (name_node subject)
    | "FunctionalProperty" when is_object () -> equates [p (), [x; y]; p (), [x; z]]
    | "FunctionalProperty" -> rule [C.Present (p (), [x; y]); C.Present (p (), [x; z]); C.Test (C.Different, y, z)] []
    | "InverseFunctionalProperty" -> object_only (); equates [p (), [y; x]; p (), [z; x]]
    | "SymmetricProperty" -> object_only (); implies [p (), [x; y]] (p (), [y; x])
    | "TransitiveProperty" -> object_only (); implies [p (), [x; y]; p (), [y; z]] (p (), [x; z])
    | "AllDisjointClasses" ->
      let items = described subject in
      only subject (types subject) [owl ^ "members"] items;
      disjoint (List.map class_node (members (field subject (owl ^ "members") items)))
    | _ when kind = swrl ^ "Imp" -> swrl_rule subject
    | _ when kind = swrl ^ "Variable" -> ()
    | _ -> state (class_of kind) [C.Name (name_node subject)] in
  let top node =
    is_individual node || List.exists (fun kind -> kind = owl ^ "AllDisjointClasses" || kind = swrl ^ "Imp") (types node) in
  List.iter (fun (subject, predicate, value) ->
    if top subject then
      let is_rule = List.mem (swrl ^ "Imp") (types subject) and is_set = List.mem (owl ^ "AllDisjointClasses") (types subject) in
      let name_in prefix = if starts prefix predicate then local prefix predicate else "" in
      match name_in rdfs, name_in owl with
      | _ when predicate = rdf ^ "type" -> typed subject (only_iri value)
      | _ when is_rule || is_set -> ()                              (* read with the type *)
      | _ when List.mem predicate annotations -> ()
      | _, "versionIRI" -> ()
      | "subClassOf", _ -> implies [class_node subject, [x]] (class_node value, [x])
      | _, "disjointWith" -> disjoint [class_node subject; class_node value]
      | _, "equivalentClass" ->
        implies [class_node subject, [x]] (class_node value, [x]);
        implies [class_node value, [x]] (class_node subject, [x])
      | "subPropertyOf", _ ->
        let (p, kind), (q, other) = property (only_iri subject), property (only_iri value) in
        if kind <> other then reject "not covered: properties of different kinds";
        if kind <> "AnnotationProperty" then implies [p, [x; y]] (q, [x; y])
      | _, "inverseOf" ->
        let (p, kind), (q, other) = property (only_iri subject), property (only_iri value) in
        if (kind, other) <> ("ObjectProperty", "ObjectProperty") then reject "not covered: the inverse of data";
        implies [p, [x; y]] (q, [y; x]);
        implies [q, [x; y]] (p, [y; x])
      | ("domain" | "range"), _ when snd (property (only_iri subject)) = "AnnotationProperty" -> ()
      | "domain", _ -> implies [fst (property (only_iri subject)), [x; y]] (class_node value, [x])
      | "range", _ ->
        let p, kind = property (only_iri subject) in
        if kind = "ObjectProperty" then implies [p, [x; y]] (class_node value, [y]) else data_range p value
      | _ ->
        let p, kind = property predicate in
        (match kind, value with
         | "AnnotationProperty", _ -> ()
         | "ObjectProperty", (Iri _ | Blank _) -> state p [C.Name (name_node subject); C.Name (name_node value)]
         | "DatatypeProperty", Value value -> state p [C.Name (name_node subject); C.Literal value]
         | _ -> reject "not covered: the value %s of <%s>" (show value) predicate)) triples;
  List.iter (fun (subject, predicate, _) ->
    if not (top subject || Hashtbl.mem used subject) then reject "not covered: <%s> of %s" predicate (show subject)) triples;
  !facts, List.rev !rules

(* The certificate *)

let change item =
  let argument item = match item with
    | Object ["name", String name] -> C.Name (plain name)
    | Object ["literal", Array [String text; String datatype]] -> C.Literal (literal text datatype)
    | _ -> reject "origin.json: an argument is expected" in
  check_fields item ["predicate"; "arguments"] [];
  plain (string (field item "predicate")), List.map argument (array (field item "arguments"))

let knowledge_base document_text origin_text =
  let facts, axioms = document document_text in
  let origin = json origin_text in
  let file item = match item with
    | Array [String _; String text] -> rules text
    | _ -> reject "origin.json: a rule file is expected" in
  check_fields origin ["domain"; "problem"; "bindings"; "rules"; "shipped"; "changes"] ["names"];
  let changes = field origin "changes" in
  check_fields changes ["added"; "removed"] [];
  let listed name = List.map change (array (field changes name)) in
  let removed = listed "removed" and added = listed "added" in
  { C.stated = List.filter (fun fact -> not (List.mem fact removed)) facts @ added;
    implications = axioms @ List.concat_map file (array (field origin "rules")); same_as }

(* The steps of derivations.json: the facts are claimed, their reasons are not believed. *)
let derivations text =
  let document = json text in
  check_fields document ["format"; "terms"; "rules"; "steps"] [];
  if field document "format" <> String "metaplan-derivations/1" then reject "derivations.json has another format";
  let term = function
    | String name -> C.Name (name_key name)
    | Array [String text; String datatype] -> C.Literal (literal text datatype)
    | _ -> reject "derivations.json: a term is expected" in
  let terms = Array.of_list (List.map (fun item -> lazy (term item)) (array (field document "terms"))) in
  let term item =
    let i = int item in
    if i >= 0 && i < Array.length terms then Lazy.force terms.(i) else reject "derivations.json: no term %d" i in
  let step item =
    check_fields item ["fact"] ["rule"; "bindings"; "supports"];
    let fact = match List.map term (array (field item "fact")) with
      | C.Name predicate :: arguments -> predicate, arguments
      | _ -> reject "derivations.json: a fact is expected" in
    let support item =
      let i = int item in
      if i < 0 || i = max_int then reject "derivations.json: no step %d" i;
      positive (i + 1) in
    fact, match optional item "supports" with
    | None -> C.Stated
    | Some supports -> C.Derived (List.map support (array supports)) in
  List.map step (array (field document "steps"))

(* Levels of the relations: the least ones that Derivations.v accepts, if there are any. Not believed. *)
let levels { C.implications; same_as; _ } =
  let levels = Hashtbl.create 100 in
  let level predicate = Option.value (Hashtbl.find_opt levels predicate) ~default:0 in
  let needed = function
    | C.Present (p, _) -> level p
    | C.Absent (p, _) -> level p + 1
    | C.Test _ -> 0
    | C.Count (_, _, inner) -> List.fold_left (fun n (p, _) -> max n (level p + 1)) 0 inner in
  let raise_all () = List.fold_left (fun changed { C.premises; conclusions } ->
    let n = List.fold_left (fun n premise -> max n (needed premise)) 0 premises in
    List.fold_left (fun changed conclusion ->
      let p = match conclusion with C.Concludes (p, _) -> p | C.Equates _ -> same_as in
      if level p < n then (Hashtbl.replace levels p n; true) else changed) changed conclusions) false implications in
  let rec repeat rounds = if rounds > 0 && raise_all () then repeat (rounds - 1) in
  repeat (List.length implications + 1);
  fun predicate -> nat (level predicate)
