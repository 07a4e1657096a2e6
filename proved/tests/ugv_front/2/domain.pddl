(define (domain ugv)
  (:requirements :typing :fluents :durative-actions)
  (:types
    waypoint action function functiondesign)
  (:constants
    a_move - action)
  (:predicates
    (robot_at ?wp - waypoint)
    (corridor ?from ?to - waypoint)
    (corridor_with_obstacles ?from ?to - waypoint)
    (dark_corridor ?from ?to - waypoint)
    (a_req_f ?a - action ?f - function)
    (fd_solve_f ?fd - functiondesign ?f - function)
    (fd_available ?fd - functiondesign))
  (:functions
    (travel_time ?from ?to - waypoint)
    (battery_usage ?fd - functiondesign)
    (safety ?fd - functiondesign)
    (minimum_illuminance ?fd - functiondesign)
    (battery)
    (battery_used))
  (:durative-action move
    :parameters (?f - function ?fd - functiondesign ?from ?to - waypoint)
    :duration (= ?duration (travel_time ?from ?to))
    :condition (and
      (at start (a_req_f a_move ?f))
      (at start (fd_solve_f ?fd ?f))
      (over all (fd_available ?fd))
      (at start (robot_at ?from))
      (over all (corridor ?from ?to))
      (at start (>= (battery) (battery_usage ?fd))))
    :effect (and
      (at start (not (robot_at ?from)))
      (at end (robot_at ?to))
      (at end (decrease (battery) (battery_usage ?fd)))
      (at end (increase (battery_used) (battery_usage ?fd)))))
  (:durative-action move_with_obstacles
    :parameters (?f - function ?fd - functiondesign ?from ?to - waypoint)
    :duration (= ?duration (travel_time ?from ?to))
    :condition (and
      (at start (a_req_f a_move ?f))
      (at start (fd_solve_f ?fd ?f))
      (over all (fd_available ?fd))
      (over all (> (safety ?fd) 0.8))
      (at start (robot_at ?from))
      (over all (corridor_with_obstacles ?from ?to))
      (at start (>= (battery) (battery_usage ?fd))))
    :effect (and
      (at start (not (robot_at ?from)))
      (at end (robot_at ?to))
      (at end (decrease (battery) (battery_usage ?fd)))
      (at end (increase (battery_used) (battery_usage ?fd)))))
  (:durative-action move_in_the_dark
    :parameters (?f - function ?fd - functiondesign ?from ?to - waypoint)
    :duration (= ?duration (travel_time ?from ?to))
    :condition (and
      (at start (a_req_f a_move ?f))
      (at start (fd_solve_f ?fd ?f))
      (over all (fd_available ?fd))
      (over all (<= (minimum_illuminance ?fd) 0))
      (at start (robot_at ?from))
      (over all (dark_corridor ?from ?to))
      (at start (>= (battery) (battery_usage ?fd))))
    :effect (and
      (at start (not (robot_at ?from)))
      (at end (robot_at ?to))
      (at end (decrease (battery) (battery_usage ?fd)))
      (at end (increase (battery_used) (battery_usage ?fd))))))
