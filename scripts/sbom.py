#!/usr/bin/env python3
"""Turns `cargo metadata` (standard input) into a CycloneDX 1.6 bill of materials: see sbom.sh. No package is needed."""

import json
import pathlib
import sys
import tomllib
import uuid

ROOT = pathlib.Path(__file__).resolve().parent.parent
# Bundled files that no crate brings: name, version as their own files say it, licence, where.
BUNDLED = [("three", "scripts/viewer/package.json", "MIT", "src/report/page/viewer/viewer.min.js")]


def purl(name, version):
    return f"pkg:cargo/{name}@{version}"


def licence(package):
    text = package["license"]
    if not text:
        sys.exit(f"{package['name']} {package['version']} states no licence")
    return [{"expression": text.replace(" / ", " OR ").replace("/", " OR ")}]


def compiled(metadata):
    """The packages that the program is compiled from, and what each needs: no development tools."""
    nodes = {node["id"]: node for node in metadata["resolve"]["nodes"]}
    ids = [p["id"] for p in metadata["packages"] if p["name"] == "scan2params"]
    needs, waiting = {}, list(ids)
    while waiting:
        one = waiting.pop()
        if one in needs:
            continue
        kinds = [(dep["pkg"], {kind["kind"] for kind in dep["dep_kinds"]}) for dep in nodes[one]["deps"]]
        needs[one] = sorted(pkg for pkg, kind in kinds if kind - {"dev"})
        waiting += needs[one]
    return ids[0], needs


def main(target):
    metadata = json.load(sys.stdin)
    packages = {package["id"]: package for package in metadata["packages"]}
    lock = tomllib.loads((ROOT / "Cargo.lock").read_text())
    sums = {(p["name"], p["version"]): p.get("checksum") for p in lock["package"]}
    root, needs = compiled(metadata)
    refs = {one: purl(packages[one]["name"], packages[one]["version"]) for one in needs}
    components = []
    for one in sorted(needs, key=refs.get):
        if one == root:
            continue
        package = packages[one]
        component = {
            "type": "library", "bom-ref": refs[one], "name": package["name"], "version": package["version"],
            "licenses": licence(package), "purl": refs[one],
        }
        if checksum := sums[package["name"], package["version"]]:
            component["hashes"] = [{"alg": "SHA-256", "content": checksum}]
        components.append(component)
    bundled = []
    for name, said, terms, file in BUNDLED:
        stated = json.loads((ROOT / said).read_text())
        version = {**stated.get("dependencies", {}), **stated.get("devDependencies", {})}[name].lstrip("^~=")
        ref = f"pkg:npm/{name}@{version}"
        bundled.append(ref)
        components.append({
            "type": "library", "bom-ref": ref, "name": name, "version": version, "purl": ref,
            "licenses": [{"license": {"id": terms}}], "description": f"bundled in {file}",
        })
    own = packages[root]
    dependencies = [{"ref": refs[one], "dependsOn": [refs[need] for need in needs[one]]} for one in sorted(needs, key=refs.get)]
    next(entry for entry in dependencies if entry["ref"] == refs[root])["dependsOn"] += bundled
    check(components, dependencies)
    bom = {
        "$schema": "http://cyclonedx.org/schema/bom-1.6.schema.json",
        "bomFormat": "CycloneDX", "specVersion": "1.6",
        # Of the content, so that the same commit has the same number.
        "serialNumber": f"urn:uuid:{uuid.uuid5(uuid.NAMESPACE_URL, json.dumps([target, dependencies]))}",
        "version": 1,
        "metadata": {
            "component": {
                "type": "application", "bom-ref": refs[root], "name": own["name"], "version": own["version"],
                "description": own["description"], "licenses": licence(own), "purl": refs[root],
            },
            "properties": [{"name": "scan2params:target", "value": target}],
        },
        "components": components,
        "dependencies": dependencies,
    }
    json.dump(bom, sys.stdout, indent=1)
    print()
    print(f"{len(components)} components", file=sys.stderr)


def check(components, dependencies):
    """What a reader relies on: names are unique, what is depended on is listed, crates have the registry's sum."""
    refs = [component["bom-ref"] for component in components]
    assert len(refs) == len(set(refs)), "two components of one name"
    for entry in dependencies:
        assert len(entry["dependsOn"]) == len(set(entry["dependsOn"])), entry["ref"]
        for ref in entry["dependsOn"]:
            assert ref in refs, f"{entry['ref']} depends on {ref}, which is not listed"
    without = [c["name"] for c in components if "hashes" not in c and c["purl"].startswith("pkg:cargo/")]
    assert not without, f"no checksum: {without}"


if __name__ == "__main__":
    main(sys.argv[1])
