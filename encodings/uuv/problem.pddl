; One pipeline, not found yet.
(define (problem uuv_inspection)
  (:domain uuv)
  (:objects pl1 - pipeline)
  (:init
    (= (search_area pl1) 3)
    (= (pipeline_length pl1) 4)
    (= (dock_distance) 2)
    (= (battery) 100)
    (= (battery_reserve) 10))
  (:goal (pipeline_inspected pl1))
  (:metric minimize (total-time)))
