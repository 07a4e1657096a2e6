; What the robot can do. The domain does not mention functions, designs or components: robot.ttl does.
; `effort` has the name of a quality attribute there, so in an action it stands for the design that is chosen for it.
(define (domain blank)
  (:requirements :typing :fluents)
  (:types place)
  (:predicates
    (robot_at ?place - place)
    (way ?from ?to - place))
  (:functions
    (effort)                            ; of the chosen design
    (total-cost))

  (:action move
    :parameters (?from ?to - place)
    :precondition (and (robot_at ?from) (way ?from ?to))
    :effect (and
      (not (robot_at ?from))
      (robot_at ?to)
      (increase (total-cost) (effort)))))
