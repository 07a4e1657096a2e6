; SUAVE's missions: to search for a pipeline, to inspect it, and to recharge before the battery is down. Every action requires two
; functions and runs with one design of each; which designs are available comes from the knowledge base (suave.ttl).
(define (domain suave)
  (:requirements :typing :fluents :durative-actions :negative-preconditions)
  (:types pipeline action function functiondesign)
  (:constants a_search_pipeline a_inspect_pipeline a_recharge - action)
  (:predicates
    (pipeline_found ?pl - pipeline)
    (pipeline_inspected ?pl - pipeline)
    (a_req_f ?a - action ?f1 ?f2 - function)
    (fd_solve_f ?fd - functiondesign ?f - function)
    (fd_available ?fd - functiondesign))
  (:functions
    (work ?a - action)                      ; units
    (time_per_unit ?fd - functiondesign)    ; seconds
    (battery_level)                         ; from 0 to 1
    (battery_limit))                        ; at or below, nothing is done but to recharge
  (:durative-action search_pipeline
    :parameters (?f1 ?f2 - function ?fd1 ?fd2 - functiondesign ?pl - pipeline)
    :duration (= ?duration (* (work a_search_pipeline) (+ (time_per_unit ?fd1) (time_per_unit ?fd2))))
    :condition (and
      (at start (a_req_f a_search_pipeline ?f1 ?f2))
      (at start (fd_solve_f ?fd1 ?f1))
      (at start (fd_solve_f ?fd2 ?f2))
      (over all (fd_available ?fd1))
      (over all (fd_available ?fd2))
      (at start (not (pipeline_found ?pl)))
      (over all (> (battery_level) (battery_limit))))
    :effect (at end (pipeline_found ?pl)))
  (:durative-action inspect_pipeline
    :parameters (?f1 ?f2 - function ?fd1 ?fd2 - functiondesign ?pl - pipeline)
    :duration (= ?duration (* (work a_inspect_pipeline) (+ (time_per_unit ?fd1) (time_per_unit ?fd2))))
    :condition (and
      (at start (a_req_f a_inspect_pipeline ?f1 ?f2))
      (at start (fd_solve_f ?fd1 ?f1))
      (at start (fd_solve_f ?fd2 ?f2))
      (over all (fd_available ?fd1))
      (over all (fd_available ?fd2))
      (at start (pipeline_found ?pl))
      (at start (not (pipeline_inspected ?pl)))
      (over all (> (battery_level) (battery_limit))))
    :effect (at end (pipeline_inspected ?pl)))
  (:durative-action recharge
    :parameters (?f1 ?f2 - function ?fd1 ?fd2 - functiondesign)
    :duration (= ?duration (* (work a_recharge) (+ (time_per_unit ?fd1) (time_per_unit ?fd2))))
    :condition (and
      (at start (a_req_f a_recharge ?f1 ?f2))
      (at start (fd_solve_f ?fd1 ?f1))
      (at start (fd_solve_f ?fd2 ?f2))
      (over all (fd_available ?fd1))
      (over all (fd_available ?fd2)))
    :effect (at end (assign (battery_level) 1))))
