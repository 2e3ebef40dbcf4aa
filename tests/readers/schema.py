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
for broken in ("[target]\nface = 7", "[target]\nfaces = 3", "level = '0'", "[decimat]\nspread = 1"):
    check(not validator.is_valid(tomllib.loads(model + broken)), f"the schema takes {broken!r}")
print(f"jsonschema: the schema is sound, {len(files)} model files fit, 4 broken ones do not")
