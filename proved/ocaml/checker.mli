
val negb : bool -> bool

type nat =
| O
| S of nat

val option_map : ('a1 -> 'a2) -> 'a1 option -> 'a2 option

val fst : ('a1 * 'a2) -> 'a1

val snd : ('a1 * 'a2) -> 'a2

val length : 'a1 list -> nat

val app : 'a1 list -> 'a1 list -> 'a1 list

type comparison =
| Eq
| Lt
| Gt

val compOpp : comparison -> comparison

val add : nat -> nat -> nat

val sub : nat -> nat -> nat

type positive =
| XI of positive
| XO of positive
| XH

type z =
| Z0
| Zpos of positive
| Zneg of positive

val eqb : bool -> bool -> bool

module type EqLtLe =
 sig
  type t
 end

module MakeOrderTac :
 functor (O:EqLtLe) ->
 functor (P:sig
 end) ->
 sig
 end

module Nat :
 sig
  val eqb : nat -> nat -> bool

  val leb : nat -> nat -> bool

  val ltb : nat -> nat -> bool
 end

module Pos :
 sig
  type mask =
  | IsNul
  | IsPos of positive
  | IsNeg
 end

module Coq_Pos :
 sig
  val succ : positive -> positive

  val add : positive -> positive -> positive

  val add_carry : positive -> positive -> positive

  val pred_double : positive -> positive

  type mask = Pos.mask =
  | IsNul
  | IsPos of positive
  | IsNeg

  val succ_double_mask : mask -> mask

  val double_mask : mask -> mask

  val double_pred_mask : positive -> mask

  val sub_mask : positive -> positive -> mask

  val sub_mask_carry : positive -> positive -> mask

  val sub : positive -> positive -> positive

  val mul : positive -> positive -> positive

  val size_nat : positive -> nat

  val compare_cont : comparison -> positive -> positive -> comparison

  val compare : positive -> positive -> comparison

  val eqb : positive -> positive -> bool

  val ggcdn : nat -> positive -> positive -> positive * (positive * positive)

  val ggcd : positive -> positive -> positive * (positive * positive)

  val iter_op : ('a1 -> 'a1 -> 'a1) -> positive -> 'a1 -> 'a1

  val to_nat : positive -> nat

  val of_nat : nat -> positive

  val eq_dec : positive -> positive -> bool
 end

module Z :
 sig
  val double : z -> z

  val succ_double : z -> z

  val pred_double : z -> z

  val pos_sub : positive -> positive -> z

  val add : z -> z -> z

  val opp : z -> z

  val mul : z -> z -> z

  val compare : z -> z -> comparison

  val sgn : z -> z

  val leb : z -> z -> bool

  val ltb : z -> z -> bool

  val eqb : z -> z -> bool

  val min : z -> z -> z

  val abs : z -> z

  val to_nat : z -> nat

  val to_pos : z -> positive

  val ggcd : z -> z -> z * (z * z)

  val eq_dec : z -> z -> bool
 end

val zeq_bool : z -> z -> bool

val in_dec : ('a1 -> 'a1 -> bool) -> 'a1 -> 'a1 list -> bool

val nth : nat -> 'a1 list -> 'a1 -> 'a1

val nth_error : 'a1 list -> nat -> 'a1 option

val concat : 'a1 list list -> 'a1 list

val list_eq_dec : ('a1 -> 'a1 -> bool) -> 'a1 list -> 'a1 list -> bool

val map : ('a1 -> 'a2) -> 'a1 list -> 'a2 list

val flat_map : ('a1 -> 'a2 list) -> 'a1 list -> 'a2 list

val fold_left : ('a1 -> 'a2 -> 'a1) -> 'a2 list -> 'a1 -> 'a1

val fold_right : ('a2 -> 'a1 -> 'a1) -> 'a1 -> 'a2 list -> 'a1

val existsb : ('a1 -> bool) -> 'a1 list -> bool

val forallb : ('a1 -> bool) -> 'a1 list -> bool

val filter : ('a1 -> bool) -> 'a1 list -> 'a1 list

val find : ('a1 -> bool) -> 'a1 list -> 'a1 option

val combine : 'a1 list -> 'a2 list -> ('a1 * 'a2) list

val firstn : nat -> 'a1 list -> 'a1 list

val skipn : nat -> 'a1 list -> 'a1 list

val nodup : ('a1 -> 'a1 -> bool) -> 'a1 list -> 'a1 list

val seq : nat -> nat -> nat list

val repeat : 'a1 -> nat -> 'a1 list

type q = { qnum : z; qden : positive }

val inject_Z : z -> q

val qcompare : q -> q -> comparison

val qeq_bool : q -> q -> bool

val qle_bool : q -> q -> bool

val qplus : q -> q -> q

val qmult : q -> q -> q

val qopp : q -> q

val qminus : q -> q -> q

val qinv : q -> q

val qdiv : q -> q -> q

val qred : q -> q

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

module OrderedTypeFacts :
 functor (O:OrderedType) ->
 sig
  module TO :
   sig
    type t = O.t
   end

  module IsTO :
   sig
   end

  module OrderTac :
   sig
   end

  val eq_dec : O.t -> O.t -> bool

  val lt_dec : O.t -> O.t -> bool

  val eqb : O.t -> O.t -> bool
 end

module KeyOrderedType :
 functor (O:OrderedType) ->
 sig
  module MO :
   sig
    module TO :
     sig
      type t = O.t
     end

    module IsTO :
     sig
     end

    module OrderTac :
     sig
     end

    val eq_dec : O.t -> O.t -> bool

    val lt_dec : O.t -> O.t -> bool

    val eqb : O.t -> O.t -> bool
   end
 end

module PositiveOrderedTypeBits :
 sig
  type t = positive

  val compare : t -> t -> positive compare0

  val eq_dec : positive -> positive -> bool
 end

val append : positive -> positive -> positive

module PositiveMap :
 sig
  module E :
   sig
    type t = positive

    val compare : t -> t -> positive compare0

    val eq_dec : positive -> positive -> bool
   end

  module ME :
   sig
    module MO :
     sig
      module TO :
       sig
        type t = positive
       end

      module IsTO :
       sig
       end

      module OrderTac :
       sig
       end

      val eq_dec : positive -> positive -> bool

      val lt_dec : positive -> positive -> bool

      val eqb : positive -> positive -> bool
     end
   end

  type key = positive

  type 'a tree =
  | Leaf
  | Node of 'a tree * 'a option * 'a tree

  type 'a t = 'a tree

  val empty : 'a1 t

  val is_empty : 'a1 t -> bool

  val find : key -> 'a1 t -> 'a1 option

  val mem : key -> 'a1 t -> bool

  val add : key -> 'a1 -> 'a1 t -> 'a1 t

  val remove : key -> 'a1 t -> 'a1 t

  val xelements : 'a1 t -> key -> (key * 'a1) list

  val elements : 'a1 t -> (key * 'a1) list

  val cardinal : 'a1 t -> nat

  val xfind : key -> key -> 'a1 t -> 'a1 option

  val xmapi : (key -> 'a1 -> 'a2) -> 'a1 t -> key -> 'a2 t

  val mapi : (key -> 'a1 -> 'a2) -> 'a1 t -> 'a2 t

  val map : ('a1 -> 'a2) -> 'a1 t -> 'a2 t

  val xmap2_l : ('a1 option -> 'a2 option -> 'a3 option) -> 'a1 t -> 'a3 t

  val xmap2_r : ('a1 option -> 'a2 option -> 'a3 option) -> 'a2 t -> 'a3 t

  val _map2 :
    ('a1 option -> 'a2 option -> 'a3 option) -> 'a1 t -> 'a2 t -> 'a3 t

  val map2 :
    ('a1 option -> 'a2 option -> 'a3 option) -> 'a1 t -> 'a2 t -> 'a3 t

  val xfoldi : (key -> 'a1 -> 'a2 -> 'a2) -> 'a1 t -> 'a2 -> key -> 'a2

  val fold : (key -> 'a1 -> 'a2 -> 'a2) -> 'a1 t -> 'a2 -> 'a2

  val equal : ('a1 -> 'a1 -> bool) -> 'a1 t -> 'a1 t -> bool
 end

module M :
 sig
  module E :
   sig
    type t = positive

    val compare : t -> t -> positive compare0

    val eq_dec : positive -> positive -> bool
   end

  module ME :
   sig
    module MO :
     sig
      module TO :
       sig
        type t = positive
       end

      module IsTO :
       sig
       end

      module OrderTac :
       sig
       end

      val eq_dec : positive -> positive -> bool

      val lt_dec : positive -> positive -> bool

      val eqb : positive -> positive -> bool
     end
   end

  type key = positive

  type 'a tree = 'a PositiveMap.tree =
  | Leaf
  | Node of 'a tree * 'a option * 'a tree

  type 'a t = 'a tree

  val empty : 'a1 t

  val is_empty : 'a1 t -> bool

  val find : key -> 'a1 t -> 'a1 option

  val mem : key -> 'a1 t -> bool

  val add : key -> 'a1 -> 'a1 t -> 'a1 t

  val remove : key -> 'a1 t -> 'a1 t

  val xelements : 'a1 t -> key -> (key * 'a1) list

  val elements : 'a1 t -> (key * 'a1) list

  val cardinal : 'a1 t -> nat

  val xfind : key -> key -> 'a1 t -> 'a1 option

  val xmapi : (key -> 'a1 -> 'a2) -> 'a1 t -> key -> 'a2 t

  val mapi : (key -> 'a1 -> 'a2) -> 'a1 t -> 'a2 t

  val map : ('a1 -> 'a2) -> 'a1 t -> 'a2 t

  val xmap2_l : ('a1 option -> 'a2 option -> 'a3 option) -> 'a1 t -> 'a3 t

  val xmap2_r : ('a1 option -> 'a2 option -> 'a3 option) -> 'a2 t -> 'a3 t

  val _map2 :
    ('a1 option -> 'a2 option -> 'a3 option) -> 'a1 t -> 'a2 t -> 'a3 t

  val map2 :
    ('a1 option -> 'a2 option -> 'a3 option) -> 'a1 t -> 'a2 t -> 'a3 t

  val xfoldi : (key -> 'a1 -> 'a2 -> 'a2) -> 'a1 t -> 'a2 -> key -> 'a2

  val fold : (key -> 'a1 -> 'a2 -> 'a2) -> 'a1 t -> 'a2 -> 'a2

  val equal : ('a1 -> 'a1 -> bool) -> 'a1 t -> 'a1 t -> bool
 end

type key0 = positive

val get : z M.t -> key0 -> z

type state = { var_values : z M.t; num_values : z M.t }

val var_value : state -> key0 -> z

val num_value : state -> key0 -> z

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

val table_row : z list -> choice -> nat list -> z

val amount : quantity -> z list -> choice -> z

val value : linear -> state -> z list -> choice -> z

val is_fact : state -> fact -> bool

val is_literal : state -> literal -> bool

val holds_facts : condition -> state -> bool

val holds : condition -> state -> z list -> choice -> bool

val put_all : fact list -> z M.t -> z M.t

val basics : task -> key0 list

val reset_derived : task -> state -> state

val new_facts : (fact * condition) list -> state -> fact list

val evaluate_layer : nat -> (fact * condition) list -> state -> state

val derive : task -> state -> state

val fires : state -> (literal list * fact list) -> bool

val made_facts : operator -> state -> fact list

val apply : operator -> state -> choice -> state

type table = { pattern : key0 list; table_values : z option M.t }

type label = { label_state : state; path_cost : z }

type argument = { potentials : table list; needs : (key0 * table) list;
                  labels : label M.t }

val count_up : nat -> z -> z list

val range : z -> z list

val combinations : z list -> choice list

val equal_lists : z list -> z list -> bool

val admits : operator -> choice -> bool

val choices : operator -> choice list

val fact_value : key0 -> fact list -> z option

val matching : task -> key0 list -> fact list -> z list list

val last_put : fact list -> key0 -> z -> z

val pattern_after : key0 list -> z list -> fact list -> z list

val pattern_value : key0 list -> z list -> key0 -> z option

val pattern_truth : key0 list -> z list -> literal -> bool option

val mem_key : key0 -> key0 list -> bool

val same_values : z list -> z list -> bool

val reached_patterns :
  key0 list -> z list -> (literal list * fact list) list -> z list list -> z
  list list

val successor_patterns : key0 list -> operator -> z list -> z list list

val mentions : key0 list -> operator -> bool

val table_index : task -> key0 list -> z list -> z

val table_bound : task -> table -> z list -> z option

val at_most : z option -> z option -> z -> bool

val minimum : z list -> z option

type prepared = operator * (choice list * z option)

val prepare : operator -> prepared

val potential_ok_for : task -> table -> prepared -> bool

val is_basic : task -> key0 -> bool

val check_potential : task -> prepared list -> table -> bool

val is_number : linear -> key0 -> bool

val least_use : key0 -> prepared -> z option

val is_zero_bound : z option -> bool

val is_infinite : z option -> bool

val need_ok_for : task -> table -> key0 -> bool -> prepared -> bool

val check_need : task -> prepared list -> (key0 * table) -> bool

type choice_profile = choice * (z * z list)

val profile : operator -> choice -> z list

val fits : bool -> z list -> z list -> bool

val dominates : bool -> choice_profile -> choice_profile -> bool

val undominated_choices : bool -> operator -> choice list

val nonneg : linear -> bool

val is_monotone : task -> bool

val numbers_cover : bool -> z M.t -> z M.t -> key0 list -> bool

val potential_prunes : task -> z option -> state -> z -> table -> bool

val need_prunes : task -> state -> (key0 * table) -> bool

val label_covers : task -> bool -> key0 list -> state -> z -> label -> bool

val covered :
  task -> argument -> z option -> (state -> positive list) -> bool -> key0
  list -> state -> z -> bool

type front = operator * choice list

type fronts_by_fact = front list M.t M.t

val slot : z -> positive

val row : 'a1 M.t M.t -> key0 -> 'a1 M.t

val with_fact : fronts_by_fact -> fact -> front list

val add_front : fact -> front -> fronts_by_fact -> fronts_by_fact

val frequency : z M.t M.t -> fact -> z

val frequencies : fact list -> z M.t M.t

val rarest : z M.t M.t -> fact list -> fact option

val index_fronts : z M.t M.t -> front list -> front list * fronts_by_fact

val applicable :
  front list -> (key0 * front list M.t) list -> state -> front list

val check_label :
  task -> argument -> z option -> (state -> positive list) -> bool -> key0
  list -> (state -> front list) -> label -> bool

val in_range : task -> key0 -> z -> bool

val is_well_formed : task -> fact -> bool

val distinct : key0 list -> bool

val check_task : task -> bool

val condition_variables : condition -> key0 list

val check_layers : (fact * condition) list list -> bool * z M.t

val check : task -> argument -> z option -> (state -> positive list) -> bool

type key1 = positive

type atom = key1 * key1 list

val atom_eqb : atom -> atom -> bool

val assoc : atom -> (atom * 'a1) list -> 'a1 option

type 'x atom_map = (atom * 'x) list PositiveMap.t

val bucket : atom -> positive

val bucket_entries : 'a1 atom_map -> atom -> (atom * 'a1) list

val find_atom : 'a1 atom_map -> atom -> 'a1 option

val add_atom : atom -> 'a1 -> 'a1 atom_map -> 'a1 atom_map

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

val or0 : formula -> formula -> formula

val imply : formula -> formula -> formula

val exists : key1 -> formula -> formula

val equal0 : expression -> expression -> formula

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

val initial : problem -> world

val object_of : key1 list -> term -> key1 option

val ground : key1 list -> term list -> key1 list option

val lift : (q -> q -> q) -> q option -> q option -> q option

val eval : world -> q option -> key1 list -> expression -> q option

val less : q -> q -> bool

val and_kleene : bool option -> bool option -> bool option

val truth :
  problem -> world -> q option -> key1 list -> formula -> bool option

val is_derived : problem -> key1 -> bool

val with_facts : problem -> world -> unit atom_map -> world

val tuples : problem -> key1 list -> key1 list list

val rule_instances : problem -> rule list -> (atom * formula) list

val fires_in : problem -> world -> (atom * formula) -> bool

val new_atoms : problem -> world -> (atom * formula) list -> atom list

val evaluate_stratum :
  problem -> nat -> (atom * formula) list -> world -> unit atom_map -> unit
  atom_map

val derived_facts : problem -> world -> unit atom_map

val derived_world : problem -> world -> world

type change =
| Fact of atom * bool
| Number of atom * bool * q

val both : 'a1 list option -> 'a1 list option -> 'a1 list option

val changes :
  problem -> world -> q option -> key1 list -> effect -> change list option

val sets_atom : change list -> atom -> bool -> bool

val changes_of : atom -> change list -> (bool * q) list

val changed_value : q option -> (bool * q) list -> q option

val changed_fluents : change list -> atom list

val updates : world -> change list -> atom list -> (atom * q) list option

val happening :
  problem -> world -> q option -> key1 list -> formula -> effect -> world
  option

val step :
  problem -> bool -> world -> action -> key1 list -> (world * q) option

val execute :
  problem -> bool -> world -> q -> (nat * key1 list) list -> (world * q)
  option

val final_metric : problem -> world -> q -> q option

type form = (atom * q) list * q

val plus_term : atom -> q -> (atom * q) list -> (atom * q) list

val plus_form : form -> q -> form -> form

val constant : q -> form

val fluent : atom -> form

val default : q option -> q

val ev : world -> form -> q

type result =
| Undefined
| Unknown
| Is of form

val plus_result : result -> q -> result -> result

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

val mem0 : 'a1 atom_map -> atom -> bool

type knowledge = { literals : (atom * bool) list; bounds : (bool * form) list }

val in_variable : names -> knowledge -> key1 -> (z * bool) list

val in_group : atom -> atom list -> bool

val excluded_by : names -> knowledge -> atom -> bool

val possible : task -> names -> knowledge -> key1 -> z list

val known_fact :
  task -> names -> (key1 -> bool) -> knowledge -> key1 -> z -> bool option

val base_truth : problem -> task -> names -> knowledge -> atom -> bool option

type symbolic = { new_truths : (atom * bool) list;
                  new_values : (atom * form) list; stale : bool }

val unchanged : symbolic

val make_stale : symbolic -> symbolic

val is_stale : problem -> symbolic -> key1 -> bool

val symbolic_atom :
  problem -> task -> names -> knowledge -> symbolic -> atom -> bool option

val symbolic_value : problem -> names -> symbolic -> atom -> result

val symbolic_expression :
  problem -> names -> symbolic -> result -> key1 list -> expression -> result

val implied : knowledge -> bool -> form -> bool

val symbolic_comparison : knowledge -> bool -> result -> bool option

val all_kleene : ('a1 -> bool option) -> 'a1 list -> bool option

val symbolic_truth :
  problem -> task -> names -> knowledge -> symbolic -> result -> key1 list ->
  formula -> bool option

type symbolic_change =
| SFact of atom * bool
| SNumber of atom * bool * form

val symbolic_changes :
  problem -> task -> names -> knowledge -> symbolic -> result -> key1 list ->
  effect -> symbolic_change list option

val symbolic_changes_of : atom -> symbolic_change list -> (bool * form) list

val symbolic_new_value : result -> (bool * form) list -> form option

val symbolic_changed_fluents : symbolic_change list -> atom list

val symbolic_updates :
  problem -> names -> symbolic -> symbolic_change list -> atom list ->
  (atom * form) list option

val atoms_set_to : symbolic_change list -> bool -> (atom * bool) list

type outcome =
| Never
| Unclear
| After of symbolic * q

val needs_undefined :
  problem -> task -> names -> knowledge -> symbolic -> result -> key1 list ->
  effect -> bool

val symbolic_happening :
  problem -> task -> names -> knowledge -> symbolic -> result -> q -> key1
  list -> formula -> effect -> outcome

val projected :
  problem -> task -> names -> (atom -> bool) -> bool -> knowledge -> key1
  list -> effect -> symbolic_change list option

val atoms_of : problem -> key1 list -> formula -> atom list

val deciding_atoms :
  problem -> task -> names -> (atom -> bool) -> knowledge -> key1 list ->
  effect -> atom list

val possible_facts :
  problem -> task -> names -> knowledge -> key1 list -> effect ->
  (atom * bool) list option

val symbolic_duration : problem -> names -> action -> key1 list -> result

val symbolic_step :
  problem -> task -> names -> knowledge -> action -> key1 list -> outcome

val conjuncts :
  problem -> names -> symbolic -> result -> key1 list -> formula -> knowledge

val with_invariants : names -> knowledge -> knowledge

val join : knowledge -> knowledge -> knowledge

val gathered : problem -> task -> names -> action -> key1 list -> knowledge

val impossible : problem -> task -> names -> knowledge -> bool

val is_defined : problem -> key1 list -> formula -> bool

val is_rule_of : problem -> atom -> rule -> bool

val rules_of : problem -> atom -> rule list

val contradicts_rules : problem -> task -> names -> knowledge -> bool

val contradictory : problem -> task -> names -> knowledge -> bool

type continuation = knowledge -> bool

val expand :
  problem -> task -> names -> (atom -> bool -> continuation -> continuation)
  -> formula -> bool -> key1 list -> continuation -> knowledge -> bool

val is_unfolded : problem -> names -> atom -> bool

val is_head : key1 -> rule list -> bool

val level : rule list list -> key1 -> nat

val unfold :
  problem -> task -> names -> nat -> nat -> atom -> bool -> continuation ->
  knowledge -> bool

val definite :
  problem -> (atom -> bool option) -> key1 list -> formula -> bool option

val is_some : bool -> bool option -> bool

val look_up :
  problem -> task -> names -> nat -> nat -> knowledge -> atom -> bool option

val max_unfoldings : nat

val occurrences_ok : (key1 -> bool -> bool) -> bool -> formula -> bool

val is_allowed : rule list -> rule list list -> key1 -> bool -> bool

val is_stratified : rule list list -> bool

val scaled : names -> q

val factors_of : names -> (key1 * z) list -> form option

val form_of : names -> linear -> z list -> choice -> form option

val required : names -> knowledge -> form -> bool

val known_literal :
  task -> names -> (key1 -> bool) -> knowledge -> literal -> bool option

val is_true : bool option -> bool

val is_false : bool option -> bool

val known_condition :
  task -> names -> (key1 -> bool) -> knowledge -> condition -> z list ->
  choice -> bool

val known_effects :
  task -> names -> knowledge -> (literal list * fact list) list -> fact list
  option

val admitted_choice : operator -> choice -> bool

val value_ok :
  (atom * bool) list -> fact list -> key1 -> (z * atom) list -> z -> bool

val variable_ok :
  task -> names -> knowledge -> symbolic -> fact list -> key1 -> bool

val is_zero : form -> bool

val number_ok :
  names -> symbolic -> (operator * choice) option -> key1 -> bool

val growth : problem -> names -> symbolic -> q -> q option

val step_cost : (operator * choice) option -> z

val simulated :
  problem -> task -> names -> knowledge -> symbolic -> q ->
  (operator * choice) option -> bool

val form_after : symbolic -> form -> form

val stays_invariant : knowledge -> symbolic -> (bool * form) -> bool

val stays_exclusive :
  problem -> task -> names -> knowledge -> symbolic -> atom list -> bool

val with_value : knowledge -> (z * atom) list -> z -> knowledge

val known_effects_on :
  task -> names -> key1 -> knowledge -> (literal list * fact list) list ->
  fact list option

val split_on :
  problem -> task -> names -> atom list -> (knowledge -> bool) -> knowledge
  -> bool

val max_splits : nat

val truths_of : symbolic_change list -> (atom * bool) list

val projected_variable_ok :
  problem -> task -> names -> knowledge -> action -> key1 list ->
  (operator * choice) option -> key1 -> bool

val projected_ok :
  problem -> task -> names -> knowledge -> action -> key1 list ->
  (operator * choice) option -> bool

val leaf_ok :
  problem -> task -> names -> knowledge -> action -> key1 list ->
  (operator * choice) option -> bool

val tree_ok :
  problem -> task -> names -> (knowledge -> (nat * choice) option -> bool) ->
  knowledge -> case_tree -> bool

val instance_leaf :
  problem -> task -> names -> action -> key1 list -> knowledge ->
  (nat * choice) option -> bool

val goal_leaf :
  problem -> task -> names -> knowledge -> (nat * choice) option -> bool

val static_false : problem -> names -> key1 list -> formula -> bool

val instances :
  problem -> (key1 list -> bool) -> key1 list -> key1 list -> key1 list list

val pruned : problem -> names -> action -> key1 list -> bool

val effect_heads : effect -> key1 list

val action_ok :
  problem -> task -> names -> (nat -> key1 list -> case_tree) -> nat ->
  action -> bool

val all_entries : 'a1 atom_map -> (atom * 'a1) list

val ground_rules : task -> (z * condition) list M.t

val rule_leaf :
  problem -> task -> names -> (key1 -> bool) -> (z * condition) list M.t ->
  atom -> knowledge -> bool

val rule_ok :
  problem -> task -> names -> nat -> (z * condition) list M.t ->
  (atom * formula) -> bool

val strata_ok :
  problem -> task -> names -> nat -> (z * condition) list M.t -> rule list
  list -> bool

val ground_literals :
  problem -> names -> nat -> condition -> (atom * bool) list

val ground_rule_ok :
  problem -> task -> names -> z M.t -> (fact * condition) -> bool

val ground_rules_ok :
  problem -> task -> names -> (fact * condition) list list -> bool * z M.t

val rules_ok : problem -> task -> names -> bool

val faithful :
  problem -> task -> names -> (nat -> key1 list -> case_tree) -> case_tree ->
  bool

val is_linear : problem -> names -> bool

val check_certificate :
  problem -> task -> names -> (nat -> key1 list -> case_tree) -> case_tree ->
  argument -> (state -> positive list) -> (nat * key1 list) list -> q option
  -> bool

type objective = { objective_metric : expression; time_weight : q;
                   step_weight : q }

val with_objective : problem -> objective -> problem

val objective_value :
  problem -> bool -> objective -> (nat * key1 list) list -> q option

type evidence = { list_task : task; list_names : names;
                  list_case : (nat -> key1 list -> case_tree);
                  list_goal_case : case_tree; list_argument : argument;
                  list_oracle : (state -> positive list) }

val accepts : problem -> evidence -> (nat * key1 list) list -> q -> bool

val limited : problem -> bool -> expression -> q -> problem

val is_untimed : objective -> bool

val check_list :
  problem -> objective list -> evidence list -> (nat * key1 list) list -> q
  list -> bool

type point = { point_plan : (nat * key1 list) list; first_value : q;
               second_value : q }

val within : problem -> objective -> q option -> problem

val has_value : problem -> objective -> (nat * key1 list) list -> q -> bool

val check_points :
  problem -> objective -> objective -> q option -> evidence list -> point
  list -> bool

val check_front :
  problem -> objective -> objective -> evidence list -> point list -> bool

type event = { time : q; sets : (atom * bool) list }

val occur : world -> event -> world

val elapse : world -> event list -> world

val after_until : event list -> q -> q -> event list

val between : event list -> q -> q -> event list

val at_time : event list -> q -> event list

val atoms_read : problem -> key1 list -> formula -> atom list

val atoms_read_by_effect : problem -> key1 list -> effect -> atom list

val interferes :
  problem -> event list -> world -> q option -> key1 list -> formula ->
  effect -> q -> bool

val pass :
  problem -> world -> q option -> key1 list -> formula -> event list -> world
  option

val timed_step :
  problem -> event list -> bool -> world -> q -> q -> action -> key1 list ->
  (world * q) option

val timed_execute :
  problem -> event list -> bool -> world -> q -> q -> (q * (nat * key1 list))
  list -> (world * q) option

type timeline = { grid : positive; phase_atoms : atom list; waited : 
                  atom; clock : atom }

type passage = ((nat * nat) * nat) * nat

val is_present : 'a1 option -> bool

val on_grid : timeline -> q -> bool

val moment : timeline -> q

val phase : timeline -> nat -> atom

val up_to : event list -> q -> nat

val extended : problem -> event list -> timeline -> problem

val is_added : timeline -> key1 -> bool

val expression_free : timeline -> expression -> bool

val formula_free : timeline -> formula -> bool

val effect_free : timeline -> effect -> bool

val action_free : timeline -> action -> bool

val time_at : event list -> nat -> q list

val last_time : event list -> nat -> q list

val lower : event list -> passage -> q -> (q * bool) list

val upper : event list -> passage -> q -> (q * bool) list

val feasible : event list -> passage -> q -> bool

val passages : event list -> passage list

val put_sets : symbolic -> event -> symbolic

val slice : event list -> nat -> nat -> event list

val surely_interferes :
  problem -> event list -> task -> names -> timeline -> knowledge -> symbolic
  -> result -> key1 list -> formula -> effect -> event list -> bool

val symbolic_pass :
  problem -> event list -> task -> names -> timeline -> knowledge -> symbolic
  -> result -> key1 list -> formula -> event list -> symbolic option

val symbolic_timed_step :
  problem -> event list -> task -> names -> timeline -> knowledge -> action
  -> key1 list -> passage -> result -> q -> outcome

val new_clock : names -> timeline -> (operator * choice) option -> form option

val clock_ok : timeline -> form -> (q * bool) list -> q -> bool

val closes :
  problem -> event list -> task -> names -> timeline -> knowledge -> symbolic
  -> q -> (atom * bool) list -> (q * bool) list -> q -> (operator * choice)
  option -> bool

val with_operator :
  task -> ((operator * choice) option -> bool) -> (nat * choice) option ->
  bool

val timed_leaf :
  problem -> event list -> task -> names -> timeline -> action -> key1 list
  -> passage -> result -> q -> knowledge -> (nat * choice) option -> bool

val wait_leaf :
  problem -> event list -> task -> names -> timeline -> nat -> event ->
  knowledge -> (nat * choice) option -> bool

val start_knowledge :
  problem -> event list -> names -> timeline -> action -> key1 list ->
  passage -> result -> q -> knowledge

val fixed_duration :
  problem -> event list -> names -> timeline -> action -> key1 list ->
  (result * q) option option

val timed_instance_ok :
  problem -> event list -> task -> names -> timeline -> (nat -> key1 list ->
  passage -> case_tree) -> nat -> action -> key1 list -> bool

val timed_action_ok :
  problem -> event list -> task -> names -> timeline -> (nat -> key1 list ->
  passage -> case_tree) -> nat -> action -> bool

val wait_ok :
  problem -> event list -> task -> names -> timeline -> (nat -> case_tree) ->
  nat -> event -> bool

val is_sorted : event list -> bool

val differ : atom list -> bool

val timed_faithful :
  problem -> event list -> task -> names -> timeline -> (nat -> key1 list ->
  passage -> case_tree) -> (nat -> case_tree) -> case_tree -> bool

val check_timed :
  problem -> event list -> task -> names -> timeline -> (nat -> key1 list ->
  passage -> case_tree) -> (nat -> case_tree) -> case_tree -> argument ->
  (state -> positive list) -> (q * (nat * key1 list)) list -> q option -> bool

type xsd_value =
| Text of z list
| Boolean of bool
| Numeric of q

type symbol =
| Name of key1
| Literal of xsd_value

val is_name : symbol -> bool

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

val symbol_eq_dec : symbol -> symbol -> bool

val symbol_eqb : symbol -> symbol -> bool

val compare_text : z list -> z list -> comparison

val compare_values : xsd_value -> xsd_value -> comparison option

val in_datatype : xsd_value -> datatype -> bool

val satisfies : built_in -> symbol -> symbol -> bool

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

val arguments_eqb : symbol list -> symbol list -> bool

val data_eqb : data -> data -> bool

type index = symbol list list M.t

val rows : index -> key1 -> symbol list list

val insert : index -> data -> index

val index_of : data list -> index

val contains : index -> data -> bool

type bindings = (key1 * symbol) list

val lookup : bindings -> key1 -> symbol option

val known : bindings -> argument0 -> symbol option

val all_known : bindings -> argument0 list -> symbol list option

val ground_pattern : bindings -> pattern0 -> data option

val unify : bindings -> argument0 list -> symbol list -> bindings option

val matches : index -> bindings -> pattern0 list -> bindings list

val positive_part : conjunct list -> pattern0 list

val variables_of : pattern0 -> key1 list

val member : key1 -> key1 list -> bool

val distinct0 : key1 list -> bool

val bound : bindings -> key1 -> bool

val all_some : 'a1 option list -> 'a1 list option

val comparison_decided : built_in -> symbol -> symbol -> bool

val count_decided : bindings -> key1 list -> pattern0 list -> bool

val decide : index -> bindings -> conjunct -> bool option

val decide_all : index -> bindings -> conjunct list -> bool option

val concluded : index -> bindings -> conclusion -> bool

val complete_for : index -> implication -> bool

type reason =
| Stated
| Derived of key1 list

val unify_all : bindings -> pattern0 list -> data list -> bindings option

val concludes : bindings -> data -> conclusion -> bool

val follows_by : index -> implication -> data list -> data -> bool

val founded :
  knowledge_base -> index -> index -> data M.t -> key1 -> (data * reason)
  list -> bool

val conclusion_level : knowledge_base -> (key1 -> nat) -> conclusion -> nat

val above : (key1 -> nat) -> nat -> conjunct -> bool

val stratified : knowledge_base -> (key1 -> nat) -> bool

val check_derivations :
  knowledge_base -> (key1 -> nat) -> (data * reason) list -> bool

val in_expression :
  (term -> term) -> (key1 -> expression option) -> expression -> expression

val in_formula :
  (term -> term) -> (key1 -> expression option) -> formula -> formula

val in_effect :
  (term -> term) -> (key1 -> expression option) -> effect -> effect

type choice_of_designs = { requirement : key1; design_type : key1;
                           solves : key1; available : key1;
                           sums : (key1 * key1) list;
                           ruled_out : (formula * key1) list }

val with_designs : choice_of_designs -> key1 list -> action -> action

type mission = { mission_knowledge : knowledge_base; files : problem;
                 schemas : (action * choice_of_designs option) list;
                 bound_symbols : key1 list; object_for : (key1 -> key1) }

val split_row : symbol list -> (key1 list * q option) option

val names_in : symbol list -> key1 list

val atom_rows : mission -> index -> key1 -> key1 list list

val value_rows : mission -> index -> key1 -> (key1 list * q) list

val bound_atoms : mission -> index -> atom list

val bound_values : mission -> index -> (atom * q) list

val filled_objects : mission -> index -> key1 -> key1 list

val filled_action : (action * choice_of_designs option) -> key1 list -> action

val filled_values : mission -> index -> q atom_map

val fill : mission -> index -> key1 list list -> problem

val required_objects : mission -> index -> choice_of_designs -> key1 list

val order_accepted :
  mission -> index -> ((action * choice_of_designs option) * key1 list) ->
  bool

val exact_eqb : q -> q -> bool

val has_value0 : q atom_map -> (atom * q) -> bool

val mentioned : mission -> index -> key1 list

val named_apart : mission -> index -> bool

val can_fill : mission -> index -> key1 list list -> bool

val check_filled :
  mission -> (key1 -> nat) -> (data * reason) list -> key1 list list ->
  (problem -> bool) -> bool

val check_mission :
  mission -> (key1 -> nat) -> (data * reason) list -> key1 list list -> task
  -> names -> (nat -> key1 list -> case_tree) -> case_tree -> argument ->
  (state -> positive list) -> (nat * key1 list) list -> q option -> bool

val check_mission_front :
  mission -> (key1 -> nat) -> (data * reason) list -> key1 list list ->
  objective -> objective -> evidence list -> point list -> bool
