; A robot moves along arcs in one of its configurations. What a move takes depends on both; the probabilities of
; success and of collisions are for the probabilistic approach, and no action reads them.
(define (domain coadaptation)
  (:requirements :typing :equality :negative-preconditions :numeric-fluents)
  (:types waypoint functiondesign)
  (:predicates
    (robot_at ?at - waypoint)
    (configured ?fd - functiondesign)
    (fd_available ?fd - functiondesign)
    (suits ?fd - functiondesign ?from ?to - waypoint))
  (:functions
    (time ?from ?to - waypoint ?fd - functiondesign)    ; seconds
    (energy ?from ?to - waypoint ?fd - functiondesign)  ; units of the battery
    (success ?from ?to - waypoint ?fd - functiondesign) ; probability of getting there
    (hit ?from ?to - waypoint ?fd - functiondesign)     ; probability of a collision on the way
    (switch_time ?old ?new - functiondesign)            ; seconds
    (battery)
    (reserve)
    (total_time)
    (total_energy))
  (:action move
    :parameters (?fd - functiondesign ?from ?to - waypoint)
    :precondition (and (robot_at ?from) (configured ?fd) (fd_available ?fd) (suits ?fd ?from ?to)
      (>= (battery) (+ (reserve) (energy ?from ?to ?fd))))
    :effect (and (not (robot_at ?from)) (robot_at ?to)
      (decrease (battery) (energy ?from ?to ?fd))
      (increase (total_energy) (energy ?from ?to ?fd))
      (increase (total_time) (time ?from ?to ?fd))))
  (:action reconfigure
    :parameters (?old ?new - functiondesign)
    :precondition (and (configured ?old) (fd_available ?new) (not (= ?old ?new)))
    :effect (and (not (configured ?old)) (configured ?new)
      (increase (total_time) (switch_time ?old ?new)))))
