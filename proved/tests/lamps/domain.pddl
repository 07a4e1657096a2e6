(define (domain lamps)
  (:requirements :adl :derived-predicates)
  (:types
    room)
  (:predicates
    (corridor ?r ?s - room)
    (door ?r ?s - room)
    (lamp ?r - room)
    (on ?r - room)
    (open ?r ?s - room)
    (lit ?r - room)
    (dark ?r - room)
    (slept ?r - room))
  (:derived (lit ?r - room)
    (or (on ?r) (exists (?s - room) (and (lit ?s) (or (corridor ?s ?r) (open ?s ?r) (open ?r ?s))))))
  (:derived (dark ?r - room) (not (lit ?r)))
  (:action switch-on
    :parameters (?r - room)
    :precondition (and (lamp ?r))
    :effect (on ?r))
  (:action switch-off
    :parameters (?r - room)
    :precondition (and (on ?r))
    :effect (not (on ?r)))
  (:action close
    :parameters (?r ?s - room)
    :precondition (and (door ?r ?s) (lit ?r))
    :effect (not (open ?r ?s)))
  (:action sleep
    :parameters ()
    :precondition (exists (?r - room) (dark ?r))
    :effect (forall (?r - room) (when (dark ?r) (slept ?r)))))
