(* Reads JSON. Believed for knowledge bases; prepare.ml uses it, too. *)
type json = Number of string | String of string | Bool of bool | Null | Array of json list | Object of (string * json) list

(* UTF-8 of a code point *)
let add_character buffer code =
  if not (Uchar.is_valid code) then Reader.reject "not a character: U+%X" code;
  Buffer.add_utf_8_uchar buffer (Uchar.of_int code)
let hexadecimal text start length =
  let digits = if start + length <= String.length text then String.sub text start length else "" in
  let is_digit = function '0' .. '9' | 'a' .. 'f' | 'A' .. 'F' -> true | _ -> false in
  if digits = "" || not (String.for_all is_digit digits) then Reader.reject "%d hexadecimal digits are expected" length;
  int_of_string ("0x" ^ digits)

let json text =
  let position = ref 0 in
  let fail what = Reader.reject "JSON: %s is expected at byte %d" what !position in
  let peek () = if !position < String.length text then text.[!position] else '\000' in
  let rec skip () = match peek () with ' ' | '\n' | '\t' | '\r' -> incr position; skip () | _ -> () in
  let expect c = skip (); if peek () = c then incr position else fail (String.make 1 c) in
  let accept c = skip (); if peek () = c then (incr position; true) else false in
  let constant word value =
    if !position + String.length word <= String.length text && String.sub text !position (String.length word) = word
    then (position := !position + String.length word; value) else fail word in
  let code () = position := !position + 4; hexadecimal text (!position - 4) 4 in
  let string () =
    expect '"';
    let buffer = Buffer.create 16 in
    let rec characters () = match peek () with
      | '"' -> incr position
      | '\000' .. '\031' -> fail "the end of a string"
      | '\\' ->
        incr position;
        let escape = peek () in
        incr position;
        (match escape with
         | 'n' -> Buffer.add_char buffer '\n' | 't' -> Buffer.add_char buffer '\t' | 'r' -> Buffer.add_char buffer '\r'
         | 'b' -> Buffer.add_char buffer '\b' | 'f' -> Buffer.add_char buffer '\012'
         | '"' | '\\' | '/' -> Buffer.add_char buffer escape
         | 'u' ->
           let first = code () in
           if first land 0xfc00 = 0xd800 then begin
             constant "\\u" ();
             let second = code () in
             if second land 0xfc00 <> 0xdc00 then fail "a low surrogate";
             add_character buffer (0x10000 + ((first land 0x3ff) lsl 10) + (second land 0x3ff))
           end
           else add_character buffer first
         | _ -> fail "an escape");
        characters ()
      | c -> Buffer.add_char buffer c; incr position; characters () in
    characters (); Buffer.contents buffer in
  let items close read =
    if accept close then [] else
      let rec more items =
        let items = read () :: items in
        if accept ',' then more items else (expect close; List.rev items) in
      more [] in
  let rec value () =
    skip ();
    match peek () with
    | '{' -> incr position; Object (items '}' (fun () -> skip (); let name = string () in expect ':'; name, value ()))
    | '[' -> incr position; Array (items ']' value)
    | '"' -> String (string ())
    | 't' -> constant "true" (Bool true)
    | 'f' -> constant "false" (Bool false)
    | 'n' -> constant "null" Null
    | '-' | '0' .. '9' ->
      let start = !position in
      while (match peek () with '-' | '+' | '.' | 'e' | 'E' | '0' .. '9' -> true | _ -> false) do incr position done;
      Number (String.sub text start (!position - start))
    | _ -> fail "a value" in
  let document = value () in
  skip ();
  if !position < String.length text then fail "the end of the text";
  document

let array = function Array items -> items | _ -> Reader.reject "JSON: an array is expected"
let string = function String text -> text | _ -> Reader.reject "JSON: a string is expected"
let number = function Number text -> text | _ -> Reader.reject "JSON: a number is expected"
let int item = match int_of_string_opt (number item) with Some n -> n | None -> Reader.reject "JSON: a position is expected"
let optional object_ name = match object_ with
  | Object fields ->
    (match List.filter (fun (other, _) -> other = name) fields with
     | [] -> None
     | [_, item] -> Some item
     | _ -> Reader.reject "JSON: field %s is written twice" name)
  | _ -> Reader.reject "JSON: an object is expected"
let field object_ name = match optional object_ name with Some item -> item | None -> Reader.reject "JSON: no field %s" name
(* Rejects an object without one of the [required] fields, with a field that is neither required nor [permitted], or
   with a field that is written twice. *)
let check_fields item required permitted = match item with
  | Object fields ->
    List.iter (fun (name, _) ->
      if not (List.mem name (required @ permitted)) then Reader.reject "JSON: unknown field %s" name;
      ignore (optional item name)) fields;
    List.iter (fun name -> ignore (field item name)) required
  | _ -> Reader.reject "JSON: an object is expected"
