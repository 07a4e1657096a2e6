; A robot looks after shelves; which designs its functions have comes from the knowledge base (scout.ttl). `(time_per_metre)`,
; `(energy_per_metre)` and `(time_per_picture)` are sums over the designs that are chosen for an action.
(define (domain scout)
  (:requirements :typing :fluents :durative-actions :negative-preconditions)
  (:types place - object shelf - place)
  (:predicates
    (robot_at ?p - place)
    (inspected ?s - shelf))
  (:functions
    (distance ?a ?b - place)                ; metres
    (time_per_metre)                        ; seconds
    (energy_per_metre)                      ; hundredths of a full battery
    (time_per_picture)                      ; seconds
    (battery)                               ; hundredths
    (battery_reserve))                      ; hundredths that must be left
  (:durative-action move
    :parameters (?a ?b - place)
    :duration (= ?duration (* (distance ?a ?b) (time_per_metre)))
    :condition (and
      (at start (robot_at ?a))
      (at start (>= (battery) (+ (battery_reserve) (* (distance ?a ?b) (energy_per_metre))))))
    :effect (and
      (at start (not (robot_at ?a)))
      (at end (robot_at ?b))
      (at end (decrease (battery) (* (distance ?a ?b) (energy_per_metre))))))
  (:durative-action inspect
    :parameters (?s - shelf)
    :duration (= ?duration (time_per_picture))
    :condition (and (at start (robot_at ?s)) (at start (not (inspected ?s))))
    :effect (at end (inspected ?s))))
