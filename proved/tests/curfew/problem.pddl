(define (problem curfew)
  (:domain curfew)
  (:objects
    a b - room)
  (:init
    (in a)
    (door a b)
    (door b a)
    (at 1 (light))
    (at 6 (locked b))
    (at 8 (not (light)))
    (at 9 (not (locked b))))
  (:goal (and (done a) (done b))))
