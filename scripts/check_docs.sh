#!/usr/bin/env bash
# Runs the commands of the documents: every fenced `sh` block after a line `<!-- run -->`
# of README.md and of the documents below docs, fixtures and scripts (or of those that are named), as it
# stands, one after another in an empty folder in which `fixtures` lies. `scan2params` in them is the program
# that is built here. Says where the first failing block stands, and how long each document took.
set -euo pipefail
cd "$(dirname "$0")/.."

cargo build --release --quiet
root=$PWD
target=${CARGO_TARGET_DIR:-target}
mkdir -p "$target"
PATH=$(cd "$target" && pwd)/release:$PATH
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
ln -s "$root/fixtures" "$work/fixtures"

# Writes the marked blocks of a document to block-1, block-2, ..., each with its line.
split() {
    awk -v into="$2" '
        fenced && /^```/ { close(file); fenced = 0; next }
        fenced { print > file; next }
        marked && /^```sh$/ { file = into "/block-" ++count; print FNR > (file ".line"); close(file ".line"); fenced = 1 }
        { marked = ($0 == "<!-- run -->") }
        END { if (fenced) exit 1 }' "$1"
}

if [ $# = 0 ]; then
    set -- README.md docs/*.md docs/{commands,design,users}/*.md fixtures/README.md scripts/README.md
fi
blocks=0
# No file of defaults of whoever runs this.
export SCAN2PARAMS_CONFIG=
for document; do
    since=$SECONDS
    into=$(mktemp -d "$work/.blocks-XXXXXX")
    split "$document" "$into"
    marks=$(grep -c '^<!-- run -->$' "$document" || true)
    found=$(find "$into" -name 'block-*' ! -name '*.line' | wc -l)
    if [ "$marks" != "$found" ]; then
        echo "$document: $marks marks <!-- run -->, but $found sh blocks after them" >&2
        exit 1
    fi
    for k in $(seq 1 "$found"); do
        block=$into/block-$k
        echo "-- $document:$(cat "$block.line")"
        if ! (cd "$work" && bash -euxo pipefail "$block") >"$work/.log" 2>&1; then
            cat "$work/.log" >&2
            echo "$document:$(cat "$block.line"): this block fails" >&2
            exit 1
        fi
        blocks=$((blocks + 1))
    done
    if [ "$found" != 0 ]; then
        echo "   $document: $((SECONDS - since)) s"
    fi
done
if [ "$blocks" = 0 ]; then
    echo "no block is marked <!-- run -->" >&2
    exit 1
fi
echo "$blocks blocks of the documents run"
