(define (domain stuck)
  (:predicates
    (a)
    (b)
    (c))
  (:action go
    :parameters ()
    :precondition (and (a) (b))
    :effect (c))
  (:action on
    :parameters ()
    :precondition (not (a))
    :effect (and (a) (not (b)))))
