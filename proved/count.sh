#!/bin/sh
# Counts the lines that have to be believed, without blank lines and comments, as rows of the table in
# docs/explanation/proved.md. Fails above the limit. The reader of evidence is counted apart: the
# theorem holds for any evidence, so this file only has to be free of side effects.
set -e
cd "$(dirname "$0")"
limit=600
# Counts the lines that have text outside of (* comments *), which may nest.
lines() {
  awk '{
    code = ""
    for (i = 1; i <= length($0); i++) {
      two = substr($0, i, 2)
      if (two == "(*") { depth++; i++ }
      else if (two == "*)" && depth > 0) { depth--; i++ }
      else if (depth == 0) code = code substr($0, i, 1)
    }
    if (code ~ /[^ \t]/) n++
  } END { print n + 0 }'
}
total=0
row() {
  n=$(lines)
  total=$((total + n))
  printf '| %s | %d |\n' "$1" "$n"
}
row '`proved/Lifted.v`' <Lifted.v
row 'theorem `optimal` in `proved/Optimal.v`' <<EOF
$(sed -n '/^Theorem optimal/,/^Proof/p' Optimal.v | grep -v '^Proof')
EOF
row 'theorem `unsolvable` in `proved/Optimal.v`' <<EOF
$(sed -n '/^Theorem unsolvable/,/^Proof/p' Optimal.v | grep -v '^Proof')
EOF
row '`proved/ocaml/reader.ml`' <ocaml/reader.ml
row '`proved/ocaml/check.ml`' <ocaml/check.ml
printf '| sum | %d |\n' "$total"
printf '| `proved/ocaml/evidence.ml` | %d |\n' "$(lines <ocaml/evidence.ml)"
believed=$total
total=0
row '`proved/Lists.v`, above "What follows"' <<EOF
$(sed '/^(\* What follows/,$d' Lists.v | grep -v '^From\|^Import\|^Open')
EOF
row 'theorem `list_optimal` in `proved/Lists.v`' <<EOF
$(sed -n '/^Theorem list_optimal/,/^Proof/p' Lists.v | grep -v '^Proof')
EOF
row '`proved/ocaml/check_list.ml`' <ocaml/check_list.ml
row '`proved/Fronts.v`, above "What follows"' <<EOF
$(sed '/^(\* What follows/,$d' Fronts.v | grep -v '^From\|^Import\|^Open')
EOF
row 'theorem `front_optimal` in `proved/Fronts.v`' <<EOF
$(sed -n '/^Theorem front_optimal/,/^Proof/p' Fronts.v | grep -v '^Proof')
EOF
row '`proved/ocaml/front.ml`' <ocaml/front.ml
row '`proved/ocaml/check_front.ml`' <ocaml/check_front.ml
row '`proved/Timed.v`' <Timed.v
row 'theorem `timed_optimal` in `proved/TimelineProof.v`' <<EOF
$(sed -n '/^Theorem timed_optimal/,/^Proof/p' TimelineProof.v | grep -v '^Proof')
EOF
row '`proved/ocaml/timed.ml`' <ocaml/timed.ml
row '`proved/Datalog.v`' <Datalog.v
row 'theorem `knowledge` in `proved/Derivations.v`' <<EOF
$(sed -n '/^Theorem knowledge/,/^Proof/p' Derivations.v | grep -v '^Proof')
EOF
row '`proved/ocaml/json.ml`' <ocaml/json.ml
row '`proved/ocaml/knowledge.ml`' <ocaml/knowledge.ml
row '`proved/ocaml/check_knowledge.ml`' <ocaml/check_knowledge.ml
row '`proved/Mission.v`' <Mission.v
row 'theorem `mission_optimal` in `proved/MissionProof.v`' <<EOF
$(sed -n '/^Theorem mission_optimal/,/^Proof/p' MissionProof.v | grep -v '^Proof')
EOF
row 'theorem `mission_front` in `proved/MissionProof.v`' <<EOF
$(sed -n '/^Theorem mission_front/,/^Proof/p' MissionProof.v | grep -v '^Proof')
EOF
row '`proved/ocaml/mission.ml`' <ocaml/mission.ml
row '`proved/ocaml/check_mission.ml`' <ocaml/check_mission.ml
printf '| `proved/ocaml/derive.ml` | %d |\n' "$(lines <ocaml/derive.ml)"
total=$believed
[ "$total" -le "$limit" ] || { echo "more than $limit lines have to be believed" >&2; exit 1; }
