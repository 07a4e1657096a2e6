(define (problem doors)
  (:domain doors)
  (:objects
    r1 r2 r3)
  (:init
    (at r1)
    (door r1 r2)
    (door r2 r3))
  (:goal (and (done) (lit r3) (reach r3))))
