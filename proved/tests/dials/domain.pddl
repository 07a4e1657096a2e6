(define (domain dials)
  (:requirements :strips :typing :conditional-effects :universal-preconditions :action-costs)
  (:types
    pin)
  (:predicates
    (up ?p - pin)
    (next ?p ?q - pin))
  (:functions
    (total-cost))
  (:action turn
    :parameters ()
    :effect (and
      (increase (total-cost) 2)
      (forall (?p ?q - pin) (when (and (next ?p ?q) (up ?p)) (up ?q)))
      (forall (?p ?q - pin) (when (and (next ?p ?q) (not (up ?p))) (not (up ?q))))))
  (:action press
    :parameters (?p - pin)
    :effect (and (increase (total-cost) 3) (when (not (up ?p)) (up ?p)))))
