; A robot with an arm in a warehouse. Distances are in metres, times in seconds, energy in percent of a full battery.
;
; The domain is plain PDDL: it does not mention functions, designs or components. That `move` needs navigation and `pick`
; needs a grasp is in the knowledge base (robot.ttl), and so is what each design costs. The functions
; `time_per_metre`, `energy_per_metre`, `grasp_time` and `grasp_energy` have the names of quality attributes there: in an
; action they stand for the designs that are chosen for this action.
(define (domain warehouse)
  (:requirements :typing :fluents :durative-actions :disjunctive-preconditions)
  (:types place item)
  (:predicates
    (robot_at ?place - place)
    (lit_aisle ?from ?to - place)
    (dark_aisle ?from ?to - place)      ; a context in the knowledge base
    (charger_at ?place - place)
    (item_at ?item - item ?place - place)
    (fragile ?item - item)              ; a context in the knowledge base
    (carries ?item - item)
    (hand_is_free))
  (:functions
    (distance ?from ?to - place)        ; metres
    (battery)                           ; percent
    (time_per_metre)                    ; seconds, of the chosen design
    (energy_per_metre)                  ; percent, of the chosen design
    (grasp_time)                        ; seconds, of the chosen design
    (grasp_energy))                     ; percent, of the chosen design

  (:durative-action move
    :parameters (?from ?to - place)
    :duration (= ?duration (* (distance ?from ?to) (time_per_metre)))
    :condition (and
      (at start (robot_at ?from))
      (over all (or (lit_aisle ?from ?to) (dark_aisle ?from ?to)))
      (at start (>= (battery) (* (distance ?from ?to) (energy_per_metre)))))
    :effect (and
      (at start (not (robot_at ?from)))
      (at end (robot_at ?to))
      (at end (decrease (battery) (* (distance ?from ?to) (energy_per_metre))))))

  (:durative-action pick
    :parameters (?item - item ?place - place)
    :duration (= ?duration (grasp_time))
    :condition (and
      (over all (robot_at ?place))
      (at start (item_at ?item ?place))
      (at start (hand_is_free))
      (at start (>= (battery) (grasp_energy))))
    :effect (and
      (at start (not (item_at ?item ?place)))
      (at start (not (hand_is_free)))
      (at end (carries ?item))
      (at end (decrease (battery) (grasp_energy)))))

  (:durative-action put
    :parameters (?item - item ?place - place)
    :duration (= ?duration 3)
    :condition (and
      (over all (robot_at ?place))
      (at start (carries ?item)))
    :effect (and
      (at start (not (carries ?item)))
      (at end (item_at ?item ?place))
      (at end (hand_is_free))))

  ; The arm is folded while the robot charges.
  (:durative-action charge
    :parameters (?place - place)
    :duration (= ?duration 60)
    :condition (and
      (over all (robot_at ?place))
      (over all (charger_at ?place))
      (over all (hand_is_free)))
    :effect (at end (assign (battery) 100))))
