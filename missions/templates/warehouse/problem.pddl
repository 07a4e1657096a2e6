; dock --4-- packing --6-- crossing ==6== far_rack     ==: a dark aisle
;                              |                          numbers: metres
;                              5
;                              |
;                          near_rack                    from near_rack to far_rack: 15, lit
(define (problem two_items)
  (:domain warehouse)
  (:objects
    dock packing crossing near_rack far_rack - place
    box vase - item)
  (:init
    (robot_at near_rack)
    (hand_is_free)
    (= (battery) 12)
    (charger_at dock)
    (item_at box near_rack)
    (item_at vase far_rack)
    (fragile vase)
    (lit_aisle dock packing)        (= (distance dock packing) 4)
    (lit_aisle packing dock)        (= (distance packing dock) 4)
    (lit_aisle packing crossing)    (= (distance packing crossing) 6)
    (lit_aisle crossing packing)    (= (distance crossing packing) 6)
    (lit_aisle crossing near_rack)  (= (distance crossing near_rack) 5)
    (lit_aisle near_rack crossing)  (= (distance near_rack crossing) 5)
    (dark_aisle crossing far_rack)  (= (distance crossing far_rack) 6)
    (dark_aisle far_rack crossing)  (= (distance far_rack crossing) 6)
    (lit_aisle near_rack far_rack)  (= (distance near_rack far_rack) 15)
    (lit_aisle far_rack near_rack)  (= (distance far_rack near_rack) 15))
  (:goal (and
    (item_at box packing)
    (item_at vase packing)))
  (:metric minimize (total-time)))
