(define (problem oven)
  (:domain oven)
  (:init
    (at 3 (power))
    (at 20 (not (power))))
  (:goal (baked))
  (:metric minimize (total-time)))
