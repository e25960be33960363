#!/usr/bin/env bash
# Runs every fuzz target for SECONDS_EACH (330) seconds, one after another, with bounds on
# memory: 1 GiB in all, 256 MiB in one allocation, for files of up to 64 KiB. Needs
# `cargo install cargo-fuzz`; a stable toolchain is enough (no sanitizer). Ends with an
# error at the first finding, whose input is then in fuzz/artifacts: add it to
# tests/io/fuzz.rs.
set -euo pipefail
cd "$(dirname "$0")/.."
export RUSTC_BOOTSTRAP=1
targets=${*:-ply obj pcd stl glb e57 las xyz depth_png views intrinsics density_csv boundary_csv}
for target in $targets; do
    echo "== $target"
    mkdir -p "fuzz/corpus/$target"
    cargo fuzz run -s none "$target" "fuzz/corpus/$target" "fuzz/seeds/$target" -- \
        -max_total_time="${SECONDS_EACH:-330}" -rss_limit_mb=1024 -malloc_limit_mb=256 \
        -max_len=65536 -timeout=10 -print_final_stats=1
done
