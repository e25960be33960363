#!/usr/bin/env python3
"""Checks docs/schemas with the reference implementation: `python scripts/check_schemas.py [NAME=FILE.json ...]`.

Each schema is valid in its draft. Each example fits its schema; the same example with a key left out, one more, or a
value of another type does not, wherever the schema says so. tests/job/schemas.rs does the same with the program's outputs
and a validator of its own; the two must agree (`tests/job/schemas.rs` has why). NAME=FILE checks a file of yours."""

import copy
import json
import pathlib
import sys

import jsonschema
import referencing

FOLDER = pathlib.Path(__file__).resolve().parent.parent / "docs" / "schemas"
TYPES = {"string": "a", "number": 0.5, "null": None, "object": {"odd": 1}}


def schemas():
    return {p.name: json.loads(p.read_text()) for p in sorted(FOLDER.glob("*.schema.json"))}


def validators():
    all_of = schemas()
    dialect = referencing.jsonschema.DRAFT202012
    registry = referencing.Registry().with_resources((name, dialect.create_resource(s)) for name, s in all_of.items())
    for schema in all_of.values():
        jsonschema.Draft202012Validator.check_schema(schema)
    kind = jsonschema.Draft202012Validator
    return {name: kind({"$ref": name}, registry=registry) for name in all_of}


def places(value, path=()):
    """Every place in a document; of a list of numbers the first."""
    yield path
    if isinstance(value, dict):
        for key in sorted(value):
            yield from places(value[key], path + (key,))
    elif isinstance(value, list):
        numbers = all(isinstance(entry, (int, float)) for entry in value)
        for k, entry in enumerate(value[:1] if numbers else value):
            yield from places(entry, path + (k,))


def at(document, path):
    for step in path:
        document = document[step]
    return document


def faults(document):
    """The document with one fault each, with its kind. The same list as in tests/job/schemas.rs."""
    for path in places(document):
        value = at(document, path)
        if isinstance(value, dict):
            changed = copy.deepcopy(document)
            at(changed, path)["not_a_key"] = 1
            yield "one more key", changed
            for key in value:
                changed = copy.deepcopy(document)
                del at(changed, path)[key]
                yield "one key less", changed
        if path:
            for kind, other in TYPES.items():
                changed = copy.deepcopy(document)
                at(changed, path[:-1])[path[-1]] = other
                yield kind, changed


def main(given):
    found = validators()
    if given:
        for pair in given:
            name, file = pair.split("=", 1)
            document = json.loads(pathlib.Path(file).read_text())
            for error in found[f"{name}.schema.json"].iter_errors(document):
                print(f"{file}: {error.json_path}: {error.message[:300]}")
        return
    lines = ["example, kind of fault, planted, refused"]
    for example in sorted((FOLDER / "examples").glob("*.json")):
        schema = example.name.split(".")[0] + ".schema.json"
        document = json.loads(example.read_text())
        found[schema].validate(document)
        counts = {}
        for kind, changed in faults(document):
            of = counts.setdefault(kind, [0, 0])
            of[0] += 1
            of[1] += not found[schema].is_valid(changed)
        lines += [f"{example.name}, {kind}, {planted}, {refused}" for kind, (planted, refused) in sorted(counts.items())]
    text = "\n".join(lines) + "\n"
    expected = pathlib.Path(__file__).resolve().parent.parent / "tests" / "schema_support" / "verdicts.txt"
    if "--write" in sys.argv:
        expected.write_text(text)
    elif not expected.is_file() or expected.read_text() != text:
        sys.exit(f"{expected.name} is not what this implementation says: run `scripts/check_schemas.py --write` and read the difference")
    print(f"{len(found)} schemas hold, {len(lines) - 1} counts as in {expected.name}")


if __name__ == "__main__":
    main([word for word in sys.argv[1:] if "=" in word])
