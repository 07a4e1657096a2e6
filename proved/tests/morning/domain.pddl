(define (domain lamps)
  (:requirements :adl :derived-predicates)
  (:types
    room)
  (:constants
    bedroom - room)
  (:predicates
    (corridor ?r ?s - room)
    (door ?r ?s - room)
    (lamp ?r - room)
    (on ?r - room)
    (open ?r ?s - room)
    (lit ?r - room)
    (dark ?r - room)
    (some-dark)
    (quiet)
    (slept ?r - room))
  (:derived (lit ?r - room)
    (or (on ?r) (exists (?s - room) (and (lit ?s) (or (corridor ?s ?r) (open ?s ?r) (open ?r ?s))))))
  (:derived (dark ?r - room) (not (lit ?r)))
  (:derived (some-dark) (exists (?r - room) (dark ?r)))
  (:derived (quiet) (and (some-dark) (not (on bedroom))))
  (:action switch-on
    :parameters (?r - room)
    :precondition (and (lamp ?r) (some-dark))
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
    :precondition (and (quiet) (exists (?r - room) (dark ?r)))
    :effect (forall (?r - room) (when (dark ?r) (slept ?r)))))
