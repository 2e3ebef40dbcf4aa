"""Proves that jsonschema finds the schema of model files sound and takes our own model files."""

import json
import pathlib
import sys
import tomllib

import jsonschema

from surface import check

schema = json.loads((pathlib.Path(sys.argv[1]) / "isospline.schema.json").read_text())
jsonschema.Draft7Validator.check_schema(schema)
validator = jsonschema.Draft7Validator(schema)
root = pathlib.Path(__file__).resolve().parents[2]
files = sorted((root / "configs").glob("*.toml"))
for path in files:
    errors = list(validator.iter_errors(tomllib.loads(path.read_text())))
    check(not errors, f"{path.name}: {errors[:1]}")
model = "[model]\nformula = 'x'\n"
target = "[target]\n"
for sound in (
    "",
    "parameters = { a = 1 }",
    "box = [[0, 1], [0, 1], [0, 1]]",
    target + "faces = 4",
    target + "tolerance = 1e-6\nfit = 'paper'",
    target + "tolerance_abs = 1e-6",
    "[network]\nmethod = 'paper'",
):
    errors = list(validator.iter_errors(tomllib.loads(model + sound)))
    check(not errors, f"the schema refuses {sound!r}: {errors[:1]}")
broken = (
    "level = '0'",
    "box = [[0, 1], [0, 1]]",
    "parameters = { a = 'b' }",
    target + "face = 7",
    target + "faces = 3",
    target + "tolerance = 1.0",
    target + "faces = 9\ntolerance = 1e-6",
    target + "faces = 9\ntolerance_abs = 1e-6",
    target + "tolerance = 1e-6\ntolerance_abs = 1e-6",
    "[network]\nmethod = 'papers'",
    "[decimate]\nfaces = 100",
    "[decimat]\nspread = 1",
)
for text in broken:
    check(not validator.is_valid(tomllib.loads(model + text)), f"the schema takes {text!r}")
check(not validator.is_valid(tomllib.loads(target + "faces = 7")), "the schema takes no formula")
n_broken = len(broken) + 1
print(f"jsonschema: the schema is sound, {len(files)} model files fit, {n_broken} broken ones do not")
