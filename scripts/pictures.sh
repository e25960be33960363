#!/usr/bin/env bash
# Makes the pictures of docs/images again from the fixtures, with the programs that are built (also `-p scan2params-lab`): `bash scripts/pictures.sh [NAME]`.
# Needs Python with Pillow and numpy. Look at what it has made before you commit it. (report.png is a screenshot: viewer/check.mjs --shots.)
set -euo pipefail
cd "$(dirname "$0")/.."
root=$PWD
program=${SCAN2PARAMS:-$root/${CARGO_TARGET_DIR:-target}/release/scan2params}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
ln -s "$root/fixtures" "$work/fixtures"
cd "$work"
scan=fixtures/scans/mean_structured-light
"$program" "$scan.ply" --density 214 --warp-toward -x --out out >/dev/null
"$program" simulate --params out/mean_structured-light.params.json --seed 2 --out found.obj >/dev/null
# Three views of eight: the far side of the rim is hidden, and the scan is refused.
"$program" simulate --params fixtures/drapes/mean.params.json --seed 2 --out mean.obj >/dev/null
"$program" augment mean.obj --profile truedepth --as depth --seed 1 --out depth
python3 - <<'PY'
import json
path = "depth/mean-0/views.json"
views = json.load(open(path))
views["views"] = views["views"][:3]
json.dump(views, open(path, "w"))
PY
"$program" inspect depth/mean-0 --out refused.png && { echo "three views were not refused" >&2; exit 1; }
"$program" inspect fixtures/scans/mean_truedepth.ply --warp-toward -x --out inspect.png >/dev/null
python3 "$root/scripts/readme_picture.py" "$scan.ply" "$scan.truth.json" out/mean_structured-light.params.json \
    out/mean_structured-light.boundary.csv found.obj pipeline.png
cp out/mean_structured-light.boundary.png overlay.png
# A palette, so that they stay small: half of it for the colours that are there most, half for the strong ones.
python3 - <<'PY'
import colorsys
from PIL import Image
for name, width in [("inspect", 1440), ("refused", 1440), ("overlay", 1200)]:
    image = Image.open(f"{name}.png").convert("RGB")
    height = round(image.height * width / image.width)
    image = image.resize((width, height), Image.Resampling.LANCZOS)
    counts = sorted(image.getcolors(1 << 24), reverse=True)
    strong = [c for c in counts if colorsys.rgb_to_hsv(*(v / 255 for v in c[1]))[1] > 0.35]
    chosen = []
    for _, colour in counts[:24] + strong:
        if len(chosen) < 64 and all(sum(abs(a - b) for a, b in zip(colour, other)) > 36 for other in chosen):
            chosen.append(colour)
    palette = Image.new("P", (1, 1))
    palette.putpalette([v for colour in chosen for v in colour])
    image.quantize(palette=palette, dither=Image.Dither.NONE).save(f"{name}.png", optimize=True)
PY
"$program-lab" estimate fixtures/rims --out . >/dev/null
python3 - <<'PY'
from PIL import Image
image = Image.open("answers.png").convert("RGB")
image.resize((1600, round(image.height * 1600 / image.width)), Image.Resampling.LANCZOS).quantize(32).save("answers.png", optimize=True)
PY
for name in ${1:-pipeline inspect refused overlay answers}; do
    cp "$name.png" "$root/docs/images/$name.png"
    echo "docs/images/$name.png: $(wc -c <"$name.png") bytes"
done
