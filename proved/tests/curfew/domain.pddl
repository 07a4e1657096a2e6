(define (domain curfew)
  (:requirements :adl :typing :durative-actions :timed-initial-literals)
  (:types
    room)
  (:predicates
    (in ?r - room)
    (door ?r ?s - room)
    (locked ?r - room)
    (light)
    (done ?r - room))
  (:durative-action walk
    :parameters (?r ?s - room)
    :duration (= ?duration 1.5)
    :condition (and (at start (in ?r)) (at start (door ?r ?s)) (at end (not (locked ?s))))
    :effect (and (at start (not (in ?r))) (at end (in ?s))))
  (:durative-action work
    :parameters (?r - room)
    :duration (= ?duration 3)
    :condition (and (over all (in ?r)) (over all (light)))
    :effect (and (at end (done ?r))))
  (:action lock-up
    :parameters ()
    :precondition (forall (?r - room) (done ?r))
    :effect (forall (?r - room) (when (in ?r) (locked ?r)))))
