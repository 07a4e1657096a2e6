(define (domain doors)
  (:requirements :adl :derived-predicates)
  (:predicates
    (at ?r)
    (door ?r ?s)
    (open ?r ?s)
    (reach ?r)
    (lit ?r)
    (done))
  (:derived (reach ?r) (or (at ?r) (exists (?s) (and (reach ?s) (or (open ?s ?r) (open ?r ?s))))))
  (:action unlock
    :parameters (?r ?s)
    :precondition (and (door ?r ?s) (reach ?r) (not (open ?r ?s)))
    :effect (and (open ?r ?s) (when (not (lit ?s)) (lit ?s))))
  (:action end
    :parameters (?r)
    :precondition (and (reach ?r) (lit ?r))
    :effect (done)))
