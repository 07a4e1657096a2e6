(define (problem two-parcels)
  (:domain fleet)
  (:objects
    ann bob - robot
    depot gate ramp - place
    p1 p2 - parcel)
  (:init
    (robot_at ann depot) (free ann)
    (robot_at bob gate) (free bob)
    (way depot gate) (way gate depot)
    (way gate ramp) (way ramp gate)
    (parcel_at p1 depot) (parcel_at p2 gate))
  (:goal (and (parcel_at p1 ramp) (parcel_at p2 ramp) (robot_at ann ramp) (robot_at bob ramp))))
