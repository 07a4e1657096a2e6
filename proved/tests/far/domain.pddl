(define (domain uuv)
  (:requirements :typing :fluents :durative-actions :negative-preconditions)
  (:types
    pipeline action function functiondesign)
  (:constants
    a_search_pipeline a_follow_pipeline a_recharge - action)
  (:predicates
    (pipeline_found ?pl - pipeline)
    (pipeline_inspected ?pl - pipeline)
    (a_req_f ?a - action ?f1 ?f2 - function)
    (fd_solve_f ?fd - functiondesign ?f - function)
    (fd_available ?fd - functiondesign))
  (:functions
    (search_area ?pl - pipeline)
    (pipeline_length ?pl - pipeline)
    (dock_distance)
    (time_per_unit ?fd - functiondesign)
    (battery_usage ?fd - functiondesign)
    (battery)
    (battery_reserve))
  (:durative-action search_pipeline
    :parameters (?f1 ?f2 - function ?fd1 ?fd2 - functiondesign ?pl - pipeline)
    :duration (= ?duration (* (search_area ?pl) (+ (time_per_unit ?fd1) (time_per_unit ?fd2))))
    :condition (and
      (at start (a_req_f a_search_pipeline ?f1 ?f2))
      (at start (fd_solve_f ?fd1 ?f1))
      (at start (fd_solve_f ?fd2 ?f2))
      (over all (fd_available ?fd1))
      (over all (fd_available ?fd2))
      (at start (not (pipeline_found ?pl)))
      (at start
        (>=
          (battery)
          (+ (battery_reserve) (* (search_area ?pl) (+ (battery_usage ?fd1) (battery_usage ?fd2)))))))
    :effect (and
      (at end (pipeline_found ?pl))
      (at end
        (decrease (battery) (* (search_area ?pl) (+ (battery_usage ?fd1) (battery_usage ?fd2)))))))
  (:durative-action follow_pipeline
    :parameters (?f1 ?f2 - function ?fd1 ?fd2 - functiondesign ?pl - pipeline)
    :duration (= ?duration (* (pipeline_length ?pl) (+ (time_per_unit ?fd1) (time_per_unit ?fd2))))
    :condition (and
      (at start (a_req_f a_follow_pipeline ?f1 ?f2))
      (at start (fd_solve_f ?fd1 ?f1))
      (at start (fd_solve_f ?fd2 ?f2))
      (over all (fd_available ?fd1))
      (over all (fd_available ?fd2))
      (at start (pipeline_found ?pl))
      (at start (not (pipeline_inspected ?pl)))
      (at start
        (>=
          (battery)
          (+
            (battery_reserve)
            (* (pipeline_length ?pl) (+ (battery_usage ?fd1) (battery_usage ?fd2)))))))
    :effect (and
      (at end (pipeline_inspected ?pl))
      (at end
        (decrease (battery) (* (pipeline_length ?pl) (+ (battery_usage ?fd1) (battery_usage ?fd2)))))))
  (:durative-action recharge
    :parameters (?f1 ?f2 - function ?fd1 ?fd2 - functiondesign)
    :duration (= ?duration (* (dock_distance) (+ (time_per_unit ?fd1) (time_per_unit ?fd2))))
    :condition (and
      (at start (a_req_f a_recharge ?f1 ?f2))
      (at start (fd_solve_f ?fd1 ?f1))
      (at start (fd_solve_f ?fd2 ?f2))
      (over all (fd_available ?fd1))
      (over all (fd_available ?fd2))
      (at start
        (>=
          (battery)
          (+ (battery_reserve) (* (dock_distance) (+ (battery_usage ?fd1) (battery_usage ?fd2)))))))
    :effect (and (at end (assign (battery) 100)))))
