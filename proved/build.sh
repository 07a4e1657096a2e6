#!/bin/sh
# Compiles every proof, fails if a theorem rests on an assumption, extracts the checker to
# ocaml/checker.ml, and builds the programs in ocaml/. Needs Debian's coq, libcoq-stdlib, ocaml-nox and
# ocaml-findlib.
set -e
cd "$(dirname "$0")"
for file in Task Check Proof Sound Derived Lifted Faithful Symbolic Axioms Simulation Optimal Lists Fronts Timed Timeline TimelineProof Datalog Derivations Mission MissionProof Extract; do coqc -Q . Proved "$file.v" >/dev/null; done
for theorem in Sound.sound Derived.derive_closed Axioms.stratum_closed Optimal.optimal Optimal.unsolvable Lists.list_optimal Fronts.front_optimal Fronts.front_undominated TimelineProof.timed_optimal Derivations.knowledge MissionProof.mission_optimal MissionProof.mission_front MissionProof.filled_determined; do
  answer=$(printf 'From Proved Require %s.\nPrint Assumptions %s.\n' "${theorem%.*}" "$theorem" | coqtop -q -Q . Proved 2>/dev/null)
  echo "$answer" | grep -q 'Closed under the global context' || { echo "$theorem rests on assumptions: $answer"; exit 1; }
  echo "$theorem: closed under the global context"
done
cd ocaml
ocamlfind ocamlopt -c checker.mli checker.ml reader.ml json.ml evidence.ml timed.ml exhaustive.ml knowledge.ml mission.ml derive.ml front.ml
for program in check check_list check_front check_knowledge check_mission prepare mutants knowledge_mutants mission_mutants differential semantics; do
  # `metaplan verify --proved` finds its programs by these names, also in PATH.
  case $program in
    check | prepare) name=metaplan-proved-$program ;;
    check_front) name=metaplan-proved-front ;;
    check_knowledge) name=metaplan-proved-knowledge ;;
    check_mission) name=metaplan-proved-mission ;;
    *) name=$program ;;
  esac
  # The search is for tests only.
  case $program in mutants | mission_mutants | differential) search=exhaustive.cmx ;; *) search= ;; esac
  case $program in check_mission | mission_mutants) missions='mission.cmx derive.cmx' ;; *) missions= ;; esac
  ocamlfind ocamlopt checker.cmx reader.cmx json.cmx evidence.cmx timed.cmx knowledge.cmx front.cmx $missions $search "$program.ml" -o "$name"
done
