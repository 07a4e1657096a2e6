#!/bin/sh
# Compiles every proof and fails if a theorem rests on an assumption. Needs Debian's coq and libcoq-stdlib.
set -e
cd "$(dirname "$0")"
for file in Task Check Proof Sound Derived Lifted Faithful Symbolic Simulation Optimal; do coqc -Q . Proved "$file.v" >/dev/null; done
for theorem in Sound.sound Derived.layer_closed Optimal.optimal; do
  answer=$(printf 'From Proved Require %s.\nPrint Assumptions %s.\n' "${theorem%.*}" "$theorem" | coqtop -q -Q . Proved 2>/dev/null)
  echo "$answer" | grep -q 'Closed under the global context' || { echo "$theorem rests on assumptions: $answer"; exit 1; }
  echo "$theorem: closed under the global context"
done
