(define (domain patrol)
  (:requirements :typing :numeric-fluents)
  (:types
    place)
  (:predicates
    (at ?p - place)
    (road ?p ?q - place))
  (:functions
    (battery)
    (energy ?p ?q - place))
  (:action drive
    :parameters (?p ?q - place)
    :precondition (and (at ?p) (road ?p ?q) (>= (battery) (energy ?p ?q)))
    :effect (and (not (at ?p)) (at ?q) (decrease (battery) (energy ?p ?q)))))
