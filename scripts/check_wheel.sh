#!/usr/bin/env bash
# Checks the Python package: clippy and documentation of its crate; the wheel built with maturin, installed with pip in an
# empty environment, and there its tests, its types, the notebook and the examples of docs/python.md. Needs Python 3.11 or
# later with venv and pip (the wheel itself takes 3.10), and what else building the program needs. The crates that were
# compiled for the program are used again. The pictures of the notebook go to the folder NOTEBOOK_PICTURES, if it is given.
set -euo pipefail
cd "$(dirname "$0")/.."

skip() {
    echo "skipped: $*"
    exit 0
}

if ! python3 -c 'import sys, venv, ensurepip; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; then
    skip "no Python 3.11 with venv and pip"
fi

root=$PWD
target=${CARGO_TARGET_DIR:-target}
mkdir -p "$target"
target=$(cd "$target" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
pip=(-m pip --quiet --disable-pip-version-check)

python3 -m venv "$work/build"
"$work/build/bin/python" "${pip[@]}" install -r python/requirements-build.txt ||
    skip "maturin cannot be installed"

cargo build --release --quiet
cargo fmt --package scan2params-python --check
cargo clippy --release --quiet --package scan2params-python --features as-program -- -D warnings
RUSTDOCFLAGS="-D warnings" cargo doc --release --quiet --no-deps --package scan2params-python --features as-program

before=$SECONDS
"$work/build/bin/maturin" build --release --locked --manifest-path python/Cargo.toml --features as-program \
    --interpreter python3 --out "$work/wheels" 2>&1 | tee "$work/log" | grep -v '^ *Compiling' || true
wheels=("$work"/wheels/scan2params-*.whl)
if [ ! -f "${wheels[0]}" ]; then
    cat "$work/log" >&2
    echo "no wheel was built" >&2
    exit 1
fi
compiled=$(grep -c '^ *Compiling' "$work/log" || true)
bytes=$(wc -c <"${wheels[0]}")
echo "$(basename "${wheels[0]}"): $((bytes / 1000)) kB, $((SECONDS - before)) s, $compiled crates compiled"

# With pip and nothing else, outside the repository.
cd "$work"
python3 -m venv clean
clean=$work/clean/bin/python
"$clean" "${pip[@]}" install --no-deps "${wheels[0]}"
"$clean" "${pip[@]}" install "${wheels[0]}" || skip "numpy cannot be installed"
"$clean" -I -c 'import scan2params; print("scan2params", scan2params.__version__, "from", scan2params.__file__)'
with=$("$clean" -m pip --disable-pip-version-check list --format freeze --exclude pip --exclude setuptools |
    cut -d= -f1 | xargs)
if [ "$with" != "numpy scan2params" ]; then
    echo "the wheel pulls in more than numpy: $with" >&2
    exit 1
fi
"$clean" "${pip[@]}" install -r "$root/python/requirements-test.txt" || skip "the tests' packages cannot be installed"
SCAN2PARAMS=$target/release/scan2params \
    "$clean" -m pytest -q -p no:cacheprovider --durations=5 "$root/python/tests" "$@"
