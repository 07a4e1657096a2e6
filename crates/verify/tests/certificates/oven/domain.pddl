(define (domain oven)
  (:requirements :durative-actions :timed-initial-literals :negative-preconditions)
  (:predicates
    (hot)
    (power)
    (baked))
  (:durative-action heat
    :parameters ()
    :duration (= ?duration 2.5)
    :condition (and (at start (power)) (at start (not (hot))))
    :effect (and (at end (hot))))
  (:durative-action bake
    :parameters ()
    :duration (= ?duration 1)
    :condition (and (over all (power)) (at start (hot)))
    :effect (and (at start (not (hot))) (at end (baked)))))
