#!/usr/bin/env bash
# Makes the pictures of docs/gallery.md, and checks printed pages of the shipped models in one and two columns and the
# report in Chromium. Run from the root of the repository; needs pdflatex, pdftoppm, chromium and npm, and target/release/romc.
#
#   examples/report/pictures.sh [FOLDER]      (default: docs/pictures)
set -euo pipefail
cd "$(dirname "$0")/../.."
romc=$PWD/target/release/romc
folder=${1:-docs/pictures}
mkdir -p "$folder"
folder=$(cd "$folder" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

for model in paper-2d go1-d2 go1-d4 go2-async-d4; do
  for columns in one two; do
    width=(); [ "$columns" = one ] || width=(--width 22)
    [ "$model" != go1-d4 ] || width+=(--units physical)
    "$romc" compile "models/$model.json" --emit latex "${width[@]}" --out-dir "$work/$model-$columns" >/dev/null
    stem=${model//-/_}
    (cd "$work/$model-$columns" && for _ in 1 2; do
      pdflatex -interaction=nonstopmode -halt-on-error "$stem-preview.tex" >log.txt || { tail -20 log.txt; exit 1; }
    done)
    # a table or equation that leaves its column by 1 pt or more
    if grep -E '^Overfull \\[hv]box \([1-9]' "$work/$model-$columns/$stem-preview.log"; then
      echo "$model in $columns column(s): too wide" >&2
      exit 1
    fi
    pdf=$work/$model-$columns/$stem-preview.pdf
    echo "$model in $columns column(s): $(pdfinfo "$pdf" | awk '/^Pages/ { print $2 }') page(s)"
    case $model-$columns in
      paper-2d-one | go1-d4-two) pdftoppm -r 72 -gray -png -f 1 -l 1 -singlefile "$pdf" "$folder/$model-$columns" ;;
    esac
  done
done

"$romc" report models/go1-d4.json examples/recordings/go1/test_*.csv.gz --output "$work/report.html" >/dev/null
cp examples/report/package.json "$work"
(cd "$work" && npm install --silent --no-audit --no-fund && mkdir shots \
  && node "$OLDPWD/examples/report/check_page.mjs" report.html shots "$folder")
pdftoppm -r 60 -png -f 1 -l 1 -singlefile "$work/shots/report.pdf" "$folder/report-printed"
