(define (domain fleet)
  (:requirements :typing :durative-actions)
  (:types robot place parcel)
  (:predicates
    (robot_at ?r - robot ?p - place)
    (way ?from ?to - place)
    (parcel_at ?x - parcel ?p - place)
    (carries ?r - robot ?x - parcel)
    (free ?r - robot))
  (:durative-action drive
    :parameters (?r - robot ?from ?to - place)
    :duration (= ?duration 10)
    :condition (and (at start (robot_at ?r ?from)) (over all (way ?from ?to)))
    :effect (and (at start (not (robot_at ?r ?from))) (at end (robot_at ?r ?to))))
  (:durative-action load
    :parameters (?r - robot ?x - parcel ?p - place)
    :duration (= ?duration 3)
    :condition (and (over all (robot_at ?r ?p)) (at start (parcel_at ?x ?p)) (at start (free ?r)))
    :effect (and (at start (not (parcel_at ?x ?p))) (at start (not (free ?r))) (at end (carries ?r ?x))))
  (:durative-action unload
    :parameters (?r - robot ?x - parcel ?p - place)
    :duration (= ?duration 3)
    :condition (and (over all (robot_at ?r ?p)) (at start (carries ?r ?x)))
    :effect (and (at start (not (carries ?r ?x))) (at end (parcel_at ?x ?p)) (at end (free ?r)))))
