(define (problem flat)
  (:domain patrol)
  (:objects
    dock gate yard - place)
  (:init
    (at dock)
    (road dock gate)
    (road gate yard)
    (road dock yard)
    (= (energy dock gate) 3)
    (= (energy gate yard) 4)
    (= (energy dock yard) 12.5)
    (= (battery) 6.5))
  (:goal (at yard)))
