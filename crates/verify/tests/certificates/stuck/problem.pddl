(define (problem stuck)
  (:domain stuck)
  (:init
    (b))
  (:goal (c)))
