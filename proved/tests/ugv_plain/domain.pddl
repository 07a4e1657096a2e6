(define (domain ugv)
  (:requirements :typing :fluents :durative-actions :disjunctive-preconditions)
  (:types
    waypoint function functiondesign)
  (:constants
    f_localization - function)
  (:predicates
    (robot_at ?wp - waypoint)
    (corridor ?from ?to - waypoint)
    (corridor_with_obstacles ?from ?to - waypoint)
    (dark_corridor ?from ?to - waypoint)
    (fd_solve_f ?fd - functiondesign ?f - function)
    (fd_available ?fd - functiondesign)
    (fd_meets_safe_near_obstacles ?fd - functiondesign)
    (fd_meets_sees_in_the_dark ?fd - functiondesign))
  (:functions
    (travel_time ?from ?to - waypoint)
    (battery)
    (battery_used)
    (fd_battery_usage ?fd - functiondesign))
  (:durative-action move
    :parameters (?from ?to - waypoint ?fd1 - functiondesign)
    :duration (= ?duration (travel_time ?from ?to))
    :condition (and
      (at start (robot_at ?from))
      (over all
        (or (corridor ?from ?to) (corridor_with_obstacles ?from ?to) (dark_corridor ?from ?to)))
      (at start (>= (battery) (fd_battery_usage ?fd1)))
      (at start (fd_solve_f ?fd1 f_localization))
      (over all (fd_available ?fd1))
      (over all (or (not (corridor_with_obstacles ?from ?to)) (fd_meets_safe_near_obstacles ?fd1)))
      (over all (or (not (dark_corridor ?from ?to)) (fd_meets_sees_in_the_dark ?fd1))))
    :effect (and
      (at start (not (robot_at ?from)))
      (at end (robot_at ?to))
      (at end (decrease (battery) (fd_battery_usage ?fd1)))
      (at end (increase (battery_used) (fd_battery_usage ?fd1))))))
