(define (domain tides)
  (:requirements :adl :typing :durative-actions :numeric-fluents :timed-initial-literals)
  (:types
    place)
  (:constants
    harbour - place)
  (:predicates
    (at-place ?p - place)
    (channel ?p ?q - place)
    (open ?p ?q - place)
    (sampled ?p - place)
    (foggy)
    (warned))
  (:functions
    (distance ?p ?q - place)
    (fuel)
    (cost))
  (:durative-action sail
    :parameters (?p ?q - place)
    :duration (= ?duration (/ (distance ?p ?q) 2))
    :condition (and
      (at start (at-place ?p))
      (at start (channel ?p ?q))
      (at start (>= (fuel) (distance ?p ?q)))
      (over all (open ?p ?q)))
    :effect (and
      (at start (not (at-place ?p)))
      (at start (decrease (fuel) (distance ?p ?q)))
      (at end (at-place ?q))))
  (:durative-action sample
    :parameters (?p - place)
    :duration (= ?duration 1)
    :condition (and (at start (at-place ?p)) (over all (at-place ?p)) (at end (not (foggy))))
    :effect (and (at end (sampled ?p))))
  (:action refuel
    :parameters ()
    :precondition (at-place harbour)
    :effect (and (increase (fuel) 5) (increase (cost) 3) (when (foggy) (warned)))))
