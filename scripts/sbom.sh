#!/usr/bin/env bash
# The bill of materials of the program, CycloneDX 1.6 as JSON: every crate that is compiled into it, with version, licence, SHA-256 of
# the registry and what it depends on. `scripts/sbom.sh [FILE]`; Cargo.lock decides, so that the same commit gives the same bytes.
set -euo pipefail
cd "$(dirname "$0")/.."
target=$(rustc -vV | sed -n 's/^host: //p')
cargo metadata --locked --format-version 1 --filter-platform "$target" | python3 scripts/sbom.py "$target" >"${1:-/dev/stdout}"
