#!/usr/bin/env bash
# Checks that a user of the simulator or of the scan path gets none of the heavy crates, and that the
# table of src/lib.rs says how many crates each feature pulls in. On Linux; the counts are of
# Cargo.lock as it is. With --all the library is compiled with no feature and with each alone;
# without it, tests/house/features.rs reads what each needs.
set -euo pipefail
cd "$(dirname "$0")/.."

target=x86_64-unknown-linux-gnu
failed=0

crates() {
    cargo tree --locked --quiet --target "$target" --edges normal --prefix none \
        --no-default-features --features "$1" | cut -d' ' -f1,2 | sort -u |
        grep -v '^scan2params ' || true
}

fail() {
    echo "$*" >&2
    failed=1
}

bare=$(crates "")
for heavy in anyhow clap parquet ort ort-tract tract-core image plotters; do
    if grep -q "^$heavy " <<<"$bare"; then
        fail "without features $heavy is compiled"
    fi
done

for feature in "" calibrate estimate dataset picture report kit terminal cli; do
    name=${feature:-none}
    count=$(crates "$feature" | wc -l)
    row="| \`$name\` |"
    said=$(awk -F'|' -v row="$row" 'index($0, row) { print $(NF - 1) + 0 }' src/lib.rs)
    echo "$name: $count crates"
    if [ "$said" != "$count" ]; then
        fail "src/lib.rs says ${said:-nothing} of \`$name\`, which pulls in $count crates"
    fi
    if [ "${1:-}" = --all ]; then
        cargo check --release --lib --quiet --no-default-features --features "$feature"
    fi
done
exit "$failed"
