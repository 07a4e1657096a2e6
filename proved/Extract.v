(* Extracts the checker to ocaml/checker.ml, with Coq's own integers: no arithmetic library is
   linked. *)
From Coq Require Import Extraction ExtrOcamlBasic ZArith QArith.
From Proved Require Import Task Check Lifted Faithful Lists Fronts Timed Timeline Datalog Derivations Mission MissionProof.
Extraction Language OCaml.
Set Warnings "-extraction-opaque-accessed".
Extraction "ocaml/checker.ml" check_certificate check_list check_front check_timed check_derivations check_mission check_mission_front satisfies
  (* for the readers *) add_atom basics M.elements var_value Or Imply Exists Equal M.empty M.add Z.add Z.mul Qred
  (* for the program that writes case trees *) instances pruned gathered with_invariants instance_leaf goal_leaf conjuncts contradictory derived_world base_truth implied symbolic_expression
  extended passages feasible fixed_duration start_knowledge timed_leaf wait_leaf up_to timed_step.
