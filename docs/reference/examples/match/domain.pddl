(define (domain match)
  (:requirements :durative-actions :typing)
  (:types match fuse)
  (:predicates (light) (handfree) (unused ?m - match) (mended ?f - fuse))
  (:durative-action light
    :parameters (?m - match)
    :duration (= ?duration 5)
    :condition (and (at start (unused ?m)) (over all (light)))
    :effect (and (at start (not (unused ?m))) (at start (light)) (at end (not (light)))))
  (:durative-action mend
    :parameters (?f - fuse)
    :duration (= ?duration 2)
    :condition (and (at start (handfree)) (over all (light)))
    :effect (and (at start (not (handfree))) (at end (mended ?f)) (at end (handfree)))))
