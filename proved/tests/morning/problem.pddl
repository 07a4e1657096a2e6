(define (problem morning)
  (:domain lamps)
  (:objects
    hall kitchen - room)
  (:init
    (corridor hall kitchen)
    (door kitchen bedroom)
    (open kitchen bedroom)
    (lamp hall)
    (on hall))
  (:goal (and (slept bedroom) (not (slept hall)) (lit bedroom))))
