(define (domain greenhouse)
  (:requirements :typing :durative-actions :numeric-fluents)
  (:types place)
  (:predicates
    (robot_at ?p - place)
    (path ?from ?to - place)
    (tap_at ?p - place)
    (bed ?p - place)
    (watered ?p - place))
  (:functions
    (metres ?from ?to - place)
    (charge)
    (tank)
    (seconds_per_metre)
    (charge_per_metre)
    (seconds_per_bed))
  (:durative-action go
    :parameters (?from ?to - place)
    :duration (= ?duration (* (metres ?from ?to) (seconds_per_metre)))
    :condition (and
      (at start (robot_at ?from))
      (over all (path ?from ?to))
      (at start (>= (charge) (* (metres ?from ?to) (charge_per_metre)))))
    :effect (and
      (at start (not (robot_at ?from)))
      (at end (robot_at ?to))
      (at end (decrease (charge) (* (metres ?from ?to) (charge_per_metre))))))
  (:durative-action water
    :parameters (?p - place)
    :duration (= ?duration (seconds_per_bed))
    :condition (and (over all (robot_at ?p)) (over all (bed ?p)) (at start (>= (tank) 1)))
    :effect (and (at end (watered ?p)) (at end (decrease (tank) 1))))
  (:durative-action fill
    :parameters (?p - place)
    :duration (= ?duration 15)
    :condition (and (over all (robot_at ?p)) (over all (tap_at ?p)))
    :effect (and (at end (assign (tank) 1))))
  (:durative-action recharge
    :parameters (?p - place)
    :duration (= ?duration 30)
    :condition (and (over all (robot_at ?p)) (over all (tap_at ?p)))
    :effect (and (at end (assign (charge) 40)))))
