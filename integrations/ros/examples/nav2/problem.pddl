; Two shelves; the robot is to be back at its dock.
(define (problem round)
  (:domain scout)
  (:objects dock gate - place shelf_1 shelf_2 - shelf)
  (:init
    (robot_at dock)
    (= (distance dock gate) 4) (= (distance gate dock) 4)
    (= (distance gate shelf_1) 3) (= (distance shelf_1 gate) 3)
    (= (distance shelf_1 shelf_2) 2) (= (distance shelf_2 shelf_1) 2)
    (= (distance gate shelf_2) 5) (= (distance shelf_2 gate) 5)
    (= (battery) 100)
    (= (battery_reserve) 10))
  (:goal (and (inspected shelf_1) (inspected shelf_2) (robot_at dock)))
  (:metric minimize (total-time)))
