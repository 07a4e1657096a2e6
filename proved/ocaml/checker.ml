
(** val negb : bool -> bool **)

let negb = function
| true -> false
| false -> true

type nat =
| O
| S of nat

(** val option_map : ('a1 -> 'a2) -> 'a1 option -> 'a2 option **)

let option_map f = function
| Some a -> Some (f a)
| None -> None

(** val fst : ('a1 * 'a2) -> 'a1 **)

let fst = function
| (x, _) -> x

(** val snd : ('a1 * 'a2) -> 'a2 **)

let snd = function
| (_, y) -> y

(** val length : 'a1 list -> nat **)

let rec length = function
| [] -> O
| _ :: l' -> S (length l')

(** val app : 'a1 list -> 'a1 list -> 'a1 list **)

let rec app l m =
  match l with
  | [] -> m
  | a :: l1 -> a :: (app l1 m)

type comparison =
| Eq
| Lt
| Gt

(** val compOpp : comparison -> comparison **)

let compOpp = function
| Eq -> Eq
| Lt -> Gt
| Gt -> Lt

module Coq__1 = struct
 (** val add : nat -> nat -> nat **)
 let rec add n m =
   match n with
   | O -> m
   | S p -> S (add p m)
end
include Coq__1

(** val sub : nat -> nat -> nat **)

let rec sub n m =
  match n with
  | O -> n
  | S k -> (match m with
            | O -> n
            | S l -> sub k l)

type positive =
| XI of positive
| XO of positive
| XH

type z =
| Z0
| Zpos of positive
| Zneg of positive

(** val eqb : bool -> bool -> bool **)

let eqb b1 b2 =
  if b1 then b2 else if b2 then false else true

module type EqLtLe =
 sig
  type t
 end

module MakeOrderTac =
 functor (O:EqLtLe) ->
 functor (P:sig
 end) ->
 struct
 end

module Nat =
 struct
  (** val eqb : nat -> nat -> bool **)

  let rec eqb n m =
    match n with
    | O -> (match m with
            | O -> true
            | S _ -> false)
    | S n' -> (match m with
               | O -> false
               | S m' -> eqb n' m')

  (** val leb : nat -> nat -> bool **)

  let rec leb n m =
    match n with
    | O -> true
    | S n' -> (match m with
               | O -> false
               | S m' -> leb n' m')

  (** val ltb : nat -> nat -> bool **)

  let ltb n m =
    leb (S n) m
 end

module Pos =
 struct
  type mask =
  | IsNul
  | IsPos of positive
  | IsNeg
 end

module Coq_Pos =
 struct
  (** val succ : positive -> positive **)

  let rec succ = function
  | XI p -> XO (succ p)
  | XO p -> XI p
  | XH -> XO XH

  (** val add : positive -> positive -> positive **)

  let rec add x y =
    match x with
    | XI p ->
      (match y with
       | XI q0 -> XO (add_carry p q0)
       | XO q0 -> XI (add p q0)
       | XH -> XO (succ p))
    | XO p ->
      (match y with
       | XI q0 -> XI (add p q0)
       | XO q0 -> XO (add p q0)
       | XH -> XI p)
    | XH -> (match y with
             | XI q0 -> XO (succ q0)
             | XO q0 -> XI q0
             | XH -> XO XH)

  (** val add_carry : positive -> positive -> positive **)

  and add_carry x y =
    match x with
    | XI p ->
      (match y with
       | XI q0 -> XI (add_carry p q0)
       | XO q0 -> XO (add_carry p q0)
       | XH -> XI (succ p))
    | XO p ->
      (match y with
       | XI q0 -> XO (add_carry p q0)
       | XO q0 -> XI (add p q0)
       | XH -> XO (succ p))
    | XH ->
      (match y with
       | XI q0 -> XI (succ q0)
       | XO q0 -> XO (succ q0)
       | XH -> XI XH)

  (** val pred_double : positive -> positive **)

  let rec pred_double = function
  | XI p -> XI (XO p)
  | XO p -> XI (pred_double p)
  | XH -> XH

  type mask = Pos.mask =
  | IsNul
  | IsPos of positive
  | IsNeg

  (** val succ_double_mask : mask -> mask **)

  let succ_double_mask = function
  | IsNul -> IsPos XH
  | IsPos p -> IsPos (XI p)
  | IsNeg -> IsNeg

  (** val double_mask : mask -> mask **)

  let double_mask = function
  | IsPos p -> IsPos (XO p)
  | x0 -> x0

  (** val double_pred_mask : positive -> mask **)

  let double_pred_mask = function
  | XI p -> IsPos (XO (XO p))
  | XO p -> IsPos (XO (pred_double p))
  | XH -> IsNul

  (** val sub_mask : positive -> positive -> mask **)

  let rec sub_mask x y =
    match x with
    | XI p ->
      (match y with
       | XI q0 -> double_mask (sub_mask p q0)
       | XO q0 -> succ_double_mask (sub_mask p q0)
       | XH -> IsPos (XO p))
    | XO p ->
      (match y with
       | XI q0 -> succ_double_mask (sub_mask_carry p q0)
       | XO q0 -> double_mask (sub_mask p q0)
       | XH -> IsPos (pred_double p))
    | XH -> (match y with
             | XH -> IsNul
             | _ -> IsNeg)

  (** val sub_mask_carry : positive -> positive -> mask **)

  and sub_mask_carry x y =
    match x with
    | XI p ->
      (match y with
       | XI q0 -> succ_double_mask (sub_mask_carry p q0)
       | XO q0 -> double_mask (sub_mask p q0)
       | XH -> IsPos (pred_double p))
    | XO p ->
      (match y with
       | XI q0 -> double_mask (sub_mask_carry p q0)
       | XO q0 -> succ_double_mask (sub_mask_carry p q0)
       | XH -> double_pred_mask p)
    | XH -> IsNeg

  (** val sub : positive -> positive -> positive **)

  let sub x y =
    match sub_mask x y with
    | IsPos z0 -> z0
    | _ -> XH

  (** val mul : positive -> positive -> positive **)

  let rec mul x y =
    match x with
    | XI p -> add y (XO (mul p y))
    | XO p -> XO (mul p y)
    | XH -> y

  (** val size_nat : positive -> nat **)

  let rec size_nat = function
  | XI p0 -> S (size_nat p0)
  | XO p0 -> S (size_nat p0)
  | XH -> S O

  (** val compare_cont : comparison -> positive -> positive -> comparison **)

  let rec compare_cont r x y =
    match x with
    | XI p ->
      (match y with
       | XI q0 -> compare_cont r p q0
       | XO q0 -> compare_cont Gt p q0
       | XH -> Gt)
    | XO p ->
      (match y with
       | XI q0 -> compare_cont Lt p q0
       | XO q0 -> compare_cont r p q0
       | XH -> Gt)
    | XH -> (match y with
             | XH -> r
             | _ -> Lt)

  (** val compare : positive -> positive -> comparison **)

  let compare =
    compare_cont Eq

  (** val eqb : positive -> positive -> bool **)

  let rec eqb p q0 =
    match p with
    | XI p0 -> (match q0 with
                | XI q1 -> eqb p0 q1
                | _ -> false)
    | XO p0 -> (match q0 with
                | XO q1 -> eqb p0 q1
                | _ -> false)
    | XH -> (match q0 with
             | XH -> true
             | _ -> false)

  (** val ggcdn :
      nat -> positive -> positive -> positive * (positive * positive) **)

  let rec ggcdn n a b =
    match n with
    | O -> (XH, (a, b))
    | S n0 ->
      (match a with
       | XI a' ->
         (match b with
          | XI b' ->
            (match compare a' b' with
             | Eq -> (a, (XH, XH))
             | Lt ->
               let (g, p) = ggcdn n0 (sub b' a') a in
               let (ba, aa) = p in (g, (aa, (add aa (XO ba))))
             | Gt ->
               let (g, p) = ggcdn n0 (sub a' b') b in
               let (ab, bb) = p in (g, ((add bb (XO ab)), bb)))
          | XO b0 ->
            let (g, p) = ggcdn n0 a b0 in
            let (aa, bb) = p in (g, (aa, (XO bb)))
          | XH -> (XH, (a, XH)))
       | XO a0 ->
         (match b with
          | XI _ ->
            let (g, p) = ggcdn n0 a0 b in
            let (aa, bb) = p in (g, ((XO aa), bb))
          | XO b0 -> let (g, p) = ggcdn n0 a0 b0 in ((XO g), p)
          | XH -> (XH, (a, XH)))
       | XH -> (XH, (XH, b)))

  (** val ggcd : positive -> positive -> positive * (positive * positive) **)

  let ggcd a b =
    ggcdn (Coq__1.add (size_nat a) (size_nat b)) a b

  (** val iter_op : ('a1 -> 'a1 -> 'a1) -> positive -> 'a1 -> 'a1 **)

  let rec iter_op op p a =
    match p with
    | XI p0 -> op a (iter_op op p0 (op a a))
    | XO p0 -> iter_op op p0 (op a a)
    | XH -> a

  (** val to_nat : positive -> nat **)

  let to_nat x =
    iter_op Coq__1.add x (S O)

  (** val of_nat : nat -> positive **)

  let rec of_nat = function
  | O -> XH
  | S x -> (match x with
            | O -> XH
            | S _ -> succ (of_nat x))

  (** val eq_dec : positive -> positive -> bool **)

  let rec eq_dec p x0 =
    match p with
    | XI p0 -> (match x0 with
                | XI p1 -> eq_dec p0 p1
                | _ -> false)
    | XO p0 -> (match x0 with
                | XO p1 -> eq_dec p0 p1
                | _ -> false)
    | XH -> (match x0 with
             | XH -> true
             | _ -> false)
 end

module Z =
 struct
  (** val double : z -> z **)

  let double = function
  | Z0 -> Z0
  | Zpos p -> Zpos (XO p)
  | Zneg p -> Zneg (XO p)

  (** val succ_double : z -> z **)

  let succ_double = function
  | Z0 -> Zpos XH
  | Zpos p -> Zpos (XI p)
  | Zneg p -> Zneg (Coq_Pos.pred_double p)

  (** val pred_double : z -> z **)

  let pred_double = function
  | Z0 -> Zneg XH
  | Zpos p -> Zpos (Coq_Pos.pred_double p)
  | Zneg p -> Zneg (XI p)

  (** val pos_sub : positive -> positive -> z **)

  let rec pos_sub x y =
    match x with
    | XI p ->
      (match y with
       | XI q0 -> double (pos_sub p q0)
       | XO q0 -> succ_double (pos_sub p q0)
       | XH -> Zpos (XO p))
    | XO p ->
      (match y with
       | XI q0 -> pred_double (pos_sub p q0)
       | XO q0 -> double (pos_sub p q0)
       | XH -> Zpos (Coq_Pos.pred_double p))
    | XH ->
      (match y with
       | XI q0 -> Zneg (XO q0)
       | XO q0 -> Zneg (Coq_Pos.pred_double q0)
       | XH -> Z0)

  (** val add : z -> z -> z **)

  let add x y =
    match x with
    | Z0 -> y
    | Zpos x' ->
      (match y with
       | Z0 -> x
       | Zpos y' -> Zpos (Coq_Pos.add x' y')
       | Zneg y' -> pos_sub x' y')
    | Zneg x' ->
      (match y with
       | Z0 -> x
       | Zpos y' -> pos_sub y' x'
       | Zneg y' -> Zneg (Coq_Pos.add x' y'))

  (** val opp : z -> z **)

  let opp = function
  | Z0 -> Z0
  | Zpos x0 -> Zneg x0
  | Zneg x0 -> Zpos x0

  (** val mul : z -> z -> z **)

  let mul x y =
    match x with
    | Z0 -> Z0
    | Zpos x' ->
      (match y with
       | Z0 -> Z0
       | Zpos y' -> Zpos (Coq_Pos.mul x' y')
       | Zneg y' -> Zneg (Coq_Pos.mul x' y'))
    | Zneg x' ->
      (match y with
       | Z0 -> Z0
       | Zpos y' -> Zneg (Coq_Pos.mul x' y')
       | Zneg y' -> Zpos (Coq_Pos.mul x' y'))

  (** val compare : z -> z -> comparison **)

  let compare x y =
    match x with
    | Z0 -> (match y with
             | Z0 -> Eq
             | Zpos _ -> Lt
             | Zneg _ -> Gt)
    | Zpos x' -> (match y with
                  | Zpos y' -> Coq_Pos.compare x' y'
                  | _ -> Gt)
    | Zneg x' ->
      (match y with
       | Zneg y' -> compOpp (Coq_Pos.compare x' y')
       | _ -> Lt)

  (** val sgn : z -> z **)

  let sgn = function
  | Z0 -> Z0
  | Zpos _ -> Zpos XH
  | Zneg _ -> Zneg XH

  (** val leb : z -> z -> bool **)

  let leb x y =
    match compare x y with
    | Gt -> false
    | _ -> true

  (** val ltb : z -> z -> bool **)

  let ltb x y =
    match compare x y with
    | Lt -> true
    | _ -> false

  (** val eqb : z -> z -> bool **)

  let eqb x y =
    match x with
    | Z0 -> (match y with
             | Z0 -> true
             | _ -> false)
    | Zpos p -> (match y with
                 | Zpos q0 -> Coq_Pos.eqb p q0
                 | _ -> false)
    | Zneg p -> (match y with
                 | Zneg q0 -> Coq_Pos.eqb p q0
                 | _ -> false)

  (** val min : z -> z -> z **)

  let min n m =
    match compare n m with
    | Gt -> m
    | _ -> n

  (** val abs : z -> z **)

  let abs = function
  | Zneg p -> Zpos p
  | x -> x

  (** val to_nat : z -> nat **)

  let to_nat = function
  | Zpos p -> Coq_Pos.to_nat p
  | _ -> O

  (** val to_pos : z -> positive **)

  let to_pos = function
  | Zpos p -> p
  | _ -> XH

  (** val ggcd : z -> z -> z * (z * z) **)

  let ggcd a b =
    match a with
    | Z0 -> ((abs b), (Z0, (sgn b)))
    | Zpos a0 ->
      (match b with
       | Z0 -> ((abs a), ((sgn a), Z0))
       | Zpos b0 ->
         let (g, p) = Coq_Pos.ggcd a0 b0 in
         let (aa, bb) = p in ((Zpos g), ((Zpos aa), (Zpos bb)))
       | Zneg b0 ->
         let (g, p) = Coq_Pos.ggcd a0 b0 in
         let (aa, bb) = p in ((Zpos g), ((Zpos aa), (Zneg bb))))
    | Zneg a0 ->
      (match b with
       | Z0 -> ((abs a), ((sgn a), Z0))
       | Zpos b0 ->
         let (g, p) = Coq_Pos.ggcd a0 b0 in
         let (aa, bb) = p in ((Zpos g), ((Zneg aa), (Zpos bb)))
       | Zneg b0 ->
         let (g, p) = Coq_Pos.ggcd a0 b0 in
         let (aa, bb) = p in ((Zpos g), ((Zneg aa), (Zneg bb))))

  (** val eq_dec : z -> z -> bool **)

  let eq_dec x y =
    match x with
    | Z0 -> (match y with
             | Z0 -> true
             | _ -> false)
    | Zpos p -> (match y with
                 | Zpos p0 -> Coq_Pos.eq_dec p p0
                 | _ -> false)
    | Zneg p -> (match y with
                 | Zneg p0 -> Coq_Pos.eq_dec p p0
                 | _ -> false)
 end

(** val zeq_bool : z -> z -> bool **)

let zeq_bool x y =
  match Z.compare x y with
  | Eq -> true
  | _ -> false

(** val in_dec : ('a1 -> 'a1 -> bool) -> 'a1 -> 'a1 list -> bool **)

let rec in_dec h a = function
| [] -> false
| y :: l0 -> let s = h y a in if s then true else in_dec h a l0

(** val nth : nat -> 'a1 list -> 'a1 -> 'a1 **)

let rec nth n l default0 =
  match n with
  | O -> (match l with
          | [] -> default0
          | x :: _ -> x)
  | S m -> (match l with
            | [] -> default0
            | _ :: t0 -> nth m t0 default0)

(** val nth_error : 'a1 list -> nat -> 'a1 option **)

let rec nth_error l = function
| O -> (match l with
        | [] -> None
        | x :: _ -> Some x)
| S n0 -> (match l with
           | [] -> None
           | _ :: l0 -> nth_error l0 n0)

(** val concat : 'a1 list list -> 'a1 list **)

let rec concat = function
| [] -> []
| x :: l0 -> app x (concat l0)

(** val list_eq_dec : ('a1 -> 'a1 -> bool) -> 'a1 list -> 'a1 list -> bool **)

let rec list_eq_dec eq_dec0 l l' =
  match l with
  | [] -> (match l' with
           | [] -> true
           | _ :: _ -> false)
  | y :: l0 ->
    (match l' with
     | [] -> false
     | a :: l1 -> if eq_dec0 y a then list_eq_dec eq_dec0 l0 l1 else false)

(** val map : ('a1 -> 'a2) -> 'a1 list -> 'a2 list **)

let rec map f = function
| [] -> []
| a :: t0 -> (f a) :: (map f t0)

(** val flat_map : ('a1 -> 'a2 list) -> 'a1 list -> 'a2 list **)

let rec flat_map f = function
| [] -> []
| x :: t0 -> app (f x) (flat_map f t0)

(** val fold_left : ('a1 -> 'a2 -> 'a1) -> 'a2 list -> 'a1 -> 'a1 **)

let rec fold_left f l a0 =
  match l with
  | [] -> a0
  | b :: t0 -> fold_left f t0 (f a0 b)

(** val fold_right : ('a2 -> 'a1 -> 'a1) -> 'a1 -> 'a2 list -> 'a1 **)

let rec fold_right f a0 = function
| [] -> a0
| b :: t0 -> f b (fold_right f a0 t0)

(** val existsb : ('a1 -> bool) -> 'a1 list -> bool **)

let rec existsb f = function
| [] -> false
| a :: l0 -> (||) (f a) (existsb f l0)

(** val forallb : ('a1 -> bool) -> 'a1 list -> bool **)

let rec forallb f = function
| [] -> true
| a :: l0 -> (&&) (f a) (forallb f l0)

(** val filter : ('a1 -> bool) -> 'a1 list -> 'a1 list **)

let rec filter f = function
| [] -> []
| x :: l0 -> if f x then x :: (filter f l0) else filter f l0

(** val find : ('a1 -> bool) -> 'a1 list -> 'a1 option **)

let rec find f = function
| [] -> None
| x :: tl -> if f x then Some x else find f tl

(** val combine : 'a1 list -> 'a2 list -> ('a1 * 'a2) list **)

let rec combine l l' =
  match l with
  | [] -> []
  | x :: tl ->
    (match l' with
     | [] -> []
     | y :: tl' -> (x, y) :: (combine tl tl'))

(** val firstn : nat -> 'a1 list -> 'a1 list **)

let rec firstn n l =
  match n with
  | O -> []
  | S n0 -> (match l with
             | [] -> []
             | a :: l0 -> a :: (firstn n0 l0))

(** val skipn : nat -> 'a1 list -> 'a1 list **)

let rec skipn n l =
  match n with
  | O -> l
  | S n0 -> (match l with
             | [] -> []
             | _ :: l0 -> skipn n0 l0)

(** val nodup : ('a1 -> 'a1 -> bool) -> 'a1 list -> 'a1 list **)

let rec nodup decA = function
| [] -> []
| x :: xs -> if in_dec decA x xs then nodup decA xs else x :: (nodup decA xs)

(** val seq : nat -> nat -> nat list **)

let rec seq start = function
| O -> []
| S len0 -> start :: (seq (S start) len0)

(** val repeat : 'a1 -> nat -> 'a1 list **)

let rec repeat x = function
| O -> []
| S k -> x :: (repeat x k)

type q = { qnum : z; qden : positive }

(** val inject_Z : z -> q **)

let inject_Z x =
  { qnum = x; qden = XH }

(** val qcompare : q -> q -> comparison **)

let qcompare p q0 =
  Z.compare (Z.mul p.qnum (Zpos q0.qden)) (Z.mul q0.qnum (Zpos p.qden))

(** val qeq_bool : q -> q -> bool **)

let qeq_bool x y =
  zeq_bool (Z.mul x.qnum (Zpos y.qden)) (Z.mul y.qnum (Zpos x.qden))

(** val qle_bool : q -> q -> bool **)

let qle_bool x y =
  Z.leb (Z.mul x.qnum (Zpos y.qden)) (Z.mul y.qnum (Zpos x.qden))

(** val qplus : q -> q -> q **)

let qplus x y =
  { qnum = (Z.add (Z.mul x.qnum (Zpos y.qden)) (Z.mul y.qnum (Zpos x.qden)));
    qden = (Coq_Pos.mul x.qden y.qden) }

(** val qmult : q -> q -> q **)

let qmult x y =
  { qnum = (Z.mul x.qnum y.qnum); qden = (Coq_Pos.mul x.qden y.qden) }

(** val qopp : q -> q **)

let qopp x =
  { qnum = (Z.opp x.qnum); qden = x.qden }

(** val qminus : q -> q -> q **)

let qminus x y =
  qplus x (qopp y)

(** val qinv : q -> q **)

let qinv x =
  match x.qnum with
  | Z0 -> { qnum = Z0; qden = XH }
  | Zpos p -> { qnum = (Zpos x.qden); qden = p }
  | Zneg p -> { qnum = (Zneg x.qden); qden = p }

(** val qdiv : q -> q -> q **)

let qdiv x y =
  qmult x (qinv y)

(** val qred : q -> q **)

let qred q0 =
  let { qnum = q1; qden = q2 } = q0 in
  let (r1, r2) = snd (Z.ggcd q1 (Zpos q2)) in
  { qnum = r1; qden = (Z.to_pos r2) }

type 'x compare0 =
| LT
| EQ
| GT

module type OrderedType =
 sig
  type t

  val compare : t -> t -> t compare0

  val eq_dec : t -> t -> bool
 end

module OrderedTypeFacts =
 functor (O:OrderedType) ->
 struct
  module TO =
   struct
    type t = O.t
   end

  module IsTO =
   struct
   end

  module OrderTac = MakeOrderTac(TO)(IsTO)

  (** val eq_dec : O.t -> O.t -> bool **)

  let eq_dec =
    O.eq_dec

  (** val lt_dec : O.t -> O.t -> bool **)

  let lt_dec x y =
    match O.compare x y with
    | LT -> true
    | _ -> false

  (** val eqb : O.t -> O.t -> bool **)

  let eqb x y =
    if eq_dec x y then true else false
 end

module KeyOrderedType =
 functor (O:OrderedType) ->
 struct
  module MO = OrderedTypeFacts(O)
 end

module PositiveOrderedTypeBits =
 struct
  type t = positive

  (** val compare : t -> t -> positive compare0 **)

  let rec compare p y =
    match p with
    | XI p0 -> (match y with
                | XI p1 -> compare p0 p1
                | _ -> GT)
    | XO p0 -> (match y with
                | XO p1 -> compare p0 p1
                | _ -> LT)
    | XH -> (match y with
             | XI _ -> LT
             | XO _ -> GT
             | XH -> EQ)

  (** val eq_dec : positive -> positive -> bool **)

  let eq_dec x y =
    match Coq_Pos.compare x y with
    | Eq -> true
    | _ -> false
 end

(** val append : positive -> positive -> positive **)

let rec append i j =
  match i with
  | XI ii -> XI (append ii j)
  | XO ii -> XO (append ii j)
  | XH -> j

module PositiveMap =
 struct
  module E = PositiveOrderedTypeBits

  module ME = KeyOrderedType(E)

  type key = positive

  type 'a tree =
  | Leaf
  | Node of 'a tree * 'a option * 'a tree

  type 'a t = 'a tree

  (** val empty : 'a1 t **)

  let empty =
    Leaf

  (** val is_empty : 'a1 t -> bool **)

  let rec is_empty = function
  | Leaf -> true
  | Node (l, o, r) ->
    (match o with
     | Some _ -> false
     | None -> (&&) (is_empty l) (is_empty r))

  (** val find : key -> 'a1 t -> 'a1 option **)

  let rec find i = function
  | Leaf -> None
  | Node (l, o, r) ->
    (match i with
     | XI ii -> find ii r
     | XO ii -> find ii l
     | XH -> o)

  (** val mem : key -> 'a1 t -> bool **)

  let rec mem i = function
  | Leaf -> false
  | Node (l, o, r) ->
    (match i with
     | XI ii -> mem ii r
     | XO ii -> mem ii l
     | XH -> (match o with
              | Some _ -> true
              | None -> false))

  (** val add : key -> 'a1 -> 'a1 t -> 'a1 t **)

  let rec add i v = function
  | Leaf ->
    (match i with
     | XI ii -> Node (Leaf, None, (add ii v Leaf))
     | XO ii -> Node ((add ii v Leaf), None, Leaf)
     | XH -> Node (Leaf, (Some v), Leaf))
  | Node (l, o, r) ->
    (match i with
     | XI ii -> Node (l, o, (add ii v r))
     | XO ii -> Node ((add ii v l), o, r)
     | XH -> Node (l, (Some v), r))

  (** val remove : key -> 'a1 t -> 'a1 t **)

  let rec remove i m =
    match i with
    | XI ii ->
      (match m with
       | Leaf -> Leaf
       | Node (l, o, r) ->
         (match l with
          | Leaf ->
            (match o with
             | Some _ -> Node (l, o, (remove ii r))
             | None ->
               (match remove ii r with
                | Leaf -> Leaf
                | Node (t0, o0, t1) -> Node (Leaf, None, (Node (t0, o0, t1)))))
          | Node (_, _, _) -> Node (l, o, (remove ii r))))
    | XO ii ->
      (match m with
       | Leaf -> Leaf
       | Node (l, o, r) ->
         (match o with
          | Some _ -> Node ((remove ii l), o, r)
          | None ->
            (match r with
             | Leaf ->
               (match remove ii l with
                | Leaf -> Leaf
                | Node (t0, o0, t1) -> Node ((Node (t0, o0, t1)), None, Leaf))
             | Node (_, _, _) -> Node ((remove ii l), o, r))))
    | XH ->
      (match m with
       | Leaf -> Leaf
       | Node (l, _, r) ->
         (match l with
          | Leaf ->
            (match r with
             | Leaf -> Leaf
             | Node (_, _, _) -> Node (l, None, r))
          | Node (_, _, _) -> Node (l, None, r)))

  (** val xelements : 'a1 t -> key -> (key * 'a1) list **)

  let rec xelements m i =
    match m with
    | Leaf -> []
    | Node (l, o, r) ->
      (match o with
       | Some x ->
         app (xelements l (append i (XO XH))) ((i,
           x) :: (xelements r (append i (XI XH))))
       | None ->
         app (xelements l (append i (XO XH))) (xelements r (append i (XI XH))))

  (** val elements : 'a1 t -> (key * 'a1) list **)

  let elements m =
    xelements m XH

  (** val cardinal : 'a1 t -> nat **)

  let rec cardinal = function
  | Leaf -> O
  | Node (l, o, r) ->
    (match o with
     | Some _ -> S (Coq__1.add (cardinal l) (cardinal r))
     | None -> Coq__1.add (cardinal l) (cardinal r))

  (** val xfind : key -> key -> 'a1 t -> 'a1 option **)

  let rec xfind i j m =
    match i with
    | XI ii ->
      (match j with
       | XI jj -> xfind ii jj m
       | XO _ -> None
       | XH -> find i m)
    | XO ii ->
      (match j with
       | XI _ -> None
       | XO jj -> xfind ii jj m
       | XH -> find i m)
    | XH -> (match j with
             | XH -> find i m
             | _ -> None)

  (** val xmapi : (key -> 'a1 -> 'a2) -> 'a1 t -> key -> 'a2 t **)

  let rec xmapi f m i =
    match m with
    | Leaf -> Leaf
    | Node (l, o, r) ->
      Node ((xmapi f l (append i (XO XH))), (option_map (f i) o),
        (xmapi f r (append i (XI XH))))

  (** val mapi : (key -> 'a1 -> 'a2) -> 'a1 t -> 'a2 t **)

  let mapi f m =
    xmapi f m XH

  (** val map : ('a1 -> 'a2) -> 'a1 t -> 'a2 t **)

  let map f m =
    mapi (fun _ -> f) m

  (** val xmap2_l :
      ('a1 option -> 'a2 option -> 'a3 option) -> 'a1 t -> 'a3 t **)

  let rec xmap2_l f = function
  | Leaf -> Leaf
  | Node (l, o, r) -> Node ((xmap2_l f l), (f o None), (xmap2_l f r))

  (** val xmap2_r :
      ('a1 option -> 'a2 option -> 'a3 option) -> 'a2 t -> 'a3 t **)

  let rec xmap2_r f = function
  | Leaf -> Leaf
  | Node (l, o, r) -> Node ((xmap2_r f l), (f None o), (xmap2_r f r))

  (** val _map2 :
      ('a1 option -> 'a2 option -> 'a3 option) -> 'a1 t -> 'a2 t -> 'a3 t **)

  let rec _map2 f m1 m2 =
    match m1 with
    | Leaf -> xmap2_r f m2
    | Node (l1, o1, r1) ->
      (match m2 with
       | Leaf -> xmap2_l f m1
       | Node (l2, o2, r2) ->
         Node ((_map2 f l1 l2), (f o1 o2), (_map2 f r1 r2)))

  (** val map2 :
      ('a1 option -> 'a2 option -> 'a3 option) -> 'a1 t -> 'a2 t -> 'a3 t **)

  let map2 f =
    _map2 (fun o1 o2 ->
      match o1 with
      | Some _ -> f o1 o2
      | None -> (match o2 with
                 | Some _ -> f o1 o2
                 | None -> None))

  (** val xfoldi :
      (key -> 'a1 -> 'a2 -> 'a2) -> 'a1 t -> 'a2 -> key -> 'a2 **)

  let rec xfoldi f m v i =
    match m with
    | Leaf -> v
    | Node (l, o, r) ->
      (match o with
       | Some x ->
         xfoldi f r (f i x (xfoldi f l v (append i (XO XH))))
           (append i (XI XH))
       | None ->
         xfoldi f r (xfoldi f l v (append i (XO XH))) (append i (XI XH)))

  (** val fold : (key -> 'a1 -> 'a2 -> 'a2) -> 'a1 t -> 'a2 -> 'a2 **)

  let fold f m i =
    xfoldi f m i XH

  (** val equal : ('a1 -> 'a1 -> bool) -> 'a1 t -> 'a1 t -> bool **)

  let rec equal cmp m1 m2 =
    match m1 with
    | Leaf -> is_empty m2
    | Node (l1, o1, r1) ->
      (match m2 with
       | Leaf -> is_empty m1
       | Node (l2, o2, r2) ->
         (&&)
           ((&&)
             (match o1 with
              | Some v1 ->
                (match o2 with
                 | Some v2 -> cmp v1 v2
                 | None -> false)
              | None -> (match o2 with
                         | Some _ -> false
                         | None -> true)) (equal cmp l1 l2)) (equal cmp r1 r2))
 end

module M = PositiveMap

type key0 = positive

(** val get : z M.t -> key0 -> z **)

let get m k =
  match M.find k m with
  | Some x -> x
  | None -> Z0

type state = { var_values : z M.t; num_values : z M.t }

(** val var_value : state -> key0 -> z **)

let var_value s =
  get s.var_values

(** val num_value : state -> key0 -> z **)

let num_value s =
  get s.num_values

type fact = key0 * z

type literal = fact * bool

type choice = z list

type quantity = { base : z; tables : (nat list * z M.t) list }

type linear = { factors : (key0 * z) list; offset : quantity }

type condition = { facts : fact list; clauses : literal list list;
                   comparisons : linear list }

type operator = { slot_sizes : z list;
                  excluded : (nat list * z list list) list;
                  precondition : condition; effects : fact list;
                  conditional : (literal list * fact list) list;
                  number_effects : (key0 * linear) list; cost : quantity }

type task = { basic_count : z; derived : (key0 * z) list;
              domain_size : z M.t; numbers : key0 list; init : state;
              operators : operator list;
              layers : (fact * condition) list list; goal : condition }

(** val table_row : z list -> choice -> nat list -> z **)

let table_row slot_sizes0 ch slots =
  fold_left (fun r i -> Z.add (Z.mul r (nth i slot_sizes0 Z0)) (nth i ch Z0))
    slots Z0

(** val amount : quantity -> z list -> choice -> z **)

let amount q0 slot_sizes0 ch =
  fold_left (fun a t0 ->
    Z.add a
      (get (snd t0)
        (Z.to_pos (Z.add (table_row slot_sizes0 ch (fst t0)) (Zpos XH)))))
    q0.tables q0.base

(** val value : linear -> state -> z list -> choice -> z **)

let value l s slot_sizes0 ch =
  fold_left (fun a t0 -> Z.add a (Z.mul (num_value s (fst t0)) (snd t0)))
    l.factors (amount l.offset slot_sizes0 ch)

(** val is_fact : state -> fact -> bool **)

let is_fact s f =
  Z.eqb (var_value s (fst f)) (snd f)

(** val is_literal : state -> literal -> bool **)

let is_literal s l =
  eqb (is_fact s (fst l)) (snd l)

(** val holds_facts : condition -> state -> bool **)

let holds_facts c s =
  (&&) (forallb (is_fact s) c.facts)
    (forallb (existsb (is_literal s)) c.clauses)

(** val holds : condition -> state -> z list -> choice -> bool **)

let holds c s slot_sizes0 ch =
  (&&) (holds_facts c s)
    (forallb (fun l -> Z.leb Z0 (value l s slot_sizes0 ch)) c.comparisons)

(** val put_all : fact list -> z M.t -> z M.t **)

let put_all fs m =
  fold_left (fun m0 f -> M.add (fst f) (snd f) m0) fs m

(** val basics : task -> key0 list **)

let basics t0 =
  map Coq_Pos.of_nat (seq (S O) (Z.to_nat t0.basic_count))

(** val reset_derived : task -> state -> state **)

let reset_derived t0 s =
  { var_values =
    (put_all t0.derived
      (put_all (map (fun v -> (v, (var_value s v))) (basics t0)) M.empty));
    num_values =
    (put_all (map (fun n -> (n, (num_value s n))) t0.numbers) M.empty) }

(** val new_facts : (fact * condition) list -> state -> fact list **)

let new_facts rules s =
  map fst
    (filter (fun r ->
      (&&) (negb (is_fact s (fst r))) (holds (snd r) s [] [])) rules)

(** val evaluate_layer : nat -> (fact * condition) list -> state -> state **)

let rec evaluate_layer fuel rules s =
  match fuel with
  | O -> s
  | S fuel0 ->
    (match new_facts rules s with
     | [] -> s
     | f :: l ->
       evaluate_layer fuel0 rules { var_values =
         (put_all (f :: l) s.var_values); num_values = s.num_values })

(** val derive : task -> state -> state **)

let derive t0 s =
  fold_left (fun s0 rules -> evaluate_layer (S (length rules)) rules s0)
    t0.layers (reset_derived t0 s)

(** val fires : state -> (literal list * fact list) -> bool **)

let fires s c =
  forallb (is_literal s) (fst c)

(** val made_facts : operator -> state -> fact list **)

let made_facts o s =
  app o.effects (flat_map snd (filter (fires s) o.conditional))

(** val apply : operator -> state -> choice -> state **)

let apply o s ch =
  { var_values = (put_all (made_facts o s) s.var_values); num_values =
    (put_all
      (map (fun c -> ((fst c), (value (snd c) s o.slot_sizes ch)))
        o.number_effects) s.num_values) }

type table = { pattern : key0 list; table_values : z option M.t }

type label = { label_state : state; path_cost : z }

type argument = { potentials : table list; needs : (key0 * table) list;
                  labels : label M.t }

(** val count_up : nat -> z -> z list **)

let rec count_up k x =
  match k with
  | O -> []
  | S k0 -> x :: (count_up k0 (Z.add x (Zpos XH)))

(** val range : z -> z list **)

let range n =
  count_up (Z.to_nat n) Z0

(** val combinations : z list -> choice list **)

let rec combinations = function
| [] -> [] :: []
| n :: r ->
  flat_map (fun x -> map (fun x0 -> x :: x0) (combinations r)) (range n)

(** val equal_lists : z list -> z list -> bool **)

let equal_lists a b =
  if list_eq_dec Z.eq_dec a b then true else false

(** val admits : operator -> choice -> bool **)

let admits o ch =
  forallb (fun e ->
    negb (existsb (equal_lists (map (fun i -> nth i ch Z0) (fst e))) (snd e)))
    o.excluded

(** val choices : operator -> choice list **)

let choices o =
  filter (admits o) (combinations o.slot_sizes)

(** val fact_value : key0 -> fact list -> z option **)

let fact_value v fs =
  match find (fun f -> Coq_Pos.eqb (fst f) v) fs with
  | Some f -> Some (snd f)
  | None -> None

(** val matching : task -> key0 list -> fact list -> z list list **)

let rec matching t0 pat fs =
  match pat with
  | [] -> [] :: []
  | v :: r ->
    flat_map (fun x -> map (fun x0 -> x :: x0) (matching t0 r fs))
      (match fact_value v fs with
       | Some x -> x :: []
       | None -> range (get t0.domain_size v))

(** val last_put : fact list -> key0 -> z -> z **)

let rec last_put fs v x =
  match fs with
  | [] -> x
  | f :: r -> last_put r v (if Coq_Pos.eqb (fst f) v then snd f else x)

(** val pattern_after : key0 list -> z list -> fact list -> z list **)

let rec pattern_after pat vals fs =
  match pat with
  | [] -> []
  | v :: p ->
    (match vals with
     | [] -> []
     | x :: r -> (last_put fs v x) :: (pattern_after p r fs))

(** val pattern_value : key0 list -> z list -> key0 -> z option **)

let rec pattern_value pat vals v =
  match pat with
  | [] -> None
  | w :: p ->
    (match vals with
     | [] -> None
     | x :: r -> if Coq_Pos.eqb w v then Some x else pattern_value p r v)

(** val pattern_truth : key0 list -> z list -> literal -> bool option **)

let pattern_truth pat vals l =
  match pattern_value pat vals (fst (fst l)) with
  | Some x -> Some (eqb (Z.eqb x (snd (fst l))) (snd l))
  | None -> None

(** val mem_key : key0 -> key0 list -> bool **)

let mem_key v pat =
  existsb (Coq_Pos.eqb v) pat

(** val same_values : z list -> z list -> bool **)

let same_values a b =
  if list_eq_dec Z.eq_dec a b then true else false

(** val reached_patterns :
    key0 list -> z list -> (literal list * fact list) list -> z list list ->
    z list list **)

let rec reached_patterns pat vals cs ts =
  match cs with
  | [] -> ts
  | c :: r ->
    let tr = map (pattern_truth pat vals) (fst c) in
    if forallb (fun f -> negb (mem_key (fst f) pat)) (snd c)
    then reached_patterns pat vals r ts
    else if existsb (fun t0 ->
              match t0 with
              | Some y -> if y then false else true
              | None -> false) tr
         then reached_patterns pat vals r ts
         else let new0 = map (fun t0 -> pattern_after pat t0 (snd c)) ts in
              if forallb (fun t0 ->
                   match t0 with
                   | Some y -> y
                   | None -> false) tr
              then reached_patterns pat vals r new0
              else reached_patterns pat vals r
                     (app ts
                       (filter (fun t0 -> negb (existsb (same_values t0) ts))
                         new0))

(** val successor_patterns :
    key0 list -> operator -> z list -> z list list **)

let successor_patterns pat o vals =
  reached_patterns pat vals o.conditional
    ((pattern_after pat vals o.effects) :: [])

(** val mentions : key0 list -> operator -> bool **)

let mentions pat o =
  existsb (fun f -> mem_key (fst f) pat)
    (app o.precondition.facts (app o.effects (flat_map snd o.conditional)))

(** val table_index : task -> key0 list -> z list -> z **)

let table_index t0 pat vals =
  fold_left (fun r vx ->
    Z.add (Z.mul r (get t0.domain_size (fst vx))) (snd vx))
    (combine pat vals) Z0

(** val table_bound : task -> table -> z list -> z option **)

let table_bound t0 t1 vals =
  match M.find (Z.to_pos (Z.add (table_index t0 t1.pattern vals) (Zpos XH)))
          t1.table_values with
  | Some b -> b
  | None -> Some Z0

(** val at_most : z option -> z option -> z -> bool **)

let at_most a b step0 =
  match b with
  | Some y -> (match a with
               | Some x -> Z.leb x (Z.add y step0)
               | None -> false)
  | None -> true

(** val minimum : z list -> z option **)

let minimum xs =
  fold_right (fun x m ->
    match m with
    | Some y -> Some (Z.min x y)
    | None -> Some x) None xs

type prepared = operator * (choice list * z option)

(** val prepare : operator -> prepared **)

let prepare o =
  (o, ((choices o), (minimum (map (amount o.cost o.slot_sizes) (choices o)))))

(** val potential_ok_for : task -> table -> prepared -> bool **)

let potential_ok_for t0 t1 = function
| (o, p0) ->
  let (_, least) = p0 in
  (match least with
   | Some least0 ->
     if mentions t1.pattern o
     then forallb (fun vals ->
            forallb (fun tgt ->
              at_most (table_bound t0 t1 vals) (table_bound t0 t1 tgt) least0)
              (successor_patterns t1.pattern o vals))
            (matching t0 t1.pattern o.precondition.facts)
     else Z.leb Z0 least0
   | None -> true)

(** val is_basic : task -> key0 -> bool **)

let is_basic t0 v =
  Z.leb (Zpos v) t0.basic_count

(** val check_potential : task -> prepared list -> table -> bool **)

let check_potential t0 ops t1 =
  (&&)
    ((&&) (forallb (is_basic t0) t1.pattern)
      (forallb (fun vals -> at_most (table_bound t0 t1 vals) (Some Z0) Z0)
        (matching t0 t1.pattern t0.goal.facts)))
    (forallb (potential_ok_for t0 t1) ops)

(** val is_number : linear -> key0 -> bool **)

let is_number l n =
  match l.factors with
  | [] -> false
  | p :: l0 ->
    let (m, f) = p in
    (match l0 with
     | [] -> (&&) (Coq_Pos.eqb m n) (Z.eqb f (Zpos XH))
     | _ :: _ -> false)

(** val least_use : key0 -> prepared -> z option **)

let least_use n = function
| (o, p0) ->
  let (chs, _) = p0 in
  (match filter (fun c -> Coq_Pos.eqb (fst c) n) o.number_effects with
   | [] -> Some Z0
   | p1 :: l0 ->
     let (_, l) = p1 in
     (match l0 with
      | [] ->
        if is_number l n
        then (match minimum
                      (map (fun ch ->
                        Z.opp (amount l.offset o.slot_sizes ch)) chs) with
              | Some least ->
                if (&&) (Z.leb Z0 least)
                     ((||) (Z.eqb least Z0)
                       (forallb (fun ch ->
                         existsb (fun c ->
                           (&&) (is_number c n)
                             (Z.leb (amount c.offset o.slot_sizes ch)
                               (amount l.offset o.slot_sizes ch)))
                           o.precondition.comparisons) chs))
                then Some least
                else None
              | None -> Some Z0)
        else None
      | _ :: _ -> None))

(** val is_zero_bound : z option -> bool **)

let is_zero_bound = function
| Some x -> Z.eqb x Z0
| None -> false

(** val is_infinite : z option -> bool **)

let is_infinite = function
| Some _ -> false
| None -> true

(** val need_ok_for : task -> table -> key0 -> bool -> prepared -> bool **)

let need_ok_for t0 t1 n allzero p =
  let o = fst p in
  if mentions t1.pattern o
  then forallb (fun vals ->
         forallb (fun tgt ->
           match least_use n p with
           | Some least ->
             at_most (table_bound t0 t1 vals) (table_bound t0 t1 tgt) least
           | None ->
             (||) (is_zero_bound (table_bound t0 t1 vals))
               ((&&) (is_infinite (table_bound t0 t1 vals))
                 (is_infinite (table_bound t0 t1 tgt))))
           (successor_patterns t1.pattern o vals))
         (matching t0 t1.pattern o.precondition.facts)
  else (match least_use n p with
        | Some _ -> true
        | None -> allzero)

(** val check_need : task -> prepared list -> (key0 * table) -> bool **)

let check_need t0 ops = function
| (n, t1) ->
  (&&)
    ((&&)
      ((&&) ((&&) (mem_key n t0.numbers) (forallb (is_basic t0) t1.pattern))
        (forallb (fun vals ->
          match table_bound t0 t1 vals with
          | Some x -> Z.leb Z0 x
          | None -> true) (matching t0 t1.pattern [])))
      (forallb (fun vals ->
        match table_bound t0 t1 vals with
        | Some k ->
          (||) (Z.leb k Z0)
            (existsb (fun l ->
              (&&) (is_number l n) (Z.leb k (Z.opp (amount l.offset [] []))))
              t0.goal.comparisons)
        | None -> false) (matching t0 t1.pattern t0.goal.facts)))
    (let allzero =
       forallb (fun vals ->
         (||) (is_zero_bound (table_bound t0 t1 vals))
           (is_infinite (table_bound t0 t1 vals))) (matching t0 t1.pattern [])
     in
     forallb (need_ok_for t0 t1 n allzero) ops)

type choice_profile = choice * (z * z list)

(** val profile : operator -> choice -> z list **)

let profile o ch =
  map (fun l -> amount l.offset o.slot_sizes ch)
    (app o.precondition.comparisons (map snd o.number_effects))

(** val fits : bool -> z list -> z list -> bool **)

let rec fits mono a b =
  match a with
  | [] -> (match b with
           | [] -> true
           | _ :: _ -> false)
  | x :: a0 ->
    (match b with
     | [] -> false
     | y :: b0 ->
       (&&) (if mono then Z.leb y x else Z.eqb x y) (fits mono a0 b0))

(** val dominates : bool -> choice_profile -> choice_profile -> bool **)

let dominates mono a b =
  (&&) (Z.leb (fst (snd a)) (fst (snd b)))
    (fits mono (snd (snd a)) (snd (snd b)))

(** val undominated_choices : bool -> operator -> choice list **)

let undominated_choices mono o =
  let all =
    map (fun ch -> (ch, ((amount o.cost o.slot_sizes ch), (profile o ch))))
      (choices o)
  in
  let kept =
    fold_left (fun f e ->
      if existsb (fun x -> dominates mono x e) f
      then f
      else e :: (filter (fun x -> negb (dominates mono e x)) f)) all []
  in
  if forallb (fun e -> existsb (fun x -> dominates mono x e) kept) all
  then map fst kept
  else choices o

(** val nonneg : linear -> bool **)

let nonneg l =
  forallb (fun f -> Z.leb Z0 (snd f)) l.factors

(** val is_monotone : task -> bool **)

let is_monotone t0 =
  (&&)
    ((&&)
      (forallb (fun o ->
        (&&) (forallb nonneg o.precondition.comparisons)
          (forallb (fun c -> nonneg (snd c)) o.number_effects)) t0.operators)
      (forallb nonneg t0.goal.comparisons))
    (forallb
      (forallb (fun r ->
        match (snd r).comparisons with
        | [] -> true
        | _ :: _ -> false)) t0.layers)

(** val numbers_cover : bool -> z M.t -> z M.t -> key0 list -> bool **)

let numbers_cover mono a b ns =
  forallb (fun n ->
    if mono then Z.leb (get b n) (get a n) else Z.eqb (get a n) (get b n)) ns

(** val potential_prunes : task -> z option -> state -> z -> table -> bool **)

let potential_prunes t0 claim s p t1 =
  match table_bound t0 t1 (map (var_value s) t1.pattern) with
  | Some more ->
    (match claim with
     | Some c -> Z.leb c (Z.add p more)
     | None -> false)
  | None -> true

(** val need_prunes : task -> state -> (key0 * table) -> bool **)

let need_prunes t0 s nt =
  match table_bound t0 (snd nt) (map (var_value s) (snd nt).pattern) with
  | Some k -> (&&) (Z.ltb Z0 k) (Z.ltb (num_value s (fst nt)) k)
  | None -> true

(** val label_covers :
    task -> bool -> key0 list -> state -> z -> label -> bool **)

let label_covers t0 mono bs s p l =
  (&&)
    ((&&) (Z.leb l.path_cost p)
      (forallb (fun v -> Z.eqb (var_value l.label_state v) (var_value s v))
        bs))
    (numbers_cover mono l.label_state.num_values s.num_values t0.numbers)

(** val covered :
    task -> argument -> z option -> (state -> positive list) -> bool -> key0
    list -> state -> z -> bool **)

let covered t0 a claim oracle mono bs s p =
  (||)
    ((||) (existsb (potential_prunes t0 claim s p) a.potentials)
      (existsb (need_prunes t0 s) a.needs))
    (existsb (fun i ->
      match M.find i a.labels with
      | Some l -> label_covers t0 mono bs s p l
      | None -> false) (oracle s))

type front = operator * choice list

type fronts_by_fact = front list M.t M.t

(** val slot : z -> positive **)

let slot x =
  Z.to_pos (Z.add x (Zpos XH))

(** val row : 'a1 M.t M.t -> key0 -> 'a1 M.t **)

let row m v =
  match M.find v m with
  | Some r -> r
  | None -> M.empty

(** val with_fact : fronts_by_fact -> fact -> front list **)

let with_fact m f =
  match M.find (slot (snd f)) (row m (fst f)) with
  | Some l -> l
  | None -> []

(** val add_front : fact -> front -> fronts_by_fact -> fronts_by_fact **)

let add_front f p m =
  M.add (fst f) (M.add (slot (snd f)) (p :: (with_fact m f)) (row m (fst f)))
    m

(** val frequency : z M.t M.t -> fact -> z **)

let frequency m f =
  get (row m (fst f)) (slot (snd f))

(** val frequencies : fact list -> z M.t M.t **)

let frequencies fs =
  fold_left (fun m f ->
    M.add (fst f)
      (M.add (slot (snd f)) (Z.add (frequency m f) (Zpos XH)) (row m (fst f)))
      m) fs M.empty

(** val rarest : z M.t M.t -> fact list -> fact option **)

let rec rarest m = function
| [] -> None
| f :: r ->
  (match rarest m r with
   | Some g ->
     if Z.ltb (frequency m f) (frequency m g) then Some f else Some g
   | None -> Some f)

(** val index_fronts :
    z M.t M.t -> front list -> front list * fronts_by_fact **)

let rec index_fronts m = function
| [] -> ([], M.empty)
| p :: r ->
  let (others, by_fact) = index_fronts m r in
  (match rarest m (fst p).precondition.facts with
   | Some f -> (others, (add_front f p by_fact))
   | None -> ((p :: others), by_fact))

(** val applicable :
    front list -> (key0 * front list M.t) list -> state -> front list **)

let applicable others by_fact s =
  app others
    (flat_map (fun vm ->
      match M.find (slot (var_value s (fst vm))) (snd vm) with
      | Some l -> l
      | None -> []) by_fact)

(** val check_label :
    task -> argument -> z option -> (state -> positive list) -> bool -> key0
    list -> (state -> front list) -> label -> bool **)

let check_label t0 a claim oracle mono bs ops l =
  let s = derive t0 l.label_state in
  (&&)
    (negb
      ((&&) (holds t0.goal s [] [])
        (match claim with
         | Some c -> Z.ltb l.path_cost c
         | None -> true)))
    (forallb (fun p ->
      let o = fst p in
      if holds_facts o.precondition s
      then forallb (fun ch ->
             if holds o.precondition s o.slot_sizes ch
             then covered t0 a claim oracle mono bs (apply o s ch)
                    (Z.add l.path_cost (amount o.cost o.slot_sizes ch))
             else true) (snd p)
      else true) (ops s))

(** val in_range : task -> key0 -> z -> bool **)

let in_range t0 v x =
  (&&) (Z.leb Z0 x) (Z.ltb x (get t0.domain_size v))

(** val is_well_formed : task -> fact -> bool **)

let is_well_formed t0 f =
  (&&) (is_basic t0 (fst f)) (in_range t0 (fst f) (snd f))

(** val distinct : key0 list -> bool **)

let rec distinct = function
| [] -> true
| k :: r -> (&&) (negb (mem_key k r)) (distinct r)

(** val check_task : task -> bool **)

let check_task t0 =
  (&&)
    ((&&)
      ((&&)
        (forallb (fun v -> in_range t0 v (var_value t0.init v)) (basics t0))
        (forallb (fun o ->
          (&&)
            ((&&) (forallb (is_well_formed t0) o.effects)
              (forallb (fun c -> forallb (is_well_formed t0) (snd c))
                o.conditional)) (distinct (map fst o.number_effects)))
          t0.operators))
      (forallb (forallb (fun r -> negb (is_basic t0 (fst (fst r)))))
        t0.layers)) (forallb (fun d -> negb (is_basic t0 (fst d))) t0.derived)

(** val condition_variables : condition -> key0 list **)

let condition_variables c =
  app (map fst c.facts) (map (fun l -> fst (fst l)) (concat c.clauses))

(** val check_layers : (fact * condition) list list -> bool * z M.t **)

let rec check_layers = function
| [] -> (true, M.empty)
| rules :: rest ->
  let (ok, later) = check_layers rest in
  let heads =
    fold_left (fun m r -> M.add (fst (fst r)) (snd (fst r)) m) rules later
  in
  (((&&) ok
     (forallb (fun r ->
       (&&)
         (match M.find (fst (fst r)) heads with
          | Some x -> Z.eqb x (snd (fst r))
          | None -> false)
         (forallb (fun v ->
           match M.find v later with
           | Some _ -> false
           | None -> true) ((fst (fst r)) :: (condition_variables (snd r)))))
       rules)), heads)

(** val check :
    task -> argument -> z option -> (state -> positive list) -> bool **)

let check t0 a claim oracle =
  match claim with
  | Some _ ->
    let ops = map prepare t0.operators in
    let mono = is_monotone t0 in
    let bs = basics t0 in
    (&&)
      ((&&)
        ((&&)
          ((&&) (check_task t0)
            (forallb (check_potential t0 ops) a.potentials))
          (forallb (check_need t0 ops) a.needs))
        (covered t0 a claim oracle mono bs t0.init Z0))
      (let fronts =
         map (fun o -> (o, (undominated_choices mono o))) t0.operators
       in
       let index0 =
         index_fronts
           (frequencies
             (flat_map (fun o -> o.precondition.facts) t0.operators)) fronts
       in
       let by_fact = M.elements (snd index0) in
       forallb (fun il ->
         check_label t0 a claim oracle mono bs
           (applicable (fst index0) by_fact) (snd il)) (M.elements a.labels))
  | None ->
    if existsb (fun c -> match c with
                         | [] -> true
                         | _ :: _ -> false) t0.goal.clauses
    then true
    else let ops = map prepare t0.operators in
         let mono = is_monotone t0 in
         let bs = basics t0 in
         (&&)
           ((&&)
             ((&&)
               ((&&) (check_task t0)
                 (forallb (check_potential t0 ops) a.potentials))
               (forallb (check_need t0 ops) a.needs))
             (covered t0 a claim oracle mono bs t0.init Z0))
           (let fronts =
              map (fun o -> (o, (undominated_choices mono o))) t0.operators
            in
            let index0 =
              index_fronts
                (frequencies
                  (flat_map (fun o -> o.precondition.facts) t0.operators))
                fronts
            in
            let by_fact = M.elements (snd index0) in
            forallb (fun il ->
              check_label t0 a claim oracle mono bs
                (applicable (fst index0) by_fact) (snd il))
              (M.elements a.labels))

type key1 = positive

type atom = key1 * key1 list

(** val atom_eqb : atom -> atom -> bool **)

let atom_eqb a b =
  (&&) (Coq_Pos.eqb (fst a) (fst b))
    (if list_eq_dec Coq_Pos.eq_dec (snd a) (snd b) then true else false)

(** val assoc : atom -> (atom * 'a1) list -> 'a1 option **)

let rec assoc a = function
| [] -> None
| p :: r -> let (b, x) = p in if atom_eqb a b then Some x else assoc a r

type 'x atom_map = (atom * 'x) list PositiveMap.t

(** val bucket : atom -> positive **)

let bucket a =
  fold_left (fun h o ->
    Coq_Pos.add
      (Coq_Pos.mul (XO (XO (XO (XO (XO (XO (XO (XO (XO (XO (XO (XO
        XH)))))))))))) h) o) (snd a) (fst a)

(** val bucket_entries : 'a1 atom_map -> atom -> (atom * 'a1) list **)

let bucket_entries m a =
  match PositiveMap.find (bucket a) m with
  | Some l -> l
  | None -> []

(** val find_atom : 'a1 atom_map -> atom -> 'a1 option **)

let find_atom m a =
  assoc a (bucket_entries m a)

(** val add_atom : atom -> 'a1 -> 'a1 atom_map -> 'a1 atom_map **)

let add_atom a x m =
  PositiveMap.add (bucket a) ((a, x) :: (bucket_entries m a)) m

type term =
| Var of nat
| Object of key1

type expression =
| Constant of q
| Fluent of key1 * term list
| Duration
| Plus of expression * expression
| Minus of expression * expression
| Times of expression * expression
| Over of expression * expression

type formula =
| Truth of bool
| Atom of key1 * term list
| Same of term * term
| Compare of bool * expression * expression
| Not of formula
| And of formula * formula
| Forall of key1 * formula

(** val or0 : formula -> formula -> formula **)

let or0 f g =
  Not (And ((Not f), (Not g)))

(** val imply : formula -> formula -> formula **)

let imply f g =
  Not (And (f, (Not g)))

(** val exists : key1 -> formula -> formula **)

let exists type0 f =
  Not (Forall (type0, (Not f)))

(** val equal0 : expression -> expression -> formula **)

let equal0 a b =
  And ((Compare (false, a, b)), (Compare (false, b, a)))

type effect =
| Nothing
| Put of bool * key1 * term list
| Change of bool * key1 * term list * expression
| Both of effect * effect
| When of formula * effect
| Each of key1 * effect

type action = { parameters : key1 list; duration : expression option;
                at_start : formula; start_effect : effect;
                over_all : formula; at_end : formula; end_effect : effect }

type world = { holds_in : (atom -> bool); value_in : (atom -> q option) }

type rule = { head : key1; head_types : key1 list; body : formula }

type problem = { objects : (key1 -> key1 list); actions : action list;
                 strata : rule list list; initial_atoms : unit atom_map;
                 initial_values : q atom_map; goal_formula : formula;
                 metric : expression; per_time : q; per_step : q }

(** val initial : problem -> world **)

let initial p =
  { holds_in = (fun a ->
    match find_atom p.initial_atoms a with
    | Some _ -> true
    | None -> false); value_in = (find_atom p.initial_values) }

(** val object_of : key1 list -> term -> key1 option **)

let object_of env = function
| Var i -> nth_error env i
| Object o -> Some o

(** val ground : key1 list -> term list -> key1 list option **)

let rec ground env = function
| [] -> Some []
| t0 :: r ->
  (match object_of env t0 with
   | Some o ->
     (match ground env r with
      | Some l -> Some (o :: l)
      | None -> None)
   | None -> None)

(** val lift : (q -> q -> q) -> q option -> q option -> q option **)

let lift f a b =
  match a with
  | Some x -> (match b with
               | Some y -> Some (f x y)
               | None -> None)
  | None -> None

(** val eval : world -> q option -> key1 list -> expression -> q option **)

let rec eval w d env = function
| Constant q0 -> Some q0
| Fluent (f, ts) ->
  (match ground env ts with
   | Some l -> w.value_in (f, l)
   | None -> None)
| Duration -> d
| Plus (a, b) -> lift qplus (eval w d env a) (eval w d env b)
| Minus (a, b) -> lift qminus (eval w d env a) (eval w d env b)
| Times (a, b) -> lift qmult (eval w d env a) (eval w d env b)
| Over (a, b) ->
  (match eval w d env b with
   | Some y ->
     if qeq_bool y { qnum = Z0; qden = XH }
     then None
     else lift qdiv (eval w d env a) (Some y)
   | None -> None)

(** val less : q -> q -> bool **)

let less x y =
  negb (qle_bool y x)

(** val and_kleene : bool option -> bool option -> bool option **)

let and_kleene a b =
  match a with
  | Some b0 -> if b0 then b else Some false
  | None ->
    (match b with
     | Some b0 -> if b0 then None else Some false
     | None -> None)

(** val truth :
    problem -> world -> q option -> key1 list -> formula -> bool option **)

let rec truth p w d env = function
| Truth b -> Some b
| Atom (p0, ts) ->
  (match ground env ts with
   | Some l -> Some (w.holds_in (p0, l))
   | None -> None)
| Same (t0, u) ->
  (match object_of env t0 with
   | Some a ->
     (match object_of env u with
      | Some b -> Some (Coq_Pos.eqb a b)
      | None -> None)
   | None -> None)
| Compare (strict, a, b) ->
  (match eval w d env a with
   | Some x ->
     (match eval w d env b with
      | Some y -> Some (if strict then less y x else qle_bool y x)
      | None -> None)
   | None -> None)
| Not g -> option_map negb (truth p w d env g)
| And (g, h) -> and_kleene (truth p w d env g) (truth p w d env h)
| Forall (t0, g) ->
  fold_right (fun o r -> and_kleene (truth p w d (app env (o :: [])) g) r)
    (Some true) (p.objects t0)

(** val is_derived : problem -> key1 -> bool **)

let is_derived p p0 =
  existsb (existsb (fun r -> Coq_Pos.eqb p0 r.head)) p.strata

(** val with_facts : problem -> world -> unit atom_map -> world **)

let with_facts p w facts0 =
  { holds_in = (fun a ->
    if is_derived p (fst a)
    then (match find_atom facts0 a with
          | Some _ -> true
          | None -> false)
    else w.holds_in a); value_in = w.value_in }

(** val tuples : problem -> key1 list -> key1 list list **)

let rec tuples p = function
| [] -> [] :: []
| t0 :: r ->
  flat_map (fun o -> map (fun x -> o :: x) (tuples p r)) (p.objects t0)

(** val rule_instances : problem -> rule list -> (atom * formula) list **)

let rule_instances p rules =
  flat_map (fun r ->
    map (fun env -> ((r.head, env), r.body)) (tuples p r.head_types)) rules

(** val fires_in : problem -> world -> (atom * formula) -> bool **)

let fires_in p w i =
  match truth p w None (snd (fst i)) (snd i) with
  | Some b -> b
  | None -> false

(** val new_atoms : problem -> world -> (atom * formula) list -> atom list **)

let new_atoms p w instances0 =
  map fst
    (filter (fun i -> (&&) (negb (w.holds_in (fst i))) (fires_in p w i))
      instances0)

(** val evaluate_stratum :
    problem -> nat -> (atom * formula) list -> world -> unit atom_map -> unit
    atom_map **)

let rec evaluate_stratum p rounds instances0 w facts0 =
  match rounds with
  | O -> facts0
  | S rounds0 ->
    (match new_atoms p (with_facts p w facts0) instances0 with
     | [] -> facts0
     | a :: l ->
       evaluate_stratum p rounds0 instances0 w
         (fold_left (fun m a0 -> add_atom a0 () m) (a :: l) facts0))

(** val derived_facts : problem -> world -> unit atom_map **)

let derived_facts p w =
  fold_left (fun facts0 rules ->
    let instances0 = rule_instances p rules in
    evaluate_stratum p (S (length instances0)) instances0 w facts0) p.strata
    PositiveMap.empty

(** val derived_world : problem -> world -> world **)

let derived_world p w =
  with_facts p w (derived_facts p w)

type change =
| Fact of atom * bool
| Number of atom * bool * q

(** val both : 'a1 list option -> 'a1 list option -> 'a1 list option **)

let both a b =
  match a with
  | Some x -> (match b with
               | Some y -> Some (app x y)
               | None -> None)
  | None -> None

(** val changes :
    problem -> world -> q option -> key1 list -> effect -> change list option **)

let rec changes p w d env = function
| Nothing -> Some []
| Put (b, p0, ts) ->
  (match ground env ts with
   | Some l -> Some ((Fact ((p0, l), b)) :: [])
   | None -> None)
| Change (assigns, f, ts, x) ->
  (match ground env ts with
   | Some l ->
     (match eval w d env x with
      | Some q0 -> Some ((Number ((f, l), assigns, q0)) :: [])
      | None -> None)
   | None -> None)
| Both (a, b) -> both (changes p w d env a) (changes p w d env b)
| When (f, a) ->
  (match truth p w d env f with
   | Some b -> if b then changes p w d env a else Some []
   | None -> None)
| Each (t0, a) ->
  fold_right (fun o r -> both (changes p w d (app env (o :: [])) a) r) (Some
    []) (p.objects t0)

(** val sets_atom : change list -> atom -> bool -> bool **)

let sets_atom cs a b =
  existsb (fun c ->
    match c with
    | Fact (a', b') -> (&&) (atom_eqb a a') (eqb b b')
    | Number (_, _, _) -> false) cs

(** val changes_of : atom -> change list -> (bool * q) list **)

let changes_of f cs =
  flat_map (fun c ->
    match c with
    | Fact (_, _) -> []
    | Number (f', b, q0) -> if atom_eqb f f' then (b, q0) :: [] else []) cs

(** val changed_value : q option -> (bool * q) list -> q option **)

let changed_value old l = match l with
| [] -> old
| p :: r ->
  let (b, q0) = p in
  if b
  then if forallb (fun c -> (&&) (fst c) (qeq_bool (snd c) q0)) r
       then Some q0
       else None
  else if existsb fst l
       then None
       else option_map (fun x ->
              fold_left (fun s c -> qred (qplus s (snd c))) l x) old

(** val changed_fluents : change list -> atom list **)

let rec changed_fluents = function
| [] -> []
| c :: r ->
  (match c with
   | Fact (_, _) -> changed_fluents r
   | Number (f, _, _) -> f :: (changed_fluents r))

(** val updates :
    world -> change list -> atom list -> (atom * q) list option **)

let rec updates w cs = function
| [] -> Some []
| f :: r ->
  (match changed_value (w.value_in f) (changes_of f cs) with
   | Some q0 ->
     (match updates w cs r with
      | Some l -> Some ((f, q0) :: l)
      | None -> None)
   | None -> None)

(** val happening :
    problem -> world -> q option -> key1 list -> formula -> effect -> world
    option **)

let happening p w d env f e =
  match truth p w d env f with
  | Some b ->
    if b
    then (match changes p w d env e with
          | Some cs ->
            (match updates w cs (changed_fluents cs) with
             | Some l ->
               Some { holds_in = (fun a ->
                 (||) (sets_atom cs a true)
                   ((&&) (negb (sets_atom cs a false)) (w.holds_in a)));
                 value_in = (fun a ->
                 match assoc a l with
                 | Some q0 -> Some q0
                 | None -> w.value_in a) }
             | None -> None)
          | None -> None)
    else None
  | None -> None

(** val step :
    problem -> bool -> world -> action -> key1 list -> (world * q) option **)

let step p allow_zero w a env =
  if negb
       ((&&) (Nat.eqb (length env) (length a.parameters))
         (forallb (fun x ->
           existsb (Coq_Pos.eqb (fst x)) (p.objects (snd x)))
           (combine env a.parameters)))
  then None
  else (match a.duration with
        | Some e ->
          (match eval w None env e with
           | Some d ->
             if less d { qnum = Z0; qden = XH }
             then None
             else if qeq_bool d { qnum = Z0; qden = XH }
                  then if allow_zero
                       then option_map (fun w0 -> (w0, d))
                              (happening p w (Some d) env (And (a.at_start,
                                a.at_end)) (Both (a.start_effect,
                                a.end_effect)))
                       else None
                  else (match happening p w (Some d) env a.at_start
                                a.start_effect with
                        | Some w1 ->
                          option_map (fun w0 -> (w0, d))
                            (happening p (derived_world p w1) (Some d) env
                              (And (a.over_all, a.at_end)) a.end_effect)
                        | None -> None)
           | None -> None)
        | None ->
          option_map (fun w0 -> (w0, { qnum = Z0; qden = XH }))
            (happening p w None env a.at_start a.start_effect))

(** val execute :
    problem -> bool -> world -> q -> (nat * key1 list) list -> (world * q)
    option **)

let rec execute p allow_zero w spent = function
| [] ->
  (match truth p (derived_world p w) None [] p.goal_formula with
   | Some b -> if b then Some (w, spent) else None
   | None -> None)
| p0 :: r ->
  let (i, env) = p0 in
  (match nth_error p.actions i with
   | Some a ->
     (match step p allow_zero (derived_world p w) a env with
      | Some p1 ->
        let (w', d) = p1 in
        execute p allow_zero w'
          (qred (qplus (qplus spent (qmult p.per_time d)) p.per_step)) r
      | None -> None)
   | None -> None)

(** val final_metric : problem -> world -> q -> q option **)

let final_metric p w spent =
  option_map (fun m -> qplus m spent) (eval w None [] p.metric)

type form = (atom * q) list * q

(** val plus_term : atom -> q -> (atom * q) list -> (atom * q) list **)

let rec plus_term f q0 = function
| [] -> (f, q0) :: []
| p :: r ->
  let (g, y) = p in
  if atom_eqb f g
  then let s = qred (qplus y q0) in
       if qeq_bool s { qnum = Z0; qden = XH } then r else (g, s) :: r
  else (g, y) :: (plus_term f q0 r)

(** val plus_form : form -> q -> form -> form **)

let plus_form a c b =
  ((fold_left (fun l t0 -> plus_term (fst t0) (qmult c (snd t0)) l) (fst b)
     (fst a)), (qred (qplus (snd a) (qmult c (snd b)))))

(** val constant : q -> form **)

let constant q0 =
  ([], q0)

(** val fluent : atom -> form **)

let fluent f =
  (((f, { qnum = (Zpos XH); qden = XH }) :: []), { qnum = Z0; qden = XH })

(** val default : q option -> q **)

let default = function
| Some q0 -> q0
| None -> { qnum = Z0; qden = XH }

(** val ev : world -> form -> q **)

let ev w f =
  fold_right (fun t0 s ->
    qplus (qmult (default (w.value_in (fst t0))) (snd t0)) s) (snd f) 
    (fst f)

type result =
| Undefined
| Unknown
| Is of form

(** val plus_result : result -> q -> result -> result **)

let plus_result a c b =
  match a with
  | Undefined -> Undefined
  | Unknown -> (match b with
                | Undefined -> Undefined
                | _ -> Unknown)
  | Is x -> (match b with
             | Is y -> Is (plus_form x c y)
             | x0 -> x0)

type names = { variables : (z * atom) list M.t; fluents : atom M.t;
               fact_of : (key1 * z) atom_map; number_of : key1 atom_map;
               changing : (key1 -> bool); may_hold : unit atom_map;
               derived_atoms : ((z * z) * atom) M.t;
               derived_of : (key1 * z) atom_map; equivalent : bool;
               invariants : (bool * form) list; exclusive : atom list list;
               scale : positive; cost_scale : positive }

type case_tree =
| Decided of (nat * choice) option
| Impossible
| SplitAtom of atom * case_tree * case_tree
| SplitForm of form * case_tree * case_tree

(** val mem0 : 'a1 atom_map -> atom -> bool **)

let mem0 m a =
  match find_atom m a with
  | Some _ -> true
  | None -> false

type knowledge = { literals : (atom * bool) list; bounds : (bool * form) list }

(** val in_variable : names -> knowledge -> key1 -> (z * bool) list **)

let in_variable n k v =
  flat_map (fun l ->
    match find_atom n.fact_of (fst l) with
    | Some p ->
      let (u, x) = p in if Coq_Pos.eqb u v then (x, (snd l)) :: [] else []
    | None -> []) k.literals

(** val in_group : atom -> atom list -> bool **)

let in_group a g =
  existsb (atom_eqb a) g

(** val excluded_by : names -> knowledge -> atom -> bool **)

let excluded_by n k a =
  existsb (fun g ->
    (&&) (in_group a g)
      (existsb (fun l ->
        (&&) ((&&) (snd l) (negb (atom_eqb (fst l) a))) (in_group (fst l) g))
        k.literals)) n.exclusive

(** val possible : task -> names -> knowledge -> key1 -> z list **)

let possible t0 n k v =
  let known0 = in_variable n k v in
  let atoms = match M.find v n.variables with
              | Some vals -> vals
              | None -> []
  in
  filter (fun y ->
    (&&) (forallb (fun xb -> eqb (Z.eqb y (fst xb)) (snd xb)) known0)
      (negb
        (existsb (fun xa ->
          (&&) (Z.eqb y (fst xa)) (excluded_by n k (snd xa))) atoms)))
    (match find snd known0 with
     | Some p -> let (x, _) = p in x :: []
     | None -> range (get t0.domain_size v))

(** val known_fact :
    task -> names -> (key1 -> bool) -> knowledge -> key1 -> z -> bool option **)

let known_fact t0 n full k v x =
  match M.find v n.variables with
  | Some _ ->
    let ys = possible t0 n k v in
    if forallb (Z.eqb x) ys
    then Some true
    else if forallb (fun y -> negb (Z.eqb x y)) ys then Some false else None
  | None ->
    (match M.find v n.derived_atoms with
     | Some p ->
       let (p0, a) = p in
       let (y, d) = p0 in
       (match assoc a k.literals with
        | Some b ->
          if b
          then Some (Z.eqb x y)
          else if full (fst a) then Some (Z.eqb x d) else None
        | None -> None)
     | None -> None)

(** val base_truth :
    problem -> task -> names -> knowledge -> atom -> bool option **)

let base_truth p t0 n k a =
  if negb (n.changing (fst a))
  then Some ((initial p).holds_in a)
  else (match assoc a k.literals with
        | Some b -> Some b
        | None ->
          if (||) (excluded_by n k a) (negb (mem0 n.may_hold a))
          then Some false
          else (match find_atom n.fact_of a with
                | Some p0 ->
                  let (v, x) = p0 in known_fact t0 n (fun _ -> false) k v x
                | None -> None))

type symbolic = { new_truths : (atom * bool) list;
                  new_values : (atom * form) list; stale : bool }

(** val unchanged : symbolic **)

let unchanged =
  { new_truths = []; new_values = []; stale = false }

(** val make_stale : symbolic -> symbolic **)

let make_stale s =
  { new_truths = s.new_truths; new_values = s.new_values; stale = true }

(** val is_stale : problem -> symbolic -> key1 -> bool **)

let is_stale p s p0 =
  (&&) s.stale (is_derived p p0)

(** val symbolic_atom :
    problem -> task -> names -> knowledge -> symbolic -> atom -> bool option **)

let symbolic_atom p t0 n k s a =
  if is_stale p s (fst a)
  then None
  else (match assoc a s.new_truths with
        | Some b -> Some b
        | None -> base_truth p t0 n k a)

(** val symbolic_value : problem -> names -> symbolic -> atom -> result **)

let symbolic_value p n s f =
  match assoc f s.new_values with
  | Some g -> Is g
  | None ->
    if n.changing (fst f)
    then Is (fluent f)
    else (match (initial p).value_in f with
          | Some q0 -> Is (constant q0)
          | None -> Undefined)

(** val symbolic_expression :
    problem -> names -> symbolic -> result -> key1 list -> expression ->
    result **)

let rec symbolic_expression p n s d env = function
| Constant q0 -> Is (constant q0)
| Fluent (f, ts) ->
  (match ground env ts with
   | Some l -> symbolic_value p n s (f, l)
   | None -> Undefined)
| Duration -> d
| Plus (a, b) ->
  plus_result (symbolic_expression p n s d env a) { qnum = (Zpos XH); qden =
    XH } (symbolic_expression p n s d env b)
| Minus (a, b) ->
  plus_result (symbolic_expression p n s d env a) { qnum = (Zneg XH); qden =
    XH } (symbolic_expression p n s d env b)
| Times (a, b) ->
  (match symbolic_expression p n s d env a with
   | Undefined -> Undefined
   | Unknown ->
     (match symbolic_expression p n s d env b with
      | Undefined -> Undefined
      | _ -> Unknown)
   | Is x ->
     let (l, x0) = x in
     (match l with
      | [] ->
        (match symbolic_expression p n s d env b with
         | Is y -> Is (plus_form (constant { qnum = Z0; qden = XH }) x0 y)
         | x1 -> x1)
      | _ :: _ ->
        (match symbolic_expression p n s d env b with
         | Is f ->
           let (l1, y) = f in
           (match l1 with
            | [] -> Is (plus_form (constant { qnum = Z0; qden = XH }) y x)
            | _ :: _ -> Unknown)
         | x1 -> x1)))
| Over (a, b) ->
  (match symbolic_expression p n s d env a with
   | Undefined -> Undefined
   | Unknown ->
     (match symbolic_expression p n s d env b with
      | Undefined -> Undefined
      | _ -> Unknown)
   | Is x ->
     (match symbolic_expression p n s d env b with
      | Is f ->
        let (l, y) = f in
        (match l with
         | [] ->
           if qeq_bool y { qnum = Z0; qden = XH }
           then Undefined
           else Is (plus_form (constant { qnum = Z0; qden = XH }) (qinv y) x)
         | _ :: _ -> Unknown)
      | x0 -> x0))

(** val implied : knowledge -> bool -> form -> bool **)

let implied k strict f =
  (||)
    (existsb (fun b ->
      let (l, c) = plus_form f { qnum = (Zneg XH); qden = XH } (snd b) in
      (match l with
       | [] ->
         if (&&) strict (negb (fst b))
         then less { qnum = Z0; qden = XH } c
         else qle_bool { qnum = Z0; qden = XH } c
       | _ :: _ -> false)) ((false,
      (constant { qnum = Z0; qden = XH })) :: k.bounds))
    (let (l, c) = f in
     (match l with
      | [] -> (&&) strict (less { qnum = Z0; qden = XH } c)
      | _ :: _ -> false))

(** val symbolic_comparison : knowledge -> bool -> result -> bool option **)

let symbolic_comparison k strict = function
| Undefined -> Some false
| Unknown -> None
| Is f ->
  if implied k strict f
  then Some true
  else if implied k (negb strict)
            (plus_form (constant { qnum = Z0; qden = XH }) { qnum = (Zneg
              XH); qden = XH } f)
       then Some false
       else None

(** val all_kleene : ('a1 -> bool option) -> 'a1 list -> bool option **)

let rec all_kleene t0 = function
| [] -> Some true
| x :: r ->
  (match t0 x with
   | Some b0 ->
     if b0 then and_kleene (Some true) (all_kleene t0 r) else Some false
   | None -> and_kleene None (all_kleene t0 r))

(** val symbolic_truth :
    problem -> task -> names -> knowledge -> symbolic -> result -> key1 list
    -> formula -> bool option **)

let rec symbolic_truth p t0 n k s d env = function
| Truth b -> Some b
| Atom (p0, ts) ->
  (match ground env ts with
   | Some l -> symbolic_atom p t0 n k s (p0, l)
   | None -> Some false)
| Same (t1, u) ->
  (match object_of env t1 with
   | Some a ->
     (match object_of env u with
      | Some b -> Some (Coq_Pos.eqb a b)
      | None -> Some false)
   | None -> Some false)
| Compare (strict, a, b) ->
  symbolic_comparison k strict
    (symbolic_expression p n s d env (Minus (a, b)))
| Not g -> option_map negb (symbolic_truth p t0 n k s d env g)
| And (g, h) ->
  (match symbolic_truth p t0 n k s d env g with
   | Some b ->
     if b
     then and_kleene (Some true) (symbolic_truth p t0 n k s d env h)
     else Some false
   | None -> and_kleene None (symbolic_truth p t0 n k s d env h))
| Forall (t1, g) ->
  all_kleene (fun o -> symbolic_truth p t0 n k s d (app env (o :: [])) g)
    (p.objects t1)

type symbolic_change =
| SFact of atom * bool
| SNumber of atom * bool * form

(** val symbolic_changes :
    problem -> task -> names -> knowledge -> symbolic -> result -> key1 list
    -> effect -> symbolic_change list option **)

let rec symbolic_changes p t0 n k s d env = function
| Nothing -> Some []
| Put (b, p0, ts) ->
  (match ground env ts with
   | Some l -> Some ((SFact ((p0, l), b)) :: [])
   | None -> None)
| Change (assigns, f, ts, x) ->
  (match ground env ts with
   | Some l ->
     (match symbolic_expression p n s d env x with
      | Is g -> Some ((SNumber ((f, l), assigns, g)) :: [])
      | _ -> None)
   | None -> None)
| Both (a, b) ->
  both (symbolic_changes p t0 n k s d env a)
    (symbolic_changes p t0 n k s d env b)
| When (f, a) ->
  (match symbolic_truth p t0 n k s d env f with
   | Some b -> if b then symbolic_changes p t0 n k s d env a else Some []
   | None -> None)
| Each (t1, a) ->
  fold_right (fun o r ->
    both (symbolic_changes p t0 n k s d (app env (o :: [])) a) r) (Some [])
    (p.objects t1)

(** val symbolic_changes_of :
    atom -> symbolic_change list -> (bool * form) list **)

let symbolic_changes_of f cs =
  flat_map (fun c ->
    match c with
    | SFact (_, _) -> []
    | SNumber (f', b, g) -> if atom_eqb f f' then (b, g) :: [] else []) cs

(** val symbolic_new_value : result -> (bool * form) list -> form option **)

let symbolic_new_value old l = match l with
| [] -> None
| p :: l0 ->
  let (b, g) = p in
  if b
  then (match l0 with
        | [] -> Some g
        | _ :: _ -> None)
  else if existsb fst l
       then None
       else (match old with
             | Is x ->
               Some
                 (fold_left (fun s c ->
                   plus_form s { qnum = (Zpos XH); qden = XH } (snd c)) l x)
             | _ -> None)

(** val symbolic_changed_fluents : symbolic_change list -> atom list **)

let rec symbolic_changed_fluents = function
| [] -> []
| s :: r ->
  (match s with
   | SFact (_, _) -> symbolic_changed_fluents r
   | SNumber (f, _, _) -> f :: (symbolic_changed_fluents r))

(** val symbolic_updates :
    problem -> names -> symbolic -> symbolic_change list -> atom list ->
    (atom * form) list option **)

let rec symbolic_updates p n s cs = function
| [] -> Some []
| f :: r ->
  (match symbolic_new_value (symbolic_value p n s f)
           (symbolic_changes_of f cs) with
   | Some g ->
     (match symbolic_updates p n s cs r with
      | Some l -> Some ((f, g) :: l)
      | None -> None)
   | None -> None)

(** val atoms_set_to : symbolic_change list -> bool -> (atom * bool) list **)

let atoms_set_to cs b =
  flat_map (fun c ->
    match c with
    | SFact (a, b') -> if eqb b b' then (a, b) :: [] else []
    | SNumber (_, _, _) -> []) cs

type outcome =
| Never
| Unclear
| After of symbolic * q

(** val needs_undefined :
    problem -> task -> names -> knowledge -> symbolic -> result -> key1 list
    -> effect -> bool **)

let rec needs_undefined p t0 n k s d env = function
| Change (_, _, _, x) ->
  (match symbolic_expression p n s d env x with
   | Undefined -> true
   | _ -> false)
| Both (a, b) ->
  (||) (needs_undefined p t0 n k s d env a)
    (needs_undefined p t0 n k s d env b)
| When (f, a) ->
  (match symbolic_truth p t0 n k s d env f with
   | Some b -> if b then needs_undefined p t0 n k s d env a else false
   | None -> false)
| Each (t1, a) ->
  existsb (fun o -> needs_undefined p t0 n k s d (app env (o :: [])) a)
    (p.objects t1)
| _ -> false

(** val symbolic_happening :
    problem -> task -> names -> knowledge -> symbolic -> result -> q -> key1
    list -> formula -> effect -> outcome **)

let symbolic_happening p t0 n k s d time0 env f e =
  match symbolic_truth p t0 n k s d env f with
  | Some b ->
    if b
    then if needs_undefined p t0 n k s d env e
         then Never
         else (match symbolic_changes p t0 n k s d env e with
               | Some cs ->
                 (match symbolic_updates p n s cs
                          (symbolic_changed_fluents cs) with
                  | Some l ->
                    After ({ new_truths =
                      (app (atoms_set_to cs true)
                        (app (atoms_set_to cs false) s.new_truths));
                      new_values = (app l s.new_values); stale = s.stale },
                      time0)
                  | None -> Unclear)
               | None -> Unclear)
    else Never
  | None ->
    if needs_undefined p t0 n k s d env e
    then Never
    else (match symbolic_changes p t0 n k s d env e with
          | Some cs ->
            (match symbolic_updates p n s cs (symbolic_changed_fluents cs) with
             | Some l ->
               After ({ new_truths =
                 (app (atoms_set_to cs true)
                   (app (atoms_set_to cs false) s.new_truths)); new_values =
                 (app l s.new_values); stale = s.stale }, time0)
             | None -> Unclear)
          | None -> Unclear)

(** val projected :
    problem -> task -> names -> (atom -> bool) -> bool -> knowledge -> key1
    list -> effect -> symbolic_change list option **)

let rec projected p t0 n keep with_numbers k env = function
| Nothing -> Some []
| Put (b, p0, ts) ->
  (match ground env ts with
   | Some l -> Some (if keep (p0, l) then (SFact ((p0, l), b)) :: [] else [])
   | None -> None)
| Change (assigns, f, ts, x) ->
  if with_numbers
  then (match ground env ts with
        | Some l ->
          (match symbolic_expression p n unchanged Undefined env x with
           | Is g -> Some ((SNumber ((f, l), assigns, g)) :: [])
           | _ -> None)
        | None -> None)
  else Some []
| Both (a, b) ->
  both (projected p t0 n keep with_numbers k env a)
    (projected p t0 n keep with_numbers k env b)
| When (f, a) ->
  (match projected p t0 n keep with_numbers k env a with
   | Some l ->
     (match l with
      | [] -> Some []
      | s :: l0 ->
        (match symbolic_truth p t0 n k unchanged Undefined env f with
         | Some b -> if b then Some (s :: l0) else Some []
         | None -> None))
   | None ->
     (match symbolic_truth p t0 n k unchanged Undefined env f with
      | Some b -> if b then None else Some []
      | None -> None))
| Each (t1, a) ->
  fold_right (fun o r ->
    both (projected p t0 n keep with_numbers k (app env (o :: [])) a) r)
    (Some []) (p.objects t1)

(** val atoms_of : problem -> key1 list -> formula -> atom list **)

let rec atoms_of p env = function
| Atom (p0, ts) ->
  (match ground env ts with
   | Some l -> (p0, l) :: []
   | None -> [])
| Not g -> atoms_of p env g
| And (g, h) -> app (atoms_of p env g) (atoms_of p env h)
| Forall (t0, g) ->
  flat_map (fun o -> atoms_of p (app env (o :: [])) g) (p.objects t0)
| _ -> []

(** val deciding_atoms :
    problem -> task -> names -> (atom -> bool) -> knowledge -> key1 list ->
    effect -> atom list **)

let rec deciding_atoms p t0 n keep k env = function
| Both (a, b) ->
  app (deciding_atoms p t0 n keep k env a)
    (deciding_atoms p t0 n keep k env b)
| When (f, a) ->
  (match projected p t0 n keep false k env a with
   | Some l ->
     (match l with
      | [] -> []
      | _ :: _ ->
        (match symbolic_truth p t0 n k unchanged Undefined env f with
         | Some _ -> deciding_atoms p t0 n keep k env a
         | None -> app (atoms_of p env f) (deciding_atoms p t0 n keep k env a)))
   | None ->
     (match symbolic_truth p t0 n k unchanged Undefined env f with
      | Some _ -> deciding_atoms p t0 n keep k env a
      | None -> app (atoms_of p env f) (deciding_atoms p t0 n keep k env a)))
| Each (t1, a) ->
  flat_map (fun o -> deciding_atoms p t0 n keep k (app env (o :: [])) a)
    (p.objects t1)
| _ -> []

(** val possible_facts :
    problem -> task -> names -> knowledge -> key1 list -> effect ->
    (atom * bool) list option **)

let rec possible_facts p t0 n k env = function
| Put (b, p0, ts) ->
  (match ground env ts with
   | Some l -> Some (((p0, l), b) :: [])
   | None -> None)
| Both (a, b) ->
  both (possible_facts p t0 n k env a) (possible_facts p t0 n k env b)
| When (f, a) ->
  (match symbolic_truth p t0 n k unchanged Undefined env f with
   | Some b -> if b then possible_facts p t0 n k env a else Some []
   | None -> possible_facts p t0 n k env a)
| Each (t1, a) ->
  fold_right (fun o r ->
    both (possible_facts p t0 n k (app env (o :: [])) a) r) (Some [])
    (p.objects t1)
| _ -> Some []

(** val symbolic_duration :
    problem -> names -> action -> key1 list -> result **)

let symbolic_duration p n a env =
  match a.duration with
  | Some e -> symbolic_expression p n unchanged Undefined env e
  | None -> Undefined

(** val symbolic_step :
    problem -> task -> names -> knowledge -> action -> key1 list -> outcome **)

let symbolic_step p t0 n k a env =
  match a.duration with
  | Some _ ->
    (match symbolic_duration p n a env with
     | Undefined -> Never
     | Unknown -> Unclear
     | Is f ->
       let (l, d) = f in
       (match l with
        | [] ->
          if less d { qnum = Z0; qden = XH }
          then Never
          else if qeq_bool d { qnum = Z0; qden = XH }
               then symbolic_happening p t0 n k unchanged (Is (constant d)) d
                      env (And (a.at_start, a.at_end)) (Both (a.start_effect,
                      a.end_effect))
               else (match symbolic_happening p t0 n k unchanged (Is
                             (constant d)) d env a.at_start a.start_effect with
                     | After (s, _) ->
                       symbolic_happening p t0 n k (make_stale s) (Is
                         (constant d)) d env (And (a.over_all, a.at_end))
                         a.end_effect
                     | x -> x)
        | _ :: _ -> Unclear))
  | None ->
    symbolic_happening p t0 n k unchanged Undefined { qnum = Z0; qden = XH }
      env a.at_start a.start_effect

(** val conjuncts :
    problem -> names -> symbolic -> result -> key1 list -> formula ->
    knowledge **)

let rec conjuncts p n s d env = function
| Atom (p0, ts) ->
  (match ground env ts with
   | Some l ->
     (match assoc (p0, l) s.new_truths with
      | Some _ -> { literals = []; bounds = [] }
      | None ->
        if (&&) (n.changing p0) (negb (is_stale p s p0))
        then { literals = (((p0, l), true) :: []); bounds = [] }
        else { literals = []; bounds = [] })
   | None -> { literals = []; bounds = [] })
| Compare (strict, a, b) ->
  (match symbolic_expression p n s d env (Minus (a, b)) with
   | Is g -> { literals = []; bounds = ((strict, g) :: []) }
   | _ -> { literals = []; bounds = [] })
| Not f0 ->
  (match f0 with
   | Atom (p0, ts) ->
     (match ground env ts with
      | Some l ->
        (match assoc (p0, l) s.new_truths with
         | Some _ -> { literals = []; bounds = [] }
         | None ->
           if (&&) (n.changing p0) (negb (is_stale p s p0))
           then { literals = (((p0, l), false) :: []); bounds = [] }
           else { literals = []; bounds = [] })
      | None -> { literals = []; bounds = [] })
   | _ -> { literals = []; bounds = [] })
| And (g, h) ->
  let a = conjuncts p n s d env g in
  let b = conjuncts p n s d env h in
  { literals = (app a.literals b.literals); bounds = (app a.bounds b.bounds) }
| _ -> { literals = []; bounds = [] }

(** val with_invariants : names -> knowledge -> knowledge **)

let with_invariants n k =
  { literals = k.literals; bounds = (app n.invariants k.bounds) }

(** val join : knowledge -> knowledge -> knowledge **)

let join k l =
  { literals = (app k.literals l.literals); bounds = (app k.bounds l.bounds) }

(** val gathered :
    problem -> task -> names -> action -> key1 list -> knowledge **)

let gathered p t0 n a env =
  match a.duration with
  | Some _ ->
    (match symbolic_duration p n a env with
     | Is f ->
       let (l, d) = f in
       (match l with
        | [] ->
          let time0 = Is (constant d) in
          let k = conjuncts p n unchanged time0 env a.at_start in
          if qeq_bool d { qnum = Z0; qden = XH }
          then join k (conjuncts p n unchanged time0 env a.at_end)
          else (match symbolic_happening p t0 n k unchanged time0 d env
                        a.at_start a.start_effect with
                | After (s, _) ->
                  join k
                    (conjuncts p n (make_stale s) time0 env (And (a.over_all,
                      a.at_end)))
                | _ -> k)
        | _ :: _ -> { literals = []; bounds = [] })
     | _ -> { literals = []; bounds = [] })
  | None -> conjuncts p n unchanged Undefined env a.at_start

(** val impossible : problem -> task -> names -> knowledge -> bool **)

let impossible p t0 n k =
  (||)
    (existsb (fun l ->
      (||)
        ((||)
          (match base_truth p t0 n { literals = []; bounds = k.bounds }
                   (fst l) with
           | Some b -> negb (eqb b (snd l))
           | None -> false) ((&&) (snd l) (excluded_by n k (fst l))))
        (match find_atom n.fact_of (fst l) with
         | Some p0 ->
           let (v, _) = p0 in
           (match possible t0 n k v with
            | [] -> true
            | _ :: _ -> false)
         | None -> false)) k.literals)
    (existsb (fun b ->
      implied k (negb (fst b))
        (plus_form (constant { qnum = Z0; qden = XH }) { qnum = (Zneg XH);
          qden = XH } (snd b))) k.bounds)

(** val is_defined : problem -> key1 list -> formula -> bool **)

let rec is_defined p env = function
| Truth _ -> true
| Atom (_, ts) -> (match ground env ts with
                   | Some _ -> true
                   | None -> false)
| Same (t0, u) ->
  (match object_of env t0 with
   | Some _ -> (match object_of env u with
                | Some _ -> true
                | None -> false)
   | None -> false)
| Compare (_, _, _) -> false
| Not g -> is_defined p env g
| And (g, h) -> (&&) (is_defined p env g) (is_defined p env h)
| Forall (t0, g) ->
  forallb (fun o -> is_defined p (app env (o :: [])) g) (p.objects t0)

(** val is_rule_of : problem -> atom -> rule -> bool **)

let is_rule_of p a r =
  (&&)
    ((&&) (Coq_Pos.eqb (fst a) r.head)
      (Nat.eqb (length (snd a)) (length r.head_types)))
    (forallb (fun x -> existsb (Coq_Pos.eqb (fst x)) (p.objects (snd x)))
      (combine (snd a) r.head_types))

(** val rules_of : problem -> atom -> rule list **)

let rules_of p a =
  filter (is_rule_of p a) (concat p.strata)

(** val contradicts_rules : problem -> task -> names -> knowledge -> bool **)

let contradicts_rules p t0 n k =
  existsb (fun l ->
    let (a, holds0) = l in
    (&&) (is_derived p (fst a))
      (let body_truth = fun r ->
         symbolic_truth p t0 n k unchanged Undefined (snd a) r.body
       in
       if holds0
       then forallb (fun r ->
              match body_truth r with
              | Some b -> if b then false else true
              | None -> false) (rules_of p a)
       else existsb (fun r ->
              match body_truth r with
              | Some b -> if b then is_defined p (snd a) r.body else false
              | None -> false) (rules_of p a))) k.literals

(** val contradictory : problem -> task -> names -> knowledge -> bool **)

let contradictory p t0 n k =
  (||) (impossible p t0 n k) (contradicts_rules p t0 n k)

type continuation = knowledge -> bool

(** val expand :
    problem -> task -> names -> (atom -> bool -> continuation ->
    continuation) -> formula -> bool -> key1 list -> continuation ->
    knowledge -> bool **)

let rec expand p t0 n after f b env next k =
  match f with
  | Truth c -> if eqb b c then next k else true
  | Atom (p0, ts) ->
    (match ground env ts with
     | Some l ->
       (match base_truth p t0 n k (p0, l) with
        | Some c -> if eqb b c then next k else true
        | None ->
          after (p0, l) b next { literals = (((p0, l), b) :: k.literals);
            bounds = k.bounds })
     | None -> true)
  | Same (t1, u) ->
    (match object_of env t1 with
     | Some x ->
       (match object_of env u with
        | Some y -> if eqb b (Coq_Pos.eqb x y) then next k else true
        | None -> true)
     | None -> true)
  | Compare (_, _, _) ->
    next (if b then join k (conjuncts p n unchanged Undefined env f) else k)
  | Not g -> expand p t0 n after g (negb b) env next k
  | And (g, h) ->
    if b
    then expand p t0 n after g true env (expand p t0 n after h true env next)
           k
    else (&&) (expand p t0 n after g false env next k)
           (expand p t0 n after h false env next k)
  | Forall (t1, g) ->
    if b
    then fold_right (fun o next0 ->
           expand p t0 n after g true (app env (o :: [])) next0) next
           (p.objects t1) k
    else forallb (fun o ->
           expand p t0 n after g false (app env (o :: [])) next k)
           (p.objects t1)

(** val is_unfolded : problem -> names -> atom -> bool **)

let is_unfolded p n a =
  (&&) (is_derived p (fst a))
    (match find_atom n.derived_of a with
     | Some _ -> false
     | None -> true)

(** val is_head : key1 -> rule list -> bool **)

let is_head p rules =
  existsb (fun r -> Coq_Pos.eqb p r.head) rules

(** val level : rule list list -> key1 -> nat **)

let rec level ls p =
  match ls with
  | [] -> O
  | rules :: later ->
    (match level later p with
     | O -> if is_head p rules then S O else O
     | S n -> S (S n))

(** val unfold :
    problem -> task -> names -> nat -> nat -> atom -> bool -> continuation ->
    knowledge -> bool **)

let rec unfold p t0 n depth limit a b next k =
  match depth with
  | O -> next k
  | S depth0 ->
    if negb (is_unfolded p n a)
    then next k
    else if b
         then forallb (fun r ->
                expand p t0 n (unfold p t0 n depth0 limit) r.body true
                  (snd a) next k) (rules_of p a)
         else if Nat.leb (level p.strata (fst a)) limit
              then fold_right (fun r next0 ->
                     if is_defined p (snd a) r.body
                     then expand p t0 n (unfold p t0 n depth0 limit) r.body
                            false (snd a) next0
                     else next0) next (rules_of p a) k
              else next k

(** val definite :
    problem -> (atom -> bool option) -> key1 list -> formula -> bool option **)

let rec definite p look env = function
| Truth b -> Some b
| Atom (p0, ts) ->
  (match ground env ts with
   | Some l -> look (p0, l)
   | None -> None)
| Same (t0, u) ->
  (match object_of env t0 with
   | Some a ->
     (match object_of env u with
      | Some b -> Some (Coq_Pos.eqb a b)
      | None -> None)
   | None -> None)
| Compare (_, _, _) -> None
| Not g -> option_map negb (definite p look env g)
| And (g, h) ->
  (match definite p look env g with
   | Some b ->
     if b then and_kleene (Some true) (definite p look env h) else Some false
   | None -> and_kleene None (definite p look env h))
| Forall (t0, g) ->
  all_kleene (fun o -> definite p look (app env (o :: [])) g) (p.objects t0)

(** val is_some : bool -> bool option -> bool **)

let is_some b = function
| Some c -> eqb b c
| None -> false

(** val look_up :
    problem -> task -> names -> nat -> nat -> knowledge -> atom -> bool option **)

let rec look_up p t0 n depth limit k a =
  match base_truth p t0 n k a with
  | Some b -> Some b
  | None ->
    (match depth with
     | O -> None
     | S depth0 ->
       if (&&) (is_unfolded p n a) (Nat.leb (level p.strata (fst a)) limit)
       then let truths =
              map (fun r ->
                definite p (look_up p t0 n depth0 limit k) (snd a) r.body)
                (rules_of p a)
            in
            if existsb (is_some true) truths
            then Some true
            else if forallb (is_some false) truths then Some false else None
       else None)

(** val max_unfoldings : nat **)

let max_unfoldings =
  S (S (S (S (S (S (S (S O)))))))

(** val occurrences_ok : (key1 -> bool -> bool) -> bool -> formula -> bool **)

let rec occurrences_ok allowed b = function
| Atom (p, _) -> allowed p b
| Not g -> occurrences_ok allowed (negb b) g
| And (g, h) -> (&&) (occurrences_ok allowed b g) (occurrences_ok allowed b h)
| Forall (_, g) -> occurrences_ok allowed b g
| _ -> true

(** val is_allowed : rule list -> rule list list -> key1 -> bool -> bool **)

let is_allowed rules later p b =
  (&&) (negb (existsb (is_head p) later)) ((||) b (negb (is_head p rules)))

(** val is_stratified : rule list list -> bool **)

let rec is_stratified = function
| [] -> true
| rules :: later ->
  (&&)
    (forallb (fun r -> occurrences_ok (is_allowed rules later) true r.body)
      rules) (is_stratified later)

(** val scaled : names -> q **)

let scaled n =
  { qnum = (Zpos n.scale); qden = XH }

(** val factors_of : names -> (key1 * z) list -> form option **)

let rec factors_of n = function
| [] -> Some (constant { qnum = Z0; qden = XH })
| p :: r ->
  let (n0, f) = p in
  (match M.find n0 n.fluents with
   | Some a ->
     (match factors_of n r with
      | Some g ->
        Some
          (plus_form g { qnum = (Zpos XH); qden = XH } (((a,
            (inject_Z f)) :: []), { qnum = Z0; qden = XH }))
      | None -> None)
   | None -> None)

(** val form_of : names -> linear -> z list -> choice -> form option **)

let form_of n l szs ch =
  match factors_of n l.factors with
  | Some g ->
    Some
      (plus_form g { qnum = (Zpos XH); qden = XH }
        (constant (qdiv (inject_Z (amount l.offset szs ch)) (scaled n))))
  | None -> None

(** val required : names -> knowledge -> form -> bool **)

let required n k f =
  implied k true
    (plus_form f { qnum = (Zpos XH); qden = XH } (constant (qinv (scaled n))))

(** val known_literal :
    task -> names -> (key1 -> bool) -> knowledge -> literal -> bool option **)

let known_literal t0 n full k l =
  option_map (fun b -> eqb b (snd l))
    (known_fact t0 n full k (fst (fst l)) (snd (fst l)))

(** val is_true : bool option -> bool **)

let is_true = function
| Some b -> b
| None -> false

(** val is_false : bool option -> bool **)

let is_false = function
| Some b -> negb b
| None -> false

(** val known_condition :
    task -> names -> (key1 -> bool) -> knowledge -> condition -> z list ->
    choice -> bool **)

let known_condition t0 n full k c szs ch =
  (&&)
    ((&&)
      (forallb (fun f -> is_true (known_fact t0 n full k (fst f) (snd f)))
        c.facts)
      (forallb (existsb (fun l -> is_true (known_literal t0 n full k l)))
        c.clauses))
    (forallb (fun l ->
      match form_of n l szs ch with
      | Some f -> required n k f
      | None -> false) c.comparisons)

(** val known_effects :
    task -> names -> knowledge -> (literal list * fact list) list -> fact
    list option **)

let rec known_effects t0 n k = function
| [] -> Some []
| c :: r ->
  if existsb (fun l ->
       is_false (known_literal t0 n (fun _ -> n.equivalent) k l)) (fst c)
  then known_effects t0 n k r
  else if forallb (fun l ->
            is_true (known_literal t0 n (fun _ -> n.equivalent) k l)) 
            (fst c)
       then option_map (app (snd c)) (known_effects t0 n k r)
       else None

(** val admitted_choice : operator -> choice -> bool **)

let admitted_choice o ch =
  (&&)
    ((&&) (Nat.eqb (length ch) (length o.slot_sizes))
      (forallb (fun xn -> (&&) (Z.leb Z0 (fst xn)) (Z.ltb (fst xn) (snd xn)))
        (combine ch o.slot_sizes))) (admits o ch)

(** val value_ok :
    (atom * bool) list -> fact list -> key1 -> (z * atom) list -> z -> bool **)

let value_ok truths made v vals y =
  let z0 = last_put made v y in
  forallb (fun xa ->
    eqb
      (match assoc (snd xa) truths with
       | Some b -> b
       | None -> Z.eqb y (fst xa)) (Z.eqb z0 (fst xa))) vals

(** val variable_ok :
    task -> names -> knowledge -> symbolic -> fact list -> key1 -> bool **)

let variable_ok t0 n k s made v =
  match M.find v n.variables with
  | Some vals ->
    forallb (value_ok s.new_truths made v vals) (possible t0 n k v)
  | None -> true

(** val is_zero : form -> bool **)

let is_zero = function
| (l, c) ->
  (match l with
   | [] -> qeq_bool c { qnum = Z0; qden = XH }
   | _ :: _ -> false)

(** val number_ok :
    names -> symbolic -> (operator * choice) option -> key1 -> bool **)

let number_ok n s o n0 =
  match M.find n0 n.fluents with
  | Some f ->
    let after = match assoc f s.new_values with
                | Some g -> g
                | None -> fluent f
    in
    let made =
      match o with
      | Some p ->
        let (o0, ch) = p in
        (match find (fun c -> Coq_Pos.eqb (fst c) n0) o0.number_effects with
         | Some c -> form_of n (snd c) o0.slot_sizes ch
         | None -> Some (fluent f))
      | None -> Some (fluent f)
    in
    (match made with
     | Some g -> is_zero (plus_form after { qnum = (Zneg XH); qden = XH } g)
     | None -> false)
  | None -> true

(** val growth : problem -> names -> symbolic -> q -> q option **)

let growth p n s time0 =
  match plus_result (symbolic_expression p n s Undefined [] p.metric)
          { qnum = (Zneg XH); qden = XH }
          (symbolic_expression p n unchanged Undefined [] p.metric) with
  | Is f ->
    let (l, c) = f in
    (match l with
     | [] -> Some (qplus (qplus c (qmult p.per_time time0)) p.per_step)
     | _ :: _ -> None)
  | _ -> None

(** val step_cost : (operator * choice) option -> z **)

let step_cost = function
| Some p -> let (o0, ch) = p in amount o0.cost o0.slot_sizes ch
| None -> Z0

(** val simulated :
    problem -> task -> names -> knowledge -> symbolic -> q ->
    (operator * choice) option -> bool **)

let simulated p t0 n k s time0 o =
  match match o with
        | Some p0 ->
          let (o0, ch) = p0 in
          if (&&)
               ((&&) (admitted_choice o0 ch)
                 (known_condition t0 n (fun _ -> n.equivalent) k
                   o0.precondition o0.slot_sizes ch))
               (distinct (map fst o0.number_effects))
          then option_map (app o0.effects)
                 (known_effects t0 n k o0.conditional)
          else None
        | None -> Some [] with
  | Some made ->
    (&&)
      ((&&)
        (forallb (variable_ok t0 n k s made)
          (app (map fst made)
            (flat_map (fun l ->
              match find_atom n.fact_of (fst l) with
              | Some f -> (fst f) :: []
              | None -> []) s.new_truths)))
        (forallb (number_ok n s o)
          (app
            (match o with
             | Some p0 -> let (o0, _) = p0 in map fst o0.number_effects
             | None -> [])
            (flat_map (fun l ->
              match find_atom n.number_of (fst l) with
              | Some n0 -> n0 :: []
              | None -> []) s.new_values))))
      (match growth p n s time0 with
       | Some g ->
         qle_bool (inject_Z (step_cost o))
           (qmult g { qnum = (Zpos n.cost_scale); qden = XH })
       | None -> false)
  | None -> false

(** val form_after : symbolic -> form -> form **)

let form_after s f =
  fold_right (fun t0 g ->
    plus_form g (snd t0)
      (match assoc (fst t0) s.new_values with
       | Some h -> h
       | None -> fluent (fst t0))) (constant (snd f)) (fst f)

(** val stays_invariant : knowledge -> symbolic -> (bool * form) -> bool **)

let stays_invariant k s i =
  (||)
    (forallb (fun t0 ->
      match assoc (fst t0) s.new_values with
      | Some _ -> false
      | None -> true) (fst (snd i)))
    (implied k (fst i) (form_after s (snd i)))

(** val stays_exclusive :
    problem -> task -> names -> knowledge -> symbolic -> atom list -> bool **)

let stays_exclusive p t0 n k s g =
  forallb (fun a ->
    match assoc a s.new_truths with
    | Some b ->
      if b
      then forallb (fun b0 ->
             (||) (atom_eqb a b0) (is_false (symbolic_atom p t0 n k s b0))) g
      else true
    | None -> true) g

(** val with_value : knowledge -> (z * atom) list -> z -> knowledge **)

let with_value k vals y =
  { literals =
    (app (map (fun xa -> ((snd xa), (Z.eqb y (fst xa)))) vals) k.literals);
    bounds = k.bounds }

(** val known_effects_on :
    task -> names -> key1 -> knowledge -> (literal list * fact list) list ->
    fact list option **)

let rec known_effects_on t0 n v k = function
| [] -> Some []
| c :: r ->
  if forallb (fun f -> negb (Coq_Pos.eqb (fst f) v)) (snd c)
  then known_effects_on t0 n v k r
  else if existsb (fun l ->
            is_false (known_literal t0 n (fun _ -> n.equivalent) k l)) 
            (fst c)
       then known_effects_on t0 n v k r
       else if forallb (fun l ->
                 is_true (known_literal t0 n (fun _ -> n.equivalent) k l))
                 (fst c)
            then option_map (app (snd c)) (known_effects_on t0 n v k r)
            else None

(** val split_on :
    problem -> task -> names -> atom list -> (knowledge -> bool) -> knowledge
    -> bool **)

let rec split_on p t0 n atoms check0 k =
  (||) ((||) (check0 k) (contradictory p t0 n k))
    (match atoms with
     | [] -> false
     | a :: r ->
       (&&)
         (split_on p t0 n r check0 { literals = ((a, true) :: k.literals);
           bounds = k.bounds })
         (split_on p t0 n r check0 { literals = ((a, false) :: k.literals);
           bounds = k.bounds }))

(** val max_splits : nat **)

let max_splits =
  S (S (S (S (S (S (S (S (S (S O)))))))))

(** val truths_of : symbolic_change list -> (atom * bool) list **)

let truths_of cs =
  app (atoms_set_to cs true) (atoms_set_to cs false)

(** val projected_variable_ok :
    problem -> task -> names -> knowledge -> action -> key1 list ->
    (operator * choice) option -> key1 -> bool **)

let projected_variable_ok p t0 n k a env o v =
  match M.find v n.variables with
  | Some vals ->
    let keep = fun a0 -> existsb (fun xa -> atom_eqb a0 (snd xa)) vals in
    forallb (fun y ->
      let k0 = with_value k vals y in
      split_on p t0 n
        (firstn max_splits (deciding_atoms p t0 n keep k0 env a.start_effect))
        (fun k1 ->
        match projected p t0 n keep false k1 env a.start_effect with
        | Some cs ->
          (match match o with
                 | Some p0 ->
                   let (o0, _) = p0 in
                   option_map (app o0.effects)
                     (known_effects_on t0 n v k1 o0.conditional)
                 | None -> Some [] with
           | Some made -> value_ok (truths_of cs) made v vals y
           | None -> false)
        | None -> false) k0) (possible t0 n k v)
  | None -> true

(** val projected_ok :
    problem -> task -> names -> knowledge -> action -> key1 list ->
    (operator * choice) option -> bool **)

let projected_ok p t0 n k a env o =
  match a.duration with
  | Some _ -> false
  | None ->
    (match possible_facts p t0 n k env a.start_effect with
     | Some touched ->
       (match projected p t0 n (fun _ -> false) true k env a.start_effect with
        | Some numbers0 ->
          (&&)
            ((&&)
              ((&&)
                ((&&)
                  (forallb (fun l ->
                    (||) (negb (snd l)) (mem0 n.may_hold (fst l))) touched)
                  (forallb (fun g ->
                    match projected p t0 n (fun a0 -> in_group a0 g) false k
                            env a.start_effect with
                    | Some cs ->
                      stays_exclusive p t0 n k { new_truths = (truths_of cs);
                        new_values = []; stale = false } g
                    | None -> false) n.exclusive))
                (match o with
                 | Some p0 ->
                   let (o0, ch) = p0 in
                   (&&)
                     ((&&) (admitted_choice o0 ch)
                       (known_condition t0 n (fun _ -> n.equivalent) k
                         o0.precondition o0.slot_sizes ch))
                     (distinct (map fst o0.number_effects))
                 | None -> true))
              (forallb (projected_variable_ok p t0 n k a env o)
                (app
                  (match o with
                   | Some p0 ->
                     let (o0, _) = p0 in
                     map fst (app o0.effects (flat_map snd o0.conditional))
                   | None -> [])
                  (flat_map (fun l ->
                    match find_atom n.fact_of (fst l) with
                    | Some f -> (fst f) :: []
                    | None -> []) touched))))
            (match symbolic_updates p n unchanged numbers0
                     (symbolic_changed_fluents numbers0) with
             | Some l ->
               let s = { new_truths = []; new_values = l; stale = false } in
               (&&)
                 ((&&) (forallb (stays_invariant k s) n.invariants)
                   (forallb (number_ok n s o)
                     (app
                       (match o with
                        | Some p0 ->
                          let (o0, _) = p0 in map fst o0.number_effects
                        | None -> [])
                       (flat_map (fun l0 ->
                         match find_atom n.number_of (fst l0) with
                         | Some n0 -> n0 :: []
                         | None -> []) l))))
                 (match growth p n s { qnum = Z0; qden = XH } with
                  | Some g ->
                    qle_bool (inject_Z (step_cost o))
                      (qmult g { qnum = (Zpos n.cost_scale); qden = XH })
                  | None -> false)
             | None -> false)
        | None -> false)
     | None -> false)

(** val leaf_ok :
    problem -> task -> names -> knowledge -> action -> key1 list ->
    (operator * choice) option -> bool **)

let leaf_ok p t0 n k a env o =
  match symbolic_step p t0 n k a env with
  | Never -> true
  | Unclear -> projected_ok p t0 n k a env o
  | After (s, time0) ->
    (&&)
      ((&&)
        ((&&)
          (forallb (fun l ->
            match assoc (fst l) s.new_truths with
            | Some b -> if b then mem0 n.may_hold (fst l) else true
            | None -> true) s.new_truths)
          (forallb (stays_exclusive p t0 n k s) n.exclusive))
        (forallb (stays_invariant k s) n.invariants))
      (simulated p t0 n k s time0 o)

(** val tree_ok :
    problem -> task -> names -> (knowledge -> (nat * choice) option -> bool)
    -> knowledge -> case_tree -> bool **)

let rec tree_ok p t0 n leaf k = function
| Decided o -> leaf k o
| Impossible -> contradictory p t0 n k
| SplitAtom (a, t2, u) ->
  (&&)
    (tree_ok p t0 n leaf { literals = ((a, true) :: k.literals); bounds =
      k.bounds } t2)
    (tree_ok p t0 n leaf { literals = ((a, false) :: k.literals); bounds =
      k.bounds } u)
| SplitForm (f, t2, u) ->
  (&&)
    (tree_ok p t0 n leaf { literals = k.literals; bounds = ((false,
      f) :: k.bounds) } t2)
    (tree_ok p t0 n leaf { literals = k.literals; bounds = ((true,
      (plus_form (constant { qnum = Z0; qden = XH }) { qnum = (Zneg XH);
        qden = XH } f)) :: k.bounds) } u)

(** val instance_leaf :
    problem -> task -> names -> action -> key1 list -> knowledge ->
    (nat * choice) option -> bool **)

let instance_leaf p t0 n a env k = function
| Some p0 ->
  let (i, ch) = p0 in
  (match nth_error t0.operators i with
   | Some o0 -> leaf_ok p t0 n k a env (Some (o0, ch))
   | None -> false)
| None -> leaf_ok p t0 n k a env None

(** val goal_leaf :
    problem -> task -> names -> knowledge -> (nat * choice) option -> bool **)

let goal_leaf p t0 n k _ =
  match symbolic_truth p t0 n k unchanged Undefined [] p.goal_formula with
  | Some b ->
    if b
    then known_condition t0 n (fun _ -> n.equivalent) k t0.goal [] []
    else true
  | None -> known_condition t0 n (fun _ -> n.equivalent) k t0.goal [] []

(** val static_false : problem -> names -> key1 list -> formula -> bool **)

let rec static_false p n env = function
| Atom (p0, ts) ->
  (&&) (negb (n.changing p0))
    (match ground env ts with
     | Some l -> negb ((initial p).holds_in (p0, l))
     | None -> false)
| Same (t0, u) ->
  (match object_of env t0 with
   | Some a ->
     (match object_of env u with
      | Some b -> negb (Coq_Pos.eqb a b)
      | None -> false)
   | None -> false)
| Not f0 ->
  (match f0 with
   | Atom (p0, ts) ->
     (&&) (negb (n.changing p0))
       (match ground env ts with
        | Some l -> (initial p).holds_in (p0, l)
        | None -> false)
   | Same (t0, u) ->
     (match object_of env t0 with
      | Some a ->
        (match object_of env u with
         | Some b -> Coq_Pos.eqb a b
         | None -> false)
      | None -> false)
   | _ -> false)
| And (g, h) -> (||) (static_false p n env g) (static_false p n env h)
| _ -> false

(** val instances :
    problem -> (key1 list -> bool) -> key1 list -> key1 list -> key1 list list **)

let rec instances p prune types env =
  match types with
  | [] -> env :: []
  | t0 :: r ->
    flat_map (fun o ->
      if prune (app env (o :: []))
      then []
      else instances p prune r (app env (o :: []))) (p.objects t0)

(** val pruned : problem -> names -> action -> key1 list -> bool **)

let pruned p n a env =
  (||) (static_false p n env a.at_start)
    (match a.duration with
     | Some _ -> static_false p n env a.at_end
     | None -> false)

(** val effect_heads : effect -> key1 list **)

let rec effect_heads = function
| Nothing -> []
| Put (_, p, _) -> p :: []
| Change (_, f, _, _) -> f :: []
| Both (a, b) -> app (effect_heads a) (effect_heads b)
| When (_, a) -> effect_heads a
| Each (_, a) -> effect_heads a

(** val action_ok :
    problem -> task -> names -> (nat -> key1 list -> case_tree) -> nat ->
    action -> bool **)

let action_ok p t0 n case i a =
  (&&)
    (forallb (fun p0 -> (&&) (n.changing p0) (negb (is_derived p p0)))
      (app (effect_heads a.start_effect) (effect_heads a.end_effect)))
    (forallb (fun env ->
      tree_ok p t0 n (instance_leaf p t0 n a env)
        (with_invariants n (gathered p t0 n a env)) (case i env))
      (instances p (pruned p n a) a.parameters []))

(** val all_entries : 'a1 atom_map -> (atom * 'a1) list **)

let all_entries m =
  flat_map snd (PositiveMap.elements m)

(** val ground_rules : task -> (z * condition) list M.t **)

let ground_rules t0 =
  fold_right (fun r m ->
    M.add (fst (fst r)) (((snd (fst r)),
      (snd r)) :: (match M.find (fst (fst r)) m with
                   | Some l -> l
                   | None -> [])) m) M.empty (concat t0.layers)

(** val rule_leaf :
    problem -> task -> names -> (key1 -> bool) -> (z * condition) list M.t ->
    atom -> knowledge -> bool **)

let rule_leaf p t0 n full rules a k =
  (||) (impossible p t0 n k)
    ((&&) (mem0 n.may_hold a)
      (match find_atom n.derived_of a with
       | Some p0 ->
         let (v, x) = p0 in
         (match M.find v rules with
          | Some l ->
            existsb (fun r ->
              (&&) (Z.eqb (fst r) x)
                (known_condition t0 n full k (snd r) [] [])) l
          | None -> false)
       | None -> true))

(** val rule_ok :
    problem -> task -> names -> nat -> (z * condition) list M.t ->
    (atom * formula) -> bool **)

let rule_ok p t0 n stratum rules i =
  match find_atom n.derived_of (fst i) with
  | Some _ ->
    expand p t0 n (unfold p t0 n max_unfoldings stratum) (snd i) true
      (snd (fst i))
      (rule_leaf p t0 n (fun p0 ->
        (&&) n.equivalent (Nat.leb (level p.strata p0) stratum)) rules
        (fst i)) { literals = []; bounds = [] }
  | None ->
    if mem0 n.may_hold (fst i)
    then true
    else expand p t0 n (unfold p t0 n max_unfoldings stratum) (snd i) true
           (snd (fst i))
           (rule_leaf p t0 n (fun p0 ->
             (&&) n.equivalent (Nat.leb (level p.strata p0) stratum)) rules
             (fst i)) { literals = []; bounds = [] }

(** val strata_ok :
    problem -> task -> names -> nat -> (z * condition) list M.t -> rule list
    list -> bool **)

let rec strata_ok p t0 n stratum rules = function
| [] -> true
| here :: later ->
  (&&) (forallb (rule_ok p t0 n stratum rules) (rule_instances p here))
    (strata_ok p t0 n (S stratum) rules later)

(** val ground_literals :
    problem -> names -> nat -> condition -> (atom * bool) list **)

let ground_literals p n limit c =
  flat_map (fun f ->
    match M.find (fst f) n.variables with
    | Some vals -> map (fun xa -> ((snd xa), (Z.eqb (snd f) (fst xa)))) vals
    | None ->
      (match M.find (fst f) n.derived_atoms with
       | Some p0 ->
         let (p1, a) = p0 in
         let (y, _) = p1 in
         if (&&) (Z.eqb (snd f) y)
              (negb (Nat.leb (level p.strata (fst a)) limit))
         then []
         else (a, (Z.eqb (snd f) y)) :: []
       | None -> [])) c.facts

(** val ground_rule_ok :
    problem -> task -> names -> z M.t -> (fact * condition) -> bool **)

let ground_rule_ok p t0 n heads r =
  match M.find (fst (fst r)) n.derived_atoms with
  | Some p0 ->
    let (_, a) = p0 in
    (&&)
      (forallb (fun f ->
        match M.find (fst f) n.derived_atoms with
        | Some p1 ->
          let (p2, _) = p1 in
          let (y, _) = p2 in
          (||) (Z.eqb (snd f) y)
            (match M.find (fst f) heads with
             | Some _ -> false
             | None -> true)
        | None -> true) (snd r).facts)
      (let limit = level p.strata (fst a) in
       let k = { literals = (ground_literals p n limit (snd r)); bounds = [] }
       in
       existsb (fun rule0 ->
         is_some true
           (definite p (look_up p t0 n max_unfoldings limit k) (snd a)
             rule0.body)) (rules_of p a))
  | None -> true

(** val ground_rules_ok :
    problem -> task -> names -> (fact * condition) list list -> bool * z M.t **)

let rec ground_rules_ok p t0 n = function
| [] -> (true, M.empty)
| rules :: rest ->
  let (ok, later) = ground_rules_ok p t0 n rest in
  let heads =
    fold_left (fun m r -> M.add (fst (fst r)) (snd (fst r)) m) rules later
  in
  (((&&) ok (forallb (ground_rule_ok p t0 n heads) rules)), heads)

(** val rules_ok : problem -> task -> names -> bool **)

let rules_ok p t0 n =
  (&&)
    ((&&)
      ((&&)
        ((&&)
          ((&&)
            ((&&)
              ((&&)
                ((&&) (is_stratified p.strata) (fst (check_layers t0.layers)))
                (forallb (forallb (fun r -> n.changing r.head)) p.strata))
              (forallb (fun vxa ->
                let (v, y) = vxa in
                let (y0, a) = y in
                let (x, d) = y0 in
                (&&)
                  ((&&)
                    ((&&)
                      ((&&)
                        ((&&) (is_derived p (fst a)) (negb (is_basic t0 v)))
                        (negb (Z.eqb x d)))
                      (existsb (fun f -> Coq_Pos.eqb (fst f) v) t0.derived))
                    (forallb (fun f ->
                      (||) (negb (Coq_Pos.eqb (fst f) v)) (Z.eqb (snd f) d))
                      t0.derived))
                  (match find_atom n.derived_of a with
                   | Some p0 ->
                     let (u, y1) = p0 in (&&) (Coq_Pos.eqb u v) (Z.eqb y1 x)
                   | None -> false)) (M.elements n.derived_atoms)))
            (forallb (forallb (fun a -> negb (is_derived p (fst a))))
              n.exclusive))
          (forallb (fun vl ->
            forallb (fun xa -> negb (is_derived p (fst (snd xa)))) (snd vl))
            (M.elements n.variables)))
        (forallb
          (forallb (fun r ->
            match M.find (fst (fst r)) n.derived_atoms with
            | Some p0 ->
              let (p1, _) = p0 in let (x, _) = p1 in Z.eqb (snd (fst r)) x
            | None -> true)) t0.layers))
      ((||) (negb n.equivalent) (fst (ground_rules_ok p t0 n t0.layers))))
    (strata_ok p t0 n O (ground_rules t0) p.strata)

(** val faithful :
    problem -> task -> names -> (nat -> key1 list -> case_tree) -> case_tree
    -> bool **)

let faithful p t0 n case goal_case =
  (&&)
    ((&&)
      ((&&)
        ((&&)
          ((&&)
            ((&&)
              ((&&)
                ((&&)
                  (forallb (fun i ->
                    if fst i
                    then less { qnum = Z0; qden = XH }
                           (ev (initial p) (snd i))
                    else qle_bool { qnum = Z0; qden = XH }
                           (ev (initial p) (snd i))) n.invariants)
                  (rules_ok p t0 n))
                (forallb (fun e ->
                  (||) (negb (n.changing (fst (fst e))))
                    (mem0 n.may_hold (fst e))) (all_entries p.initial_atoms)))
              (forallb (fun vl ->
                let (v, vals) = vl in
                (&&) (is_basic t0 v)
                  (forallb (fun xa ->
                    let (x, a) = xa in
                    (&&)
                      (eqb ((initial p).holds_in a)
                        (Z.eqb (var_value t0.init v) x))
                      (match find_atom n.fact_of a with
                       | Some p0 ->
                         let (u, y) = p0 in (&&) (Coq_Pos.eqb u v) (Z.eqb y x)
                       | None -> false)) vals)) (M.elements n.variables)))
            (forallb (fun e ->
              let (a, y) = e in
              let (v, x) = y in
              (match M.find v n.variables with
               | Some vals ->
                 existsb (fun xa ->
                   (&&) (Z.eqb (fst xa) x) (atom_eqb (snd xa) a)) vals
               | None -> false)) (all_entries n.fact_of)))
          (forallb (fun nf ->
            let (n0, f) = nf in
            (&&)
              ((&&) ((&&) (mem_key n0 t0.numbers) (n.changing (fst f)))
                (match (initial p).value_in f with
                 | Some q0 ->
                   qeq_bool (qmult q0 (scaled n))
                     (inject_Z (num_value t0.init n0))
                 | None -> false))
              (match find_atom n.number_of f with
               | Some m -> Coq_Pos.eqb m n0
               | None -> false)) (M.elements n.fluents)))
        (tree_ok p t0 n (goal_leaf p t0 n)
          (with_invariants n
            (conjuncts p n unchanged Undefined [] p.goal_formula)) goal_case))
      (forallb (fun ia -> action_ok p t0 n case (fst ia) (snd ia))
        (combine (seq O (length p.actions)) p.actions)))
    (forallb (fun g ->
      forallb (fun a ->
        (||) (negb ((initial p).holds_in a))
          (forallb (fun b ->
            (||) (atom_eqb a b) (negb ((initial p).holds_in b))) g)) g)
      n.exclusive)

(** val is_linear : problem -> names -> bool **)

let is_linear p n =
  match symbolic_expression p n unchanged Undefined [] p.metric with
  | Is _ -> true
  | _ -> false

(** val check_certificate :
    problem -> task -> names -> (nat -> key1 list -> case_tree) -> case_tree
    -> argument -> (state -> positive list) -> (nat * key1 list) list -> q
    option -> bool **)

let check_certificate p t0 n case goal_case a oracle plan claim =
  (&&) ((&&) (check_task t0) (faithful p t0 n case goal_case))
    (match eval (initial p) None [] p.metric with
     | Some first ->
       (match claim with
        | Some m ->
          (&&)
            ((&&) (is_linear p n)
              (match execute p false (initial p) { qnum = Z0; qden = XH } plan with
               | Some p0 ->
                 let (w, spent) = p0 in
                 (match final_metric p w spent with
                  | Some m' -> qeq_bool m' m
                  | None -> false)
               | None -> false))
            (let cost0 =
               qred
                 (qmult (qminus m first) { qnum = (Zpos n.cost_scale); qden =
                   XH })
             in
             (&&) (Coq_Pos.eqb cost0.qden XH)
               (check t0 a (Some cost0.qnum) oracle))
        | None -> check t0 a None oracle)
     | None ->
       (match claim with
        | Some _ -> false
        | None -> check t0 a None oracle))

type objective = { objective_metric : expression; time_weight : q;
                   step_weight : q }

(** val with_objective : problem -> objective -> problem **)

let with_objective p o =
  { objects = p.objects; actions = p.actions; strata = p.strata;
    initial_atoms = p.initial_atoms; initial_values = p.initial_values;
    goal_formula = p.goal_formula; metric = o.objective_metric; per_time =
    o.time_weight; per_step = o.step_weight }

(** val objective_value :
    problem -> bool -> objective -> (nat * key1 list) list -> q option **)

let objective_value p allow_zero o plan =
  match execute (with_objective p o) allow_zero (initial p) { qnum = Z0;
          qden = XH } plan with
  | Some p0 ->
    let (w, spent) = p0 in final_metric (with_objective p o) w spent
  | None -> None

type evidence = { list_task : task; list_names : names;
                  list_case : (nat -> key1 list -> case_tree);
                  list_goal_case : case_tree; list_argument : argument;
                  list_oracle : (state -> positive list) }

(** val accepts :
    problem -> evidence -> (nat * key1 list) list -> q -> bool **)

let accepts p e plan claim =
  check_certificate p e.list_task e.list_names e.list_case e.list_goal_case
    e.list_argument e.list_oracle plan (Some claim)

(** val limited : problem -> bool -> expression -> q -> problem **)

let limited p strict e m =
  { objects = p.objects; actions = p.actions; strata = p.strata;
    initial_atoms = p.initial_atoms; initial_values = p.initial_values;
    goal_formula = (And ((Compare (strict, (Constant m), e)),
    p.goal_formula)); metric = p.metric; per_time = p.per_time; per_step =
    p.per_step }

(** val is_untimed : objective -> bool **)

let is_untimed o =
  (&&) (qeq_bool o.time_weight { qnum = Z0; qden = XH })
    (qeq_bool o.step_weight { qnum = Z0; qden = XH })

(** val check_list :
    problem -> objective list -> evidence list -> (nat * key1 list) list -> q
    list -> bool **)

let rec check_list p objectives es plan ms =
  match objectives with
  | [] ->
    (match es with
     | [] -> (match ms with
              | [] -> true
              | _ :: _ -> false)
     | _ :: _ -> false)
  | o :: rest ->
    (match es with
     | [] -> false
     | e :: es0 ->
       (match ms with
        | [] -> false
        | m :: ms0 ->
          (&&) (accepts (with_objective p o) e plan m)
            (match rest with
             | [] ->
               (match es0 with
                | [] -> (match ms0 with
                         | [] -> true
                         | _ :: _ -> false)
                | _ :: _ -> false)
             | _ :: _ ->
               (&&) (is_untimed o)
                 (check_list (limited p false o.objective_metric m) rest es0
                   plan ms0))))

type point = { point_plan : (nat * key1 list) list; first_value : q;
               second_value : q }

(** val within : problem -> objective -> q option -> problem **)

let within p second = function
| Some m -> limited p true second.objective_metric m
| None -> p

(** val has_value :
    problem -> objective -> (nat * key1 list) list -> q -> bool **)

let has_value p o plan m =
  match objective_value p false o plan with
  | Some x -> qeq_bool x m
  | None -> false

(** val check_points :
    problem -> objective -> objective -> q option -> evidence list -> point
    list -> bool **)

let rec check_points p first second limit es = function
| [] -> false
| p0 :: rest ->
  (match es with
   | [] -> false
   | e :: es0 ->
     (&&)
       ((&&)
         (accepts (with_objective (within p second limit) first) e
           p0.point_plan p0.first_value)
         (has_value p second p0.point_plan p0.second_value))
       (match rest with
        | [] ->
          (match es0 with
           | [] -> false
           | e0 :: l ->
             (match l with
              | [] ->
                accepts (with_objective p second) e0 p0.point_plan
                  p0.second_value
              | _ :: _ -> false))
        | q0 :: _ ->
          (&&)
            ((&&) (less p0.first_value q0.first_value)
              (less q0.second_value p0.second_value))
            (check_points p first second (Some p0.second_value) es0 rest)))

(** val check_front :
    problem -> objective -> objective -> evidence list -> point list -> bool **)

let check_front p first second es points =
  (&&) (is_untimed second) (check_points p first second None es points)

type event = { time : q; sets : (atom * bool) list }

(** val occur : world -> event -> world **)

let occur w v =
  { holds_in = (fun a ->
    match assoc a v.sets with
    | Some b -> b
    | None -> w.holds_in a); value_in = w.value_in }

(** val elapse : world -> event list -> world **)

let elapse w vs =
  fold_left occur vs w

(** val after_until : event list -> q -> q -> event list **)

let after_until events t0 u =
  filter (fun v -> (&&) (less t0 v.time) (qle_bool v.time u)) events

(** val between : event list -> q -> q -> event list **)

let between events t0 u =
  filter (fun v -> (&&) (less t0 v.time) (less v.time u)) events

(** val at_time : event list -> q -> event list **)

let at_time events t0 =
  filter (fun v -> (&&) (qle_bool t0 v.time) (qle_bool v.time t0)) events

(** val atoms_read : problem -> key1 list -> formula -> atom list **)

let rec atoms_read p env = function
| Atom (p0, ts) ->
  (match ground env ts with
   | Some l -> (p0, l) :: []
   | None -> [])
| Not g -> atoms_read p env g
| And (g, h) -> app (atoms_read p env g) (atoms_read p env h)
| Forall (t0, g) ->
  flat_map (fun o -> atoms_read p (app env (o :: [])) g) (p.objects t0)
| _ -> []

(** val atoms_read_by_effect : problem -> key1 list -> effect -> atom list **)

let rec atoms_read_by_effect p env = function
| Both (a, b) ->
  app (atoms_read_by_effect p env a) (atoms_read_by_effect p env b)
| When (f, a) -> app (atoms_read p env f) (atoms_read_by_effect p env a)
| Each (t0, a) ->
  flat_map (fun o -> atoms_read_by_effect p (app env (o :: [])) a)
    (p.objects t0)
| _ -> []

(** val interferes :
    problem -> event list -> world -> q option -> key1 list -> formula ->
    effect -> q -> bool **)

let interferes p events w d env f e t0 =
  existsb (fun l ->
    (||)
      (existsb (atom_eqb (fst l))
        (app (atoms_read p env f) (atoms_read_by_effect p env e)))
      (match changes p w d env e with
       | Some cs -> sets_atom cs (fst l) (negb (snd l))
       | None -> false)) (flat_map (fun e0 -> e0.sets) (at_time events t0))

(** val pass :
    problem -> world -> q option -> key1 list -> formula -> event list ->
    world option **)

let rec pass p w d env f = function
| [] -> Some w
| v :: r ->
  (match truth p w d env f with
   | Some b -> if b then pass p (occur w v) d env f r else None
   | None -> None)

(** val timed_step :
    problem -> event list -> bool -> world -> q -> q -> action -> key1 list
    -> (world * q) option **)

let timed_step p events allow_zero w now s a env =
  if (||) (less s now)
       (negb
         ((&&) (Nat.eqb (length env) (length a.parameters))
           (forallb (fun x ->
             existsb (Coq_Pos.eqb (fst x)) (p.objects (snd x)))
             (combine env a.parameters))))
  then None
  else let w0 = elapse w (after_until events now s) in
       (match a.duration with
        | Some x ->
          (match eval w0 None env x with
           | Some d ->
             if less d { qnum = Z0; qden = XH }
             then None
             else if qeq_bool d { qnum = Z0; qden = XH }
                  then let f = And (a.at_start, a.at_end) in
                       let e = Both (a.start_effect, a.end_effect) in
                       if (||) (negb allow_zero)
                            (interferes p events w0 (Some d) env f e s)
                       then None
                       else option_map (fun w1 -> (w1, d))
                              (happening p w0 (Some d) env f e)
                  else if interferes p events w0 (Some d) env a.at_start
                            a.start_effect s
                       then None
                       else (match happening p w0 (Some d) env a.at_start
                                     a.start_effect with
                             | Some w1 ->
                               (match pass p w1 (Some d) env a.over_all
                                        (between events s (qplus s d)) with
                                | Some w2 ->
                                  if interferes p events w2 (Some d) env
                                       a.at_end a.end_effect (qplus s d)
                                  then None
                                  else option_map (fun w3 ->
                                         ((elapse w3
                                            (at_time events (qplus s d))),
                                         d))
                                         (happening p w2 (Some d) env (And
                                           (a.over_all, a.at_end))
                                           a.end_effect)
                                | None -> None)
                             | None -> None)
           | None -> None)
        | None ->
          if interferes p events w0 None env a.at_start a.start_effect s
          then None
          else option_map (fun w1 -> (w1, { qnum = Z0; qden = XH }))
                 (happening p w0 None env a.at_start a.start_effect))

(** val timed_execute :
    problem -> event list -> bool -> world -> q -> q -> (q * (nat * key1
    list)) list -> (world * q) option **)

let rec timed_execute p events allow_zero w now spent = function
| [] ->
  (match truth p w None [] p.goal_formula with
   | Some b -> if b then Some (w, spent) else None
   | None -> None)
| p0 :: r ->
  let (s, p1) = p0 in
  let (i, env) = p1 in
  (match nth_error p.actions i with
   | Some a ->
     (match timed_step p events allow_zero w now s a env with
      | Some p2 ->
        let (w', d) = p2 in
        timed_execute p events allow_zero w' (qplus s d)
          (qred (qplus (qplus spent (qmult p.per_time d)) p.per_step)) r
      | None -> None)
   | None -> None)

type timeline = { grid : positive; phase_atoms : atom list; waited : 
                  atom; clock : atom }

type passage = ((nat * nat) * nat) * nat

(** val is_present : 'a1 option -> bool **)

let is_present = function
| Some _ -> true
| None -> false

(** val on_grid : timeline -> q -> bool **)

let on_grid x q0 =
  Coq_Pos.eqb (qred (qmult q0 { qnum = (Zpos x.grid); qden = XH })).qden XH

(** val moment : timeline -> q **)

let moment x =
  { qnum = (Zpos XH); qden = x.grid }

(** val phase : timeline -> nat -> atom **)

let phase x i =
  nth i x.phase_atoms x.waited

(** val up_to : event list -> q -> nat **)

let up_to events t0 =
  length (filter (fun v -> qle_bool v.time t0) events)

(** val extended : problem -> event list -> timeline -> problem **)

let extended p events x =
  { objects = p.objects; actions = []; strata = []; initial_atoms =
    (add_atom (phase x (up_to events { qnum = Z0; qden = XH })) ()
      p.initial_atoms); initial_values =
    (add_atom x.clock { qnum = Z0; qden = XH } p.initial_values);
    goal_formula = (And ((Not (Atom ((fst x.waited),
    (map (fun x0 -> Object x0) (snd x.waited))))), p.goal_formula)); metric =
    p.metric; per_time = p.per_time; per_step = { qnum = Z0; qden = XH } }

(** val is_added : timeline -> key1 -> bool **)

let is_added x p =
  existsb (Coq_Pos.eqb p)
    ((fst x.waited) :: ((fst x.clock) :: (map fst x.phase_atoms)))

(** val expression_free : timeline -> expression -> bool **)

let rec expression_free x = function
| Fluent (f, _) -> negb (is_added x f)
| Plus (a, b) -> (&&) (expression_free x a) (expression_free x b)
| Minus (a, b) -> (&&) (expression_free x a) (expression_free x b)
| Times (a, b) -> (&&) (expression_free x a) (expression_free x b)
| Over (a, b) -> (&&) (expression_free x a) (expression_free x b)
| _ -> true

(** val formula_free : timeline -> formula -> bool **)

let rec formula_free x = function
| Atom (p, _) -> negb (is_added x p)
| Compare (_, a, b) -> (&&) (expression_free x a) (expression_free x b)
| Not g -> formula_free x g
| And (g, h) -> (&&) (formula_free x g) (formula_free x h)
| Forall (_, g) -> formula_free x g
| _ -> true

(** val effect_free : timeline -> effect -> bool **)

let rec effect_free x = function
| Nothing -> true
| Put (_, p, _) -> negb (is_added x p)
| Change (_, f, _, x0) -> (&&) (negb (is_added x f)) (expression_free x x0)
| Both (a, b) -> (&&) (effect_free x a) (effect_free x b)
| When (f, a) -> (&&) (formula_free x f) (effect_free x a)
| Each (_, a) -> effect_free x a

(** val action_free : timeline -> action -> bool **)

let action_free x a =
  (&&)
    ((&&)
      ((&&)
        ((&&)
          ((&&) (formula_free x a.at_start) (effect_free x a.start_effect))
          (formula_free x a.over_all)) (formula_free x a.at_end))
      (effect_free x a.end_effect))
    (match a.duration with
     | Some e -> expression_free x e
     | None -> true)

(** val time_at : event list -> nat -> q list **)

let time_at events i =
  match nth_error events i with
  | Some v -> v.time :: []
  | None -> []

(** val last_time : event list -> nat -> q list **)

let last_time events = function
| O -> []
| S j -> time_at events j

(** val lower : event list -> passage -> q -> (q * bool) list **)

let lower events g d =
  let (p, e) = g in
  let (p0, c) = p in
  let (a, b) = p0 in
  ({ qnum = Z0; qden = XH },
  false) :: (app (map (fun t0 -> (t0, (Nat.eqb a b))) (last_time events b))
              (map (fun t0 -> ((qminus t0 d), (Nat.eqb c e)))
                (last_time events e)))

(** val upper : event list -> passage -> q -> (q * bool) list **)

let upper events g d =
  let (p, e) = g in
  let (p0, c) = p in
  let (a, b) = p0 in
  app (map (fun t0 -> (t0, (Nat.eqb a b))) (time_at events a))
    (map (fun t0 -> ((qminus t0 d), (Nat.eqb c e))) (time_at events c))

(** val feasible : event list -> passage -> q -> bool **)

let feasible events g d =
  forallb (fun l ->
    forallb (fun u ->
      if (||) (snd l) (snd u)
      then less (fst l) (fst u)
      else qle_bool (fst l) (fst u)) (upper events g d)) (lower events g d)

(** val passages : event list -> passage list **)

let passages events =
  let n = length events in
  let from = fun a -> seq a (sub (S n) a) in
  let next = fun a -> filter (fun b -> Nat.leb b n) (a :: ((S a) :: [])) in
  flat_map (fun a ->
    flat_map (fun b ->
      flat_map (fun c -> map (fun e -> (((a, b), c), e)) (next c)) (from a))
      (next a)) (from O)

(** val put_sets : symbolic -> event -> symbolic **)

let put_sets s v =
  { new_truths = (app v.sets s.new_truths); new_values = s.new_values;
    stale = s.stale }

(** val slice : event list -> nat -> nat -> event list **)

let slice events i j =
  skipn i (firstn j events)

(** val surely_interferes :
    problem -> event list -> task -> names -> timeline -> knowledge ->
    symbolic -> result -> key1 list -> formula -> effect -> event list -> bool **)

let surely_interferes p events t0 n x k s d env f e vs =
  existsb (fun l ->
    (||)
      (existsb (atom_eqb (fst l))
        (app (atoms_read p env f) (atoms_read_by_effect p env e)))
      (match symbolic_changes (extended p events x) t0 n k s d env e with
       | Some ss ->
         is_present (assoc (fst l) (atoms_set_to ss (negb (snd l))))
       | None -> false)) (flat_map (fun e0 -> e0.sets) vs)

(** val symbolic_pass :
    problem -> event list -> task -> names -> timeline -> knowledge ->
    symbolic -> result -> key1 list -> formula -> event list -> symbolic
    option **)

let rec symbolic_pass p events t0 n x k s d env f = function
| [] -> Some s
| v :: r ->
  (match symbolic_truth (extended p events x) t0 n k s d env f with
   | Some b ->
     if b
     then symbolic_pass p events t0 n x k (put_sets s v) d env f r
     else None
   | None -> symbolic_pass p events t0 n x k (put_sets s v) d env f r)

(** val symbolic_timed_step :
    problem -> event list -> task -> names -> timeline -> knowledge -> action
    -> key1 list -> passage -> result -> q -> outcome **)

let symbolic_timed_step p events t0 n x k a env g d q0 =
  let (p0, n0) = g in
  let (p1, m) = p0 in
  let (i, j) = p1 in
  let happens = fun s time0 f e ->
    symbolic_happening (extended p events x) t0 n k s d time0 env f e
  in
  (match a.duration with
   | Some _ ->
     if qeq_bool q0 { qnum = Z0; qden = XH }
     then let f = And (a.at_start, a.at_end) in
          let e = Both (a.start_effect, a.end_effect) in
          if surely_interferes p events t0 n x k unchanged d env f e
               (slice events i j)
          then Never
          else happens unchanged q0 f e
     else if surely_interferes p events t0 n x k unchanged d env a.at_start
               a.start_effect (slice events i j)
          then Never
          else (match happens unchanged q0 a.at_start a.start_effect with
                | After (s, _) ->
                  (match symbolic_pass p events t0 n x k s d env a.over_all
                           (slice events j m) with
                   | Some s0 ->
                     if surely_interferes p events t0 n x k s0 d env a.at_end
                          a.end_effect (slice events m n0)
                     then Never
                     else (match happens s0 q0 (And (a.over_all, a.at_end))
                                   a.end_effect with
                           | After (s1, t1) ->
                             After
                               ((fold_left put_sets (slice events m n0) s1),
                               t1)
                           | x0 -> x0)
                   | None -> Never)
                | x0 -> x0)
   | None ->
     if surely_interferes p events t0 n x k unchanged d env a.at_start
          a.start_effect (slice events i j)
     then Never
     else happens unchanged { qnum = Z0; qden = XH } a.at_start a.start_effect)

(** val new_clock :
    names -> timeline -> (operator * choice) option -> form option **)

let new_clock n x o =
  match find_atom n.number_of x.clock with
  | Some n0 ->
    (match o with
     | Some p ->
       let (o0, ch) = p in
       (match find (fun c -> Coq_Pos.eqb (fst c) n0) o0.number_effects with
        | Some c -> form_of n (snd c) o0.slot_sizes ch
        | None -> Some (fluent x.clock))
     | None -> Some (fluent x.clock))
  | None -> Some (fluent x.clock)

(** val clock_ok : timeline -> form -> (q * bool) list -> q -> bool **)

let clock_ok x g starts d =
  let (l, c) = g in
  (match l with
   | [] ->
     existsb (fun l0 ->
       (||) (qle_bool c (qplus (fst l0) d))
         ((&&) ((&&) (snd l0) (on_grid x (qplus (fst l0) d)))
           (less c (qplus (qplus (fst l0) d) (moment x))))) starts
   | p :: l0 ->
     let (a, q0) = p in
     (match l0 with
      | [] ->
        (&&)
          ((&&) (atom_eqb a x.clock)
            (qeq_bool q0 { qnum = (Zpos XH); qden = XH }))
          ((||) (qeq_bool c d) (qeq_bool c { qnum = Z0; qden = XH }))
      | _ :: _ -> false))

(** val closes :
    problem -> event list -> task -> names -> timeline -> knowledge ->
    symbolic -> q -> (atom * bool) list -> (q * bool) list -> q ->
    (operator * choice) option -> bool **)

let closes p events t0 n x k s t1 marks starts d o =
  match new_clock n x o with
  | Some g ->
    let s0 = { new_truths = (app marks s.new_truths); new_values = ((x.clock,
      g) :: s.new_values); stale = s.stale }
    in
    (&&)
      ((&&)
        ((&&)
          ((&&) (clock_ok x g starts d)
            (forallb (fun l ->
              match assoc (fst l) s0.new_truths with
              | Some b -> if b then mem0 n.may_hold (fst l) else true
              | None -> true) s0.new_truths))
          (forallb (stays_exclusive (extended p events x) t0 n k s0)
            n.exclusive)) (forallb (stays_invariant k s0) n.invariants))
      (simulated (extended p events x) t0 n k s0 t1 o)
  | None -> false

(** val with_operator :
    task -> ((operator * choice) option -> bool) -> (nat * choice) option ->
    bool **)

let with_operator t0 leaf = function
| Some p ->
  let (i, ch) = p in
  (match nth_error t0.operators i with
   | Some o0 -> leaf (Some (o0, ch))
   | None -> false)
| None -> leaf None

(** val timed_leaf :
    problem -> event list -> task -> names -> timeline -> action -> key1 list
    -> passage -> result -> q -> knowledge -> (nat * choice) option -> bool **)

let timed_leaf p events t0 n x a env g d q0 k o =
  match symbolic_timed_step p events t0 n x k a env g d q0 with
  | Never -> true
  | Unclear -> false
  | After (s, t1) ->
    let (p0, until) = g in
    let (p1, _) = p0 in
    let (_, from) = p1 in
    with_operator t0
      (closes p events t0 n x k s t1 (((phase x until),
        true) :: (((phase x from), false) :: ((x.waited, false) :: [])))
        (lower events g q0) q0) o

(** val wait_leaf :
    problem -> event list -> task -> names -> timeline -> nat -> event ->
    knowledge -> (nat * choice) option -> bool **)

let wait_leaf p events t0 n x i v k o =
  with_operator t0
    (closes p events t0 n x k (put_sets unchanged v) { qnum = Z0; qden = XH }
      (((phase x (S i)), true) :: (((phase x i), false) :: ((x.waited,
      true) :: []))) ((v.time, false) :: []) { qnum = Z0; qden = XH }) o

(** val start_knowledge :
    problem -> event list -> names -> timeline -> action -> key1 list ->
    passage -> result -> q -> knowledge **)

let start_knowledge p events n x a env g d q0 =
  let k = conjuncts (extended p events x) n unchanged d env a.at_start in
  let (p0, _) = g in
  let (p1, _) = p0 in
  let (_, from) = p1 in
  with_invariants n { literals = (((phase x from), true) :: k.literals);
    bounds =
    (app
      (map (fun u -> ((snd u), (((x.clock, { qnum = (Zneg XH); qden =
        XH }) :: []), (fst u)))) (upper events g q0)) k.bounds) }

(** val fixed_duration :
    problem -> event list -> names -> timeline -> action -> key1 list ->
    (result * q) option option **)

let fixed_duration p events n x a env =
  match a.duration with
  | Some e ->
    (match symbolic_expression (extended p events x) n unchanged Undefined
             env e with
     | Undefined -> Some None
     | Unknown -> None
     | Is f ->
       let (l, q0) = f in
       (match l with
        | [] -> Some (Some ((Is (constant q0)), q0))
        | _ :: _ -> None))
  | None -> Some (Some (Undefined, { qnum = Z0; qden = XH }))

(** val timed_instance_ok :
    problem -> event list -> task -> names -> timeline -> (nat -> key1 list
    -> passage -> case_tree) -> nat -> action -> key1 list -> bool **)

let timed_instance_ok p events t0 n x case i a env =
  match fixed_duration p events n x a env with
  | Some o ->
    (match o with
     | Some p0 ->
       let (d, q0) = p0 in
       (||) (less q0 { qnum = Z0; qden = XH })
         ((&&) (on_grid x q0)
           (forallb (fun g ->
             (||) (negb (feasible events g q0))
               (tree_ok (extended p events x) t0 n
                 (timed_leaf p events t0 n x a env g d q0)
                 (start_knowledge p events n x a env g d q0) (case i env g)))
             (passages events)))
     | None -> true)
  | None -> false

(** val timed_action_ok :
    problem -> event list -> task -> names -> timeline -> (nat -> key1 list
    -> passage -> case_tree) -> nat -> action -> bool **)

let timed_action_ok p events t0 n x case i a =
  (&&)
    ((&&) (action_free x a)
      (forallb n.changing
        (app (effect_heads a.start_effect) (effect_heads a.end_effect))))
    (forallb (timed_instance_ok p events t0 n x case i a)
      (instances (extended p events x) (fun env ->
        static_false (extended p events x) n env a.at_start) a.parameters []))

(** val wait_ok :
    problem -> event list -> task -> names -> timeline -> (nat -> case_tree)
    -> nat -> event -> bool **)

let wait_ok p events t0 n x wait_case i v =
  tree_ok (extended p events x) t0 n (wait_leaf p events t0 n x i v)
    (with_invariants n { literals = (((phase x i), true) :: []); bounds =
      [] }) (wait_case i)

(** val is_sorted : event list -> bool **)

let rec is_sorted = function
| [] -> true
| v :: r -> (&&) (forallb (fun u -> less v.time u.time) r) (is_sorted r)

(** val differ : atom list -> bool **)

let rec differ = function
| [] -> true
| a :: r -> (&&) (negb (existsb (atom_eqb a) r)) (differ r)

(** val timed_faithful :
    problem -> event list -> task -> names -> timeline -> (nat -> key1 list
    -> passage -> case_tree) -> (nat -> case_tree) -> case_tree -> bool **)

let timed_faithful p events t0 n x case wait_case goal_case =
  (&&)
    ((&&)
      ((&&)
        ((&&)
          ((&&)
            ((&&)
              ((&&)
                ((&&)
                  ((&&)
                    ((&&)
                      ((&&)
                        ((&&)
                          ((&&)
                            (match p.strata with
                             | [] -> true
                             | _ :: _ -> false)
                            (qeq_bool p.per_step { qnum = Z0; qden = XH }))
                          (faithful (extended p events x) t0 n (fun _ _ ->
                            Decided None) goal_case)) (is_sorted events))
                      (forallb (fun v -> on_grid x v.time) events))
                    (forallb (fun l ->
                      (&&) (n.changing (fst (fst l)))
                        (negb (is_added x (fst (fst l)))))
                      (flat_map (fun e -> e.sets) events)))
                  (forallb n.changing
                    ((fst x.waited) :: ((fst x.clock) :: (map fst
                                                           x.phase_atoms)))))
                (differ (x.waited :: x.phase_atoms)))
              (Nat.eqb (length x.phase_atoms) (S (length events))))
            (forallb (fun a -> negb ((initial p).holds_in a))
              (x.waited :: x.phase_atoms))) (formula_free x p.goal_formula))
        (expression_free x p.metric))
      (forallb (fun iv ->
        wait_ok p events t0 n x wait_case (fst iv) (snd iv))
        (combine (seq O (length events)) events)))
    (forallb (fun ia ->
      timed_action_ok p events t0 n x case (fst ia) (snd ia))
      (combine (seq O (length p.actions)) p.actions))

(** val check_timed :
    problem -> event list -> task -> names -> timeline -> (nat -> key1 list
    -> passage -> case_tree) -> (nat -> case_tree) -> case_tree -> argument
    -> (state -> positive list) -> (q * (nat * key1 list)) list -> q option
    -> bool **)

let check_timed p events t0 n x case wait_case goal_case a oracle plan claim =
  (&&)
    ((&&) (check_task t0)
      (timed_faithful p events t0 n x case wait_case goal_case))
    (match eval (initial p) None [] p.metric with
     | Some first ->
       (match claim with
        | Some m ->
          (&&)
            ((&&) (is_linear (extended p events x) n)
              (match timed_execute p events false (initial p) { qnum = Z0;
                       qden = XH } { qnum = Z0; qden = XH } plan with
               | Some p0 ->
                 let (w, spent) = p0 in
                 (match final_metric p w spent with
                  | Some m' -> qeq_bool m' m
                  | None -> false)
               | None -> false))
            (let cost0 =
               qred
                 (qmult (qminus m first) { qnum = (Zpos n.cost_scale); qden =
                   XH })
             in
             (&&) (Coq_Pos.eqb cost0.qden XH)
               (check t0 a (Some cost0.qnum) oracle))
        | None -> check t0 a None oracle)
     | None ->
       (match claim with
        | Some _ -> false
        | None -> check t0 a None oracle))

type xsd_value =
| Text of z list
| Boolean of bool
| Numeric of q

type symbol =
| Name of key1
| Literal of xsd_value

(** val is_name : symbol -> bool **)

let is_name = function
| Name _ -> true
| Literal _ -> false

type data = key1 * symbol list

type datatype =
| AnyText
| AnyBoolean
| AnyNumber
| AnyInteger

type built_in =
| Less
| LessOrEqual
| Identical
| NotIdentical
| Different
| Outside of datatype

(** val symbol_eq_dec : symbol -> symbol -> bool **)

let symbol_eq_dec a b =
  match a with
  | Name n ->
    (match b with
     | Name n0 ->
       let rec f p x =
         match p with
         | XI p0 -> (match x with
                     | XI p1 -> f p0 p1
                     | _ -> false)
         | XO p0 -> (match x with
                     | XO p1 -> f p0 p1
                     | _ -> false)
         | XH -> (match x with
                  | XH -> true
                  | _ -> false)
       in f n n0
     | Literal _ -> false)
  | Literal x ->
    (match b with
     | Name _ -> false
     | Literal x0 ->
       (match x with
        | Text characters ->
          (match x0 with
           | Text characters0 ->
             let rec f l x1 =
               match l with
               | [] -> (match x1 with
                        | [] -> true
                        | _ :: _ -> false)
               | y :: l0 ->
                 (match x1 with
                  | [] -> false
                  | a0 :: l1 ->
                    if match y with
                       | Z0 -> (match a0 with
                                | Z0 -> true
                                | _ -> false)
                       | Zpos p ->
                         (match a0 with
                          | Zpos p0 ->
                            let rec f0 p1 x2 =
                              match p1 with
                              | XI p2 ->
                                (match x2 with
                                 | XI p3 -> f0 p2 p3
                                 | _ -> false)
                              | XO p2 ->
                                (match x2 with
                                 | XO p3 -> f0 p2 p3
                                 | _ -> false)
                              | XH -> (match x2 with
                                       | XH -> true
                                       | _ -> false)
                            in f0 p p0
                          | _ -> false)
                       | Zneg p ->
                         (match a0 with
                          | Zneg p0 ->
                            let rec f0 p1 x2 =
                              match p1 with
                              | XI p2 ->
                                (match x2 with
                                 | XI p3 -> f0 p2 p3
                                 | _ -> false)
                              | XO p2 ->
                                (match x2 with
                                 | XO p3 -> f0 p2 p3
                                 | _ -> false)
                              | XH -> (match x2 with
                                       | XH -> true
                                       | _ -> false)
                            in f0 p p0
                          | _ -> false)
                    then f l0 l1
                    else false)
             in f characters characters0
           | _ -> false)
        | Boolean b0 ->
          (match x0 with
           | Boolean b1 ->
             if b0
             then if b1 then true else false
             else if b1 then false else true
           | _ -> false)
        | Numeric q0 ->
          (match x0 with
           | Numeric q1 ->
             let { qnum = qnum0; qden = qden0 } = q0 in
             let { qnum = qnum1; qden = qden1 } = q1 in
             if match qnum0 with
                | Z0 -> (match qnum1 with
                         | Z0 -> true
                         | _ -> false)
                | Zpos p ->
                  (match qnum1 with
                   | Zpos p0 ->
                     let rec f p1 x1 =
                       match p1 with
                       | XI p2 ->
                         (match x1 with
                          | XI p3 -> f p2 p3
                          | _ -> false)
                       | XO p2 ->
                         (match x1 with
                          | XO p3 -> f p2 p3
                          | _ -> false)
                       | XH -> (match x1 with
                                | XH -> true
                                | _ -> false)
                     in f p p0
                   | _ -> false)
                | Zneg p ->
                  (match qnum1 with
                   | Zneg p0 ->
                     let rec f p1 x1 =
                       match p1 with
                       | XI p2 ->
                         (match x1 with
                          | XI p3 -> f p2 p3
                          | _ -> false)
                       | XO p2 ->
                         (match x1 with
                          | XO p3 -> f p2 p3
                          | _ -> false)
                       | XH -> (match x1 with
                                | XH -> true
                                | _ -> false)
                     in f p p0
                   | _ -> false)
             then let rec f p x1 =
                    match p with
                    | XI p0 -> (match x1 with
                                | XI p1 -> f p0 p1
                                | _ -> false)
                    | XO p0 -> (match x1 with
                                | XO p1 -> f p0 p1
                                | _ -> false)
                    | XH -> (match x1 with
                             | XH -> true
                             | _ -> false)
                  in f qden0 qden1
             else false
           | _ -> false)))

(** val symbol_eqb : symbol -> symbol -> bool **)

let symbol_eqb a b =
  if symbol_eq_dec a b then true else false

(** val compare_text : z list -> z list -> comparison **)

let rec compare_text s t0 =
  match s with
  | [] -> (match t0 with
           | [] -> Eq
           | _ :: _ -> Lt)
  | c :: s0 ->
    (match t0 with
     | [] -> Gt
     | d :: t1 -> (match Z.compare c d with
                   | Eq -> compare_text s0 t1
                   | x -> x))

(** val compare_values : xsd_value -> xsd_value -> comparison option **)

let compare_values x y =
  match x with
  | Text s -> (match y with
               | Text t0 -> Some (compare_text s t0)
               | _ -> None)
  | Boolean b ->
    (match y with
     | Boolean c ->
       Some (if b then if c then Eq else Gt else if c then Lt else Eq)
     | _ -> None)
  | Numeric p -> (match y with
                  | Numeric q0 -> Some (qcompare p q0)
                  | _ -> None)

(** val in_datatype : xsd_value -> datatype -> bool **)

let in_datatype x d =
  match x with
  | Text _ -> (match d with
               | AnyText -> true
               | _ -> false)
  | Boolean _ -> (match d with
                  | AnyBoolean -> true
                  | _ -> false)
  | Numeric q0 ->
    (match d with
     | AnyNumber -> true
     | AnyInteger -> Coq_Pos.eqb q0.qden XH
     | _ -> false)

(** val satisfies : built_in -> symbol -> symbol -> bool **)

let satisfies test a b =
  match test with
  | Less ->
    (match a with
     | Name _ -> false
     | Literal x ->
       (match b with
        | Name _ -> false
        | Literal y ->
          (match compare_values x y with
           | Some c -> (match c with
                        | Lt -> true
                        | _ -> false)
           | None -> false)))
  | LessOrEqual ->
    (match a with
     | Name _ -> false
     | Literal x ->
       (match b with
        | Name _ -> false
        | Literal y ->
          (match compare_values x y with
           | Some c -> (match c with
                        | Gt -> false
                        | _ -> true)
           | None -> false)))
  | Identical ->
    (match a with
     | Name _ -> false
     | Literal _ ->
       (match b with
        | Name _ -> false
        | Literal _ -> symbol_eqb a b))
  | NotIdentical ->
    (match a with
     | Name _ -> false
     | Literal _ ->
       (match b with
        | Name _ -> false
        | Literal _ -> negb (symbol_eqb a b)))
  | Different ->
    (match a with
     | Name _ ->
       (match b with
        | Name _ -> false
        | Literal _ -> negb (symbol_eqb a b))
     | Literal _ -> negb (symbol_eqb a b))
  | Outside d ->
    (match a with
     | Name _ -> true
     | Literal x -> negb (in_datatype x d))

type argument0 =
| RuleVariable of key1
| Symbol of symbol

type pattern0 = key1 * argument0 list

type conjunct =
| Present of pattern0
| Absent of pattern0
| Test of built_in * argument0 * argument0
| Count of nat * key1 list * pattern0 list

type conclusion =
| Concludes of pattern0
| Equates of argument0 * argument0

type implication = { premises : conjunct list; conclusions : conclusion list }

type knowledge_base = { stated : data list; implications : implication list;
                        same_as : key1 }

(** val arguments_eqb : symbol list -> symbol list -> bool **)

let arguments_eqb l m =
  if list_eq_dec symbol_eq_dec l m then true else false

(** val data_eqb : data -> data -> bool **)

let data_eqb f g =
  (&&) (Coq_Pos.eqb (fst f) (fst g)) (arguments_eqb (snd f) (snd g))

type index = symbol list list M.t

(** val rows : index -> key1 -> symbol list list **)

let rows i p =
  match M.find p i with
  | Some l -> l
  | None -> []

(** val insert : index -> data -> index **)

let insert i f =
  M.add (fst f) ((snd f) :: (rows i (fst f))) i

(** val index_of : data list -> index **)

let index_of facts0 =
  fold_left insert facts0 M.empty

(** val contains : index -> data -> bool **)

let contains i f =
  existsb (arguments_eqb (snd f)) (rows i (fst f))

type bindings = (key1 * symbol) list

(** val lookup : bindings -> key1 -> symbol option **)

let rec lookup e x =
  match e with
  | [] -> None
  | p :: e0 ->
    let (y, s) = p in if Coq_Pos.eqb x y then Some s else lookup e0 x

(** val known : bindings -> argument0 -> symbol option **)

let known e = function
| RuleVariable x -> lookup e x
| Symbol s -> Some s

(** val all_known : bindings -> argument0 list -> symbol list option **)

let rec all_known e = function
| [] -> Some []
| t0 :: ts0 ->
  (match known e t0 with
   | Some s ->
     (match all_known e ts0 with
      | Some l -> Some (s :: l)
      | None -> None)
   | None -> None)

(** val ground_pattern : bindings -> pattern0 -> data option **)

let ground_pattern e a =
  match all_known e (snd a) with
  | Some l -> Some ((fst a), l)
  | None -> None

(** val unify :
    bindings -> argument0 list -> symbol list -> bindings option **)

let rec unify e ts l =
  match ts with
  | [] -> (match l with
           | [] -> Some e
           | _ :: _ -> None)
  | t0 :: ts0 ->
    (match l with
     | [] -> None
     | s :: l0 ->
       (match known e t0 with
        | Some s' -> if symbol_eqb s' s then unify e ts0 l0 else None
        | None ->
          (match t0 with
           | RuleVariable x -> unify ((x, s) :: e) ts0 l0
           | Symbol _ -> None)))

(** val matches : index -> bindings -> pattern0 list -> bindings list **)

let rec matches i e = function
| [] -> e :: []
| a :: patterns0 ->
  flat_map (fun l ->
    match unify e (snd a) l with
    | Some e0 -> matches i e0 patterns0
    | None -> []) (rows i (fst a))

(** val positive_part : conjunct list -> pattern0 list **)

let positive_part body0 =
  flat_map (fun c -> match c with
                     | Present a -> a :: []
                     | _ -> []) body0

(** val variables_of : pattern0 -> key1 list **)

let variables_of a =
  flat_map (fun t0 ->
    match t0 with
    | RuleVariable x -> x :: []
    | Symbol _ -> []) (snd a)

(** val member : key1 -> key1 list -> bool **)

let member x l =
  existsb (Coq_Pos.eqb x) l

(** val distinct0 : key1 list -> bool **)

let rec distinct0 = function
| [] -> true
| x :: l0 -> (&&) (negb (member x l0)) (distinct0 l0)

(** val bound : bindings -> key1 -> bool **)

let bound e x =
  match lookup e x with
  | Some _ -> true
  | None -> false

(** val all_some : 'a1 option list -> 'a1 list option **)

let rec all_some = function
| [] -> Some []
| o :: l0 ->
  (match o with
   | Some x ->
     (match all_some l0 with
      | Some l1 -> Some (x :: l1)
      | None -> None)
   | None -> None)

(** val comparison_decided : built_in -> symbol -> symbol -> bool **)

let comparison_decided test a b =
  match test with
  | Different -> (||) (symbol_eqb a b) (negb ((&&) (is_name a) (is_name b)))
  | _ -> true

(** val count_decided : bindings -> key1 list -> pattern0 list -> bool **)

let count_decided e local inner =
  (&&) ((&&) (distinct0 local) (forallb (fun x -> negb (bound e x)) local))
    (forallb (fun a ->
      forallb (fun x -> (||) (member x local) (bound e x)) (variables_of a))
      inner)

(** val decide : index -> bindings -> conjunct -> bool option **)

let decide i e = function
| Present _ -> Some true
| Absent a -> option_map (fun f -> negb (contains i f)) (ground_pattern e a)
| Test (test, x, y) ->
  (match known e x with
   | Some a ->
     (match known e y with
      | Some b ->
        if comparison_decided test a b
        then Some (satisfies test a b)
        else None
      | None -> None)
   | None -> None)
| Count (n, local, inner) ->
  if count_decided e local inner
  then option_map (fun values ->
         Nat.eqb (length (nodup (list_eq_dec symbol_eq_dec) values)) n)
         (all_some
           (map (fun e0 ->
             all_known e0 (map (fun x -> RuleVariable x) local))
             (matches i e inner)))
  else None

(** val decide_all : index -> bindings -> conjunct list -> bool option **)

let rec decide_all i e = function
| [] -> Some true
| c :: body1 ->
  (match decide i e c with
   | Some b -> if b then decide_all i e body1 else Some false
   | None -> None)

(** val concluded : index -> bindings -> conclusion -> bool **)

let concluded i e = function
| Concludes a ->
  (match ground_pattern e a with
   | Some f -> contains i f
   | None -> false)
| Equates (x, y) ->
  (match known e x with
   | Some a -> (match known e y with
                | Some b -> symbol_eqb a b
                | None -> false)
   | None -> false)

(** val complete_for : index -> implication -> bool **)

let complete_for i r =
  forallb (fun e ->
    match decide_all i e r.premises with
    | Some b ->
      if b
      then (match r.conclusions with
            | [] -> false
            | c :: l -> forallb (concluded i e) (c :: l))
      else true
    | None -> false) (matches i [] (positive_part r.premises))

type reason =
| Stated
| Derived of key1 list

(** val unify_all :
    bindings -> pattern0 list -> data list -> bindings option **)

let rec unify_all e patterns facts0 =
  match patterns with
  | [] -> (match facts0 with
           | [] -> Some e
           | _ :: _ -> None)
  | a :: patterns0 ->
    (match facts0 with
     | [] -> None
     | f :: facts1 ->
       if Coq_Pos.eqb (fst a) (fst f)
       then (match unify e (snd a) (snd f) with
             | Some e0 -> unify_all e0 patterns0 facts1
             | None -> None)
       else None)

(** val concludes : bindings -> data -> conclusion -> bool **)

let concludes e f = function
| Concludes a ->
  (match ground_pattern e a with
   | Some g -> data_eqb f g
   | None -> false)
| Equates (_, _) -> false

(** val follows_by : index -> implication -> data list -> data -> bool **)

let follows_by i r supports f =
  match unify_all [] (positive_part r.premises) supports with
  | Some e ->
    (&&) (existsb (concludes e f) r.conclusions)
      (match decide_all i e r.premises with
       | Some b -> b
       | None -> false)
  | None -> false

(** val founded :
    knowledge_base -> index -> index -> data M.t -> key1 -> (data * reason)
    list -> bool **)

let rec founded k i stated_facts earlier next = function
| [] -> true
| p :: steps0 ->
  let (f, reason0) = p in
  (&&)
    (match reason0 with
     | Stated -> contains stated_facts f
     | Derived supports ->
       (match all_some (map (fun i0 -> M.find i0 earlier) supports) with
        | Some supports0 ->
          existsb (fun r -> follows_by i r supports0 f) k.implications
        | None -> false))
    (founded k i stated_facts (M.add next f earlier) (Coq_Pos.succ next)
      steps0)

(** val conclusion_level :
    knowledge_base -> (key1 -> nat) -> conclusion -> nat **)

let conclusion_level k level0 = function
| Concludes a -> level0 (fst a)
| Equates (_, _) -> level0 k.same_as

(** val above : (key1 -> nat) -> nat -> conjunct -> bool **)

let above level0 n = function
| Present a -> Nat.leb (level0 (fst a)) n
| Absent a -> Nat.ltb (level0 (fst a)) n
| Test (_, _, _) -> true
| Count (_, _, inner) -> forallb (fun a -> Nat.ltb (level0 (fst a)) n) inner

(** val stratified : knowledge_base -> (key1 -> nat) -> bool **)

let stratified k level0 =
  (&&) (Nat.eqb (level0 k.same_as) O)
    (forallb (fun r ->
      forallb (fun c ->
        forallb (above level0 (conclusion_level k level0 c)) r.premises)
        r.conclusions) k.implications)

(** val check_derivations :
    knowledge_base -> (key1 -> nat) -> (data * reason) list -> bool **)

let check_derivations k level0 steps =
  let i = index_of (map fst steps) in
  (&&)
    ((&&)
      ((&&)
        ((&&) (stratified k level0)
          (forallb (fun step0 ->
            negb (Coq_Pos.eqb (fst (fst step0)) k.same_as)) steps))
        (forallb (contains i) k.stated))
      (founded k i (index_of k.stated) M.empty XH steps))
    (forallb (complete_for i) k.implications)

(** val in_expression :
    (term -> term) -> (key1 -> expression option) -> expression -> expression **)

let rec in_expression t0 sum e = match e with
| Fluent (f, ts) ->
  (match ts with
   | [] -> (match sum f with
            | Some e0 -> e0
            | None -> e)
   | _ :: _ -> Fluent (f, (map t0 ts)))
| Plus (a, b) -> Plus ((in_expression t0 sum a), (in_expression t0 sum b))
| Minus (a, b) -> Minus ((in_expression t0 sum a), (in_expression t0 sum b))
| Times (a, b) -> Times ((in_expression t0 sum a), (in_expression t0 sum b))
| Over (a, b) -> Over ((in_expression t0 sum a), (in_expression t0 sum b))
| _ -> e

(** val in_formula :
    (term -> term) -> (key1 -> expression option) -> formula -> formula **)

let rec in_formula t0 sum f = match f with
| Truth _ -> f
| Atom (p, ts) -> Atom (p, (map t0 ts))
| Same (a, b) -> Same ((t0 a), (t0 b))
| Compare (strict, a, b) ->
  Compare (strict, (in_expression t0 sum a), (in_expression t0 sum b))
| Not g -> Not (in_formula t0 sum g)
| And (g, h) -> And ((in_formula t0 sum g), (in_formula t0 sum h))
| Forall (type0, g) -> Forall (type0, (in_formula t0 sum g))

(** val in_effect :
    (term -> term) -> (key1 -> expression option) -> effect -> effect **)

let rec in_effect t0 sum e = match e with
| Nothing -> e
| Put (b, p, ts) -> Put (b, p, (map t0 ts))
| Change (b, f, ts, x) -> Change (b, f, (map t0 ts), (in_expression t0 sum x))
| Both (a, b) -> Both ((in_effect t0 sum a), (in_effect t0 sum b))
| When (f, a) -> When ((in_formula t0 sum f), (in_effect t0 sum a))
| Each (type0, a) -> Each (type0, (in_effect t0 sum a))

type choice_of_designs = { requirement : key1; design_type : key1;
                           solves : key1; available : key1;
                           sums : (key1 * key1) list;
                           ruled_out : (formula * key1) list }

(** val with_designs : choice_of_designs -> key1 list -> action -> action **)

let with_designs c functions a =
  let n = length a.parameters in
  let k = length functions in
  let t0 = fun x ->
    match x with
    | Var i -> Var (if Nat.ltb i n then i else add i k)
    | Object o -> Object o
  in
  let designs =
    combine (map (fun x -> Var x) (seq n k))
      (map (fun x -> Object x) functions)
  in
  let sum = fun f ->
    match find (fun s -> Coq_Pos.eqb f (fst s)) c.sums with
    | Some p ->
      let (_, g) = p in
      Some
      (fold_right (fun x x0 -> Plus (x, x0)) (Constant { qnum = Z0; qden =
        XH })
        (map (fun d -> Fluent (g, ((fst d) :: ((snd d) :: [])))) designs))
    | None -> None
  in
  let all = fold_right (fun x x0 -> And (x, x0)) (Truth true) in
  let chosen =
    all (map (fun d -> Atom (c.solves, ((fst d) :: ((snd d) :: [])))) designs)
  in
  let lasting =
    all
      (map (fun d -> And ((Atom (c.available, ((fst d) :: []))),
        (all
          (map (fun r ->
            imply (fst r) (Not (Atom ((snd r), ((fst d) :: ((snd d) :: []))))))
            c.ruled_out)))) designs)
  in
  { parameters = (app a.parameters (repeat c.design_type k)); duration =
  (option_map (in_expression t0 sum) a.duration); at_start = (And
  ((in_formula t0 sum a.at_start), (And (chosen, lasting)))); start_effect =
  (in_effect t0 sum a.start_effect); over_all = (And
  ((in_formula t0 sum a.over_all), lasting)); at_end =
  (in_formula t0 sum a.at_end); end_effect = (in_effect t0 sum a.end_effect) }

type mission = { mission_knowledge : knowledge_base; files : problem;
                 schemas : (action * choice_of_designs option) list;
                 bound_symbols : key1 list; object_for : (key1 -> key1) }

(** val split_row : symbol list -> (key1 list * q option) option **)

let rec split_row = function
| [] -> Some ([], None)
| s :: l0 ->
  (match s with
   | Name n ->
     (match split_row l0 with
      | Some p -> let (names0, q0) = p in Some ((n :: names0), q0)
      | None -> None)
   | Literal x ->
     (match x with
      | Numeric q0 ->
        (match l0 with
         | [] -> Some ([], (Some q0))
         | _ :: _ -> None)
      | _ -> None))

(** val names_in : symbol list -> key1 list **)

let names_in l =
  flat_map (fun s -> match s with
                     | Name n -> n :: []
                     | Literal _ -> []) l

(** val atom_rows : mission -> index -> key1 -> key1 list list **)

let atom_rows w i p =
  flat_map (fun l ->
    match split_row l with
    | Some p0 ->
      let (names0, o) = p0 in
      (match o with
       | Some _ -> []
       | None -> (map w.object_for names0) :: [])
    | None -> []) (rows i p)

(** val value_rows : mission -> index -> key1 -> (key1 list * q) list **)

let value_rows w i p =
  flat_map (fun l ->
    match split_row l with
    | Some p0 ->
      let (names0, o) = p0 in
      (match o with
       | Some q0 -> ((map w.object_for names0), q0) :: []
       | None -> [])
    | None -> []) (rows i p)

(** val bound_atoms : mission -> index -> atom list **)

let bound_atoms w i =
  flat_map (fun p -> map (fun x -> (p, x)) (atom_rows w i p)) w.bound_symbols

(** val bound_values : mission -> index -> (atom * q) list **)

let bound_values w i =
  filter (fun v ->
    match find_atom w.files.initial_values (fst v) with
    | Some _ -> false
    | None -> true)
    (flat_map (fun p ->
      map (fun r -> ((p, (fst r)), (snd r))) (value_rows w i p))
      w.bound_symbols)

(** val filled_objects : mission -> index -> key1 -> key1 list **)

let filled_objects w i t0 =
  app (w.files.objects t0)
    (if member t0 w.bound_symbols
     then flat_map (fun l ->
            match l with
            | [] -> []
            | o :: l0 -> (match l0 with
                          | [] -> o :: []
                          | _ :: _ -> [])) (atom_rows w i t0)
     else [])

(** val filled_action :
    (action * choice_of_designs option) -> key1 list -> action **)

let filled_action schema functions =
  match snd schema with
  | Some c -> with_designs c functions (fst schema)
  | None -> fst schema

(** val filled_values : mission -> index -> q atom_map **)

let filled_values w i =
  fold_left (fun m v -> add_atom (fst v) (snd v) m) (bound_values w i)
    w.files.initial_values

(** val fill : mission -> index -> key1 list list -> problem **)

let fill w i orders =
  { objects = (filled_objects w i); actions =
    (map (fun s -> filled_action (fst s) (snd s)) (combine w.schemas orders));
    strata = w.files.strata; initial_atoms =
    (fold_left (fun m a -> add_atom a () m) (bound_atoms w i)
      w.files.initial_atoms); initial_values = (filled_values w i);
    goal_formula = w.files.goal_formula; metric = w.files.metric; per_time =
    w.files.per_time; per_step = w.files.per_step }

(** val required_objects :
    mission -> index -> choice_of_designs -> key1 list **)

let required_objects w i c =
  if member c.requirement w.bound_symbols
  then flat_map (fun l ->
         match l with
         | [] -> []
         | o :: l0 -> (match l0 with
                       | [] -> o :: []
                       | _ :: _ -> [])) (atom_rows w i c.requirement)
  else []

(** val order_accepted :
    mission -> index -> ((action * choice_of_designs option) * key1 list) ->
    bool **)

let order_accepted w i s =
  match snd (fst s) with
  | Some c ->
    (&&)
      ((&&) (distinct0 (snd s))
        (forallb (fun f -> member f (required_objects w i c)) (snd s)))
      (forallb (fun f -> member f (snd s)) (required_objects w i c))
  | None -> true

(** val exact_eqb : q -> q -> bool **)

let exact_eqb p q0 =
  (&&) (Z.eqb p.qnum q0.qnum) (Coq_Pos.eqb p.qden q0.qden)

(** val has_value0 : q atom_map -> (atom * q) -> bool **)

let has_value0 values v =
  match find_atom values (fst v) with
  | Some q0 -> exact_eqb q0 (snd v)
  | None -> false

(** val mentioned : mission -> index -> key1 list **)

let mentioned w i =
  flat_map (fun p -> flat_map names_in (rows i p)) w.bound_symbols

(** val named_apart : mission -> index -> bool **)

let named_apart w i =
  let names0 = nodup Coq_Pos.eq_dec (mentioned w i) in
  forallb (fun n ->
    forallb (fun m ->
      (||) (negb (Coq_Pos.eqb (w.object_for n) (w.object_for m)))
        (Coq_Pos.eqb n m)) names0) names0

(** val can_fill : mission -> index -> key1 list list -> bool **)

let can_fill w i orders =
  (&&)
    ((&&)
      ((&&) (named_apart w i)
        (let values = filled_values w i in
         forallb (has_value0 values) (bound_values w i)))
      (Nat.eqb (length orders) (length w.schemas)))
    (forallb (order_accepted w i) (combine w.schemas orders))

(** val check_filled :
    mission -> (key1 -> nat) -> (data * reason) list -> key1 list list ->
    (problem -> bool) -> bool **)

let check_filled w level0 steps orders check0 =
  let i = index_of (map fst steps) in
  (&&)
    ((&&) (check_derivations w.mission_knowledge level0 steps)
      (can_fill w i orders)) (check0 (fill w i orders))

(** val check_mission :
    mission -> (key1 -> nat) -> (data * reason) list -> key1 list list ->
    task -> names -> (nat -> key1 list -> case_tree) -> case_tree -> argument
    -> (state -> positive list) -> (nat * key1 list) list -> q option -> bool **)

let check_mission w level0 steps orders t0 n case goal_case a oracle plan claim =
  check_filled w level0 steps orders (fun p ->
    check_certificate p t0 n case goal_case a oracle plan claim)

(** val check_mission_front :
    mission -> (key1 -> nat) -> (data * reason) list -> key1 list list ->
    objective -> objective -> evidence list -> point list -> bool **)

let check_mission_front w level0 steps orders first second es points =
  check_filled w level0 steps orders (fun p ->
    check_front p first second es points)
