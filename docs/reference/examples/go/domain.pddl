(define (domain go)
  (:requirements :typing)
  (:types place)
  (:predicates (at ?p - place) (way ?a ?b - place))
  (:action go
    :parameters (?a ?b - place)
    :precondition (and (at ?a) (way ?a ?b))
    :effect (and (not (at ?a)) (at ?b))))
