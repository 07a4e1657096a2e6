#!/bin/sh
# Compiles the programs metaplan-proved-prepare and metaplan-proved-check to JavaScript, and writes the page
# docs/verify.html, which checks a certificate in a browser. Needs Debian's js-of-ocaml, ocaml-nox and
# ocaml-findlib. The page is not committed, since its bytes depend on the version of the compiler. The
# file is named by the first argument, if there is one.
set -e
page=$(realpath -m "${1:-$(dirname "$0")/../docs/verify.html}")
cd "$(dirname "$0")"
limit=300000
temporary=$(mktemp -d)
trap 'rm -rf "$temporary"' EXIT
cp ocaml/checker.mli ocaml/checker.ml ocaml/reader.ml ocaml/json.ml ocaml/evidence.ml ocaml/timed.ml ocaml/prepare.ml ocaml/check.ml page/verify.html "$temporary"
cd "$temporary"
ocamlfind ocamlc -c checker.mli checker.ml reader.ml json.ml evidence.ml timed.ml
for program in prepare check; do
  ocamlfind ocamlc checker.cmo reader.cmo json.cmo evidence.cmo timed.cmo "$program.ml" -o "$program.byte"
  js_of_ocaml "$program.byte" -o "$program.js"
  gzip -9 -n -c "$program.js" | base64 -w 0 >"$program.txt"
  echo >>"$program.txt"
done
sed -e '/^@PREPARE@$/{
r prepare.txt
d
}' -e '/^@CHECK@$/{
r check.txt
d
}' verify.html >page.html
size=$(wc -c <page.html)
[ "$size" -le "$limit" ] || { echo "page.sh: the page has $size bytes, more than $limit" >&2; exit 1; }
mv page.html "$page"
echo "$page: $size bytes"
