(define (domain uuv)
  (:requirements :typing :fluents :durative-actions :negative-preconditions)
  (:types
    pipeline function functiondesign)
  (:constants
    f_follow_pipeline f_generate_search_path f_maintain_motion f_recharge - function)
  (:predicates
    (pipeline_found ?pl - pipeline)
    (pipeline_inspected ?pl - pipeline)
    (fd_solve_f ?fd - functiondesign ?f - function)
    (fd_available ?fd - functiondesign))
  (:functions
    (search_area ?pl - pipeline)
    (pipeline_length ?pl - pipeline)
    (dock_distance)
    (battery)
    (battery_reserve)
    (fd_battery_usage ?fd - functiondesign)
    (fd_time_per_unit ?fd - functiondesign))
  (:durative-action search_pipeline
    :parameters (?pl - pipeline ?fd1 ?fd2 - functiondesign)
    :duration (=
      ?duration
      (* (search_area ?pl) (+ (fd_time_per_unit ?fd1) (fd_time_per_unit ?fd2))))
    :condition (and
      (at start (not (pipeline_found ?pl)))
      (at start
        (>=
          (battery)
          (+
            (battery_reserve)
            (* (search_area ?pl) (+ (fd_battery_usage ?fd1) (fd_battery_usage ?fd2))))))
      (at start (fd_solve_f ?fd1 f_generate_search_path))
      (at start (fd_solve_f ?fd2 f_maintain_motion))
      (over all (fd_available ?fd1))
      (over all (fd_available ?fd2)))
    :effect (and
      (at end (pipeline_found ?pl))
      (at end
        (decrease
          (battery)
          (* (search_area ?pl) (+ (fd_battery_usage ?fd1) (fd_battery_usage ?fd2)))))))
  (:durative-action follow_pipeline
    :parameters (?pl - pipeline ?fd1 ?fd2 - functiondesign)
    :duration (=
      ?duration
      (* (pipeline_length ?pl) (+ (fd_time_per_unit ?fd1) (fd_time_per_unit ?fd2))))
    :condition (and
      (at start (pipeline_found ?pl))
      (at start (not (pipeline_inspected ?pl)))
      (at start
        (>=
          (battery)
          (+
            (battery_reserve)
            (* (pipeline_length ?pl) (+ (fd_battery_usage ?fd1) (fd_battery_usage ?fd2))))))
      (at start (fd_solve_f ?fd1 f_follow_pipeline))
      (at start (fd_solve_f ?fd2 f_maintain_motion))
      (over all (fd_available ?fd1))
      (over all (fd_available ?fd2)))
    :effect (and
      (at end (pipeline_inspected ?pl))
      (at end
        (decrease
          (battery)
          (* (pipeline_length ?pl) (+ (fd_battery_usage ?fd1) (fd_battery_usage ?fd2)))))))
  (:durative-action recharge
    :parameters (?fd1 ?fd2 - functiondesign)
    :duration (= ?duration (* (dock_distance) (+ (fd_time_per_unit ?fd1) (fd_time_per_unit ?fd2))))
    :condition (and
      (at start
        (>=
          (battery)
          (+
            (battery_reserve)
            (* (dock_distance) (+ (fd_battery_usage ?fd1) (fd_battery_usage ?fd2))))))
      (at start (fd_solve_f ?fd1 f_maintain_motion))
      (at start (fd_solve_f ?fd2 f_recharge))
      (over all (fd_available ?fd1))
      (over all (fd_available ?fd2)))
    :effect (and (at end (assign (battery) 100)))))
