#!/bin/sh
# Runs the proved checker on the fronts that the test `oracle` saves in the directory ORACLE_FRONTS: for each
# task a true one, and false ones that are made of its files. Fails if a false front is accepted.
# usage: sh proved/fronts.sh DIRECTORY
set -e
programs=$(cd "$(dirname "$0")/ocaml" && pwd)
temporary=$(mktemp -d)
trap 'rm -rf "$temporary"' EXIT
accepted=0 refused=0 rejected=0
for front in "$1"/*/*; do
  points=$(tail -n +3 "$front/front.txt" | wc -l)
  set --
  for i in $(seq $((points + 1))); do
    # Without evidence, the checker decides nothing.
    "$programs/metaplan-proved-prepare" "$front/$i" >"$temporary/$i" 2>"$temporary/reason" || break
    set -- "$@" "$temporary/$i"
  done
  [ $# -gt 0 ] || set -- "$temporary/1"
  answer=$("$programs/metaplan-proved-front" "$front" "$@") || true
  case ${front##*/}:$answer in
    false*:proved:*) echo "$front: a false front is accepted: $answer" >&2; exit 1 ;;
    true:proved:*) accepted=$((accepted + 1)) ;;
    true:*) refused=$((refused + 1)); echo "$front: $(cat "$temporary/reason") $answer" ;;
    *) rejected=$((rejected + 1)) ;;
  esac
done
echo "true fronts: $accepted accepted, $refused not accepted; false fronts: $rejected, none of them accepted"
