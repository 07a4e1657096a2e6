(define (domain courier)
  (:requirements :typing :numeric-fluents)
  (:types
    place)
  (:predicates
    (at ?p - place)
    (road ?p ?q - place)
    (alley ?p ?q - place))
  (:functions
    (cost)
    (risk)
    (length ?p ?q - place)
    (shortcut ?p ?q - place)
    (danger ?p ?q - place))
  (:action drive
    :parameters (?p ?q - place)
    :precondition (and (at ?p) (road ?p ?q))
    :effect (and (not (at ?p)) (at ?q) (increase (cost) (length ?p ?q))))
  (:action sneak
    :parameters (?p ?q - place)
    :precondition (and (at ?p) (alley ?p ?q))
    :effect (and
      (not (at ?p))
      (at ?q)
      (increase (cost) (shortcut ?p ?q))
      (increase (risk) (danger ?p ?q)))))
