; The underwater vehicle in plain PDDL: which functions an action requires, and which designs there are, comes from the knowledge
; base (ontology/kb/uuv.ttl). `(time_per_unit)` and `(battery_usage)` are sums over the designs that are chosen for the action.
(define (domain uuv)
  (:requirements :typing :fluents :durative-actions :negative-preconditions)
  (:types pipeline)
  (:predicates
    (pipeline_found ?pl - pipeline)
    (pipeline_inspected ?pl - pipeline))
  (:functions
    (search_area ?pl - pipeline)            ; units of area
    (pipeline_length ?pl - pipeline)        ; units of length
    (dock_distance)                         ; units of length
    (time_per_unit)                         ; minutes
    (battery_usage)                         ; percent for each unit
    (battery)                               ; percent
    (battery_reserve))                      ; percent that must be left
  (:durative-action search_pipeline
    :parameters (?pl - pipeline)
    :duration (= ?duration (* (search_area ?pl) (time_per_unit)))
    :condition (and
      (at start (not (pipeline_found ?pl)))
      (at start (>= (battery) (+ (battery_reserve) (* (search_area ?pl) (battery_usage))))))
    :effect (and
      (at end (pipeline_found ?pl))
      (at end (decrease (battery) (* (search_area ?pl) (battery_usage))))))
  (:durative-action follow_pipeline
    :parameters (?pl - pipeline)
    :duration (= ?duration (* (pipeline_length ?pl) (time_per_unit)))
    :condition (and
      (at start (pipeline_found ?pl))
      (at start (not (pipeline_inspected ?pl)))
      (at start (>= (battery) (+ (battery_reserve) (* (pipeline_length ?pl) (battery_usage))))))
    :effect (and
      (at end (pipeline_inspected ?pl))
      (at end (decrease (battery) (* (pipeline_length ?pl) (battery_usage))))))
  (:durative-action recharge
    :parameters ()
    :duration (= ?duration (* (dock_distance) (time_per_unit)))
    :condition (at start (>= (battery) (+ (battery_reserve) (* (dock_distance) (battery_usage)))))
    :effect (at end (assign (battery) 100))))
