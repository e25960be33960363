"""How well a scan's scale is found, and where a wrong one is doubtful.

    scan2params evaluate scenes --drapes DRAPES --count 36 --relaxed --write SCENES
    python3 scripts/scale.py SCENES [--quick] [--factors 0.985,1,1.015]

Each scan of SCENES is answered as if its lengths were FACTOR times as long (`--rescale 1/FACTOR`). A row of the table is a
factor: scans answered and refused; median of the scale found over the factor; scales within 1.64 of their
standard deviations of it; answers with a ground `scale` or `width`, and with others alone; median of the
middle bending stiffness over the true one. Needs Python alone, and `scan2params` on the path, or `--program`.
"""

import argparse
import json
import subprocess
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from statistics import median

BENDING = ["bending_weft", "bending_warp", "bending_bias"]


def answer(program: str, scan: Path, factor: float, quick: bool) -> dict | None:
    """What is answered of one scan; None where it is refused."""
    truth = json.loads(scan.with_suffix(".truth.json").read_text())
    with tempfile.TemporaryDirectory() as out:
        asked = [program, str(scan), "--density", str(truth["params"]["density"]), "--out", out]
        asked += ["--rescale", str(1 / factor), "--threads", "1", "--quiet"]
        asked += ["--warp-toward=" + ",".join(map(str, truth["warp_toward"]))]
        subprocess.run(asked + ["--quick"] * quick, capture_output=True)
        found = list(Path(out).glob("*.params.json"))
        if not found:
            return None
        said = json.loads(found[0].read_text())
    value = {key: said["parameters"][key]["value"] / truth["params"][key] for key in BENDING}
    codes = {ground["code"] for ground in said["verdict"]["grounds"] if ground["level"] != "reliable"}
    return {"scale": said["verdict"].get("scale"), "codes": codes, "bending": median(value.values())}


def row(factor: float, answers: list[dict | None]) -> str:
    """The row of a factor."""
    given = [answer for answer in answers if answer]
    scales = [answer["scale"] for answer in given if answer["scale"]]
    off = [scale["value"] / factor - 1 for scale in scales]
    within = sum(abs(o) * factor < 1.64 * scale["sigma"] for o, scale in zip(off, scales))
    said = sum(bool(answer["codes"] & {"scale", "width"}) for answer in given)
    other = sum(bool(answer["codes"]) for answer in given) - said
    bending = median(answer["bending"] for answer in given)
    return (
        f"| {factor} | {len(given)} | {len(answers) - len(given)} | {1 + median(off):.4f} | {within} of {len(scales)} "
        f"| {said} | {other} | {bending:.3f} |"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", type=Path)
    parser.add_argument("--program", default="scan2params")
    parser.add_argument("--factors", default="0.97,0.985,1,1.015,1.03")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--quick", action="store_true", help="the network's answer alone")
    asked = parser.parse_args()
    scans = sorted(asked.scenes.glob("*.ply"))
    print("| factor | answered | refused | scale over factor | within 1.64 sigmas | scale or width | other grounds | bending |")
    print("|---|---|---|---|---|---|---|---|")
    with ThreadPoolExecutor(asked.threads) as pool:
        for factor in map(float, asked.factors.split(",")):
            one = lambda scan: answer(asked.program, scan, factor, asked.quick)
            print(row(factor, list(pool.map(one, scans))), flush=True)


if __name__ == "__main__":
    main()
