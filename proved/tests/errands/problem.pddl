(define (problem morning)
  (:domain errands)
  (:objects home shop bank work - place)
  (:init
    (at home) (road home shop) (alley home bank) (road shop work) (road bank work) (alley shop work)
    (= (length home shop) 4) (= (length home bank) 3) (= (length shop work) 3) (= (length bank work) 4)
    (= (cost) 0) (= (risk) 0))
  (:goal (at work))
  (:metric minimize (cost)))
