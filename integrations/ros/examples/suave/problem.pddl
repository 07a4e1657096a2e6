; Nothing is to be done until a task is requested: the tasks have their goals in ros.toml.
(define (problem suave_pipeline)
  (:domain suave)
  (:objects pl1 - pipeline)
  (:init
    (= (work a_search_pipeline) 40)
    (= (work a_inspect_pipeline) 40)
    (= (work a_recharge) 10)
    (= (battery_level) 1)
    (= (battery_limit) 0.25))
  (:goal (and))
  (:metric minimize (total-time)))
