; What the robot is asked to do.
(define (problem first)
  (:domain blank)
  (:objects here there - place)
  (:init
    (robot_at here)
    (way here there)
    (way there here)
    (= (total-cost) 0))
  (:goal (robot_at there))
  (:metric minimize (total-cost)))
