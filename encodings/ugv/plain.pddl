; The ground vehicle in plain PDDL: an action says nothing of functions and designs. That a move requires localization, and what its
; designs must keep in the dark and near obstacles, comes from the knowledge base (ontology/kb/ugv.ttl). `(battery_usage)` is
; what the designs use that are chosen for the action.
(define (domain ugv)
  (:requirements :typing :fluents :durative-actions :disjunctive-preconditions)
  (:types waypoint)
  (:predicates
    (robot_at ?wp - waypoint)
    (corridor ?from ?to - waypoint)
    (corridor_with_obstacles ?from ?to - waypoint)
    (dark_corridor ?from ?to - waypoint))
  (:functions
    (travel_time ?from ?to - waypoint)
    (battery_usage)                             ; percent for each move
    (battery)                                   ; percent
    (battery_used))                             ; percent, over the whole mission
  (:durative-action move
    :parameters (?from ?to - waypoint)
    :duration (= ?duration (travel_time ?from ?to))
    :condition (and
      (at start (robot_at ?from))
      (over all (or (corridor ?from ?to) (corridor_with_obstacles ?from ?to) (dark_corridor ?from ?to)))
      (at start (>= (battery) (battery_usage))))
    :effect (and
      (at start (not (robot_at ?from)))
      (at end (robot_at ?to))
      (at end (decrease (battery) (battery_usage)))
      (at end (increase (battery_used) (battery_usage))))))
