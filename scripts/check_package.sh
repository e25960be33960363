#!/usr/bin/env bash
# Makes the package that would be published and looks into it: small enough for the registry, everything in it that
# the sources include, nothing that is made. Compiles nothing. Says what is missing to publish.
set -euo pipefail
cd "$(dirname "$0")/.."

# The registry takes 10 MB.
most_bytes=8000000
cargo package -p scan2params --no-verify --allow-dirty --quiet
version=$(sed -n 's/^version = "\(.*\)"/\1/p' Cargo.toml | head -1)
crate=${CARGO_TARGET_DIR:-target}/package/scan2params-$version.crate
list=$(tar -tzf "$crate" | sed "s|^scan2params-$version/||")
failed=0

fail() {
    echo "$*" >&2
    failed=1
}

holds() {
    grep -qxF -- "$1" <<<"$list" || fail "the package lacks $1"
}

bytes=$(wc -c <"$crate")
echo "the package has $(wc -l <<<"$list") files and $bytes bytes, of at most $most_bytes"
[ "$bytes" -le "$most_bytes" ] || fail "the package is larger than the registry takes"

for file in Cargo.toml Cargo.lock README.md CHANGELOG.md LICENSE-MIT LICENSE-APACHE \
    src/estimate/model/shipped.onnx src/estimate/model/shipped.json docs/schemas/params.schema.json; do
    holds "$file"
done
# What the sources include, by their own words.
included=0
while IFS=: read -r file path; do
    holds "$(realpath --relative-to=. -m "$(dirname "$file")/$path")"
    included=$((included + 1))
done < <(grep -rhoHE 'include_(bytes|str)!\("[^"]+"\)' src --include='*.rs' |
    sed -E 's/include_(bytes|str)!\("([^"]+)"\)/\2/')
[ "$included" -gt 3 ] || fail "only $included included files were found in src: the search is broken"
# What the sources and the README's main job read.
while read -r file; do holds "$file"; done < <(
    { grep -rhoE '"(fixtures|tests|benches)/[^"]+"' src --include='*.rs' | tr -d '"'
      awk '/<!-- main job -->/ { on = 1 } on && /^```$/ { exit } on' README.md | grep -oE 'fixtures/[^ ]+'; } | sort -u)
made=$(grep -E '^(target|out|data|fuzz|lab|docs/images|\.ci)/|\.part$|__pycache__|node_modules' <<<"$list" || true)
[ -z "$made" ] || fail "the package holds what is no part of it: $made"

for key in description license readme rust-version keywords categories; do
    grep -qE "^$key = " Cargo.toml || fail "Cargo.toml has no $key"
done
for key in repository homepage documentation; do
    grep -qE "^$key = " Cargo.toml || echo "to publish, Cargo.toml should have $key (there is no address yet)"
done
exit $failed
