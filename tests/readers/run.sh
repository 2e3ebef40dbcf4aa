#!/usr/bin/env bash
# Proves that programs which share no code with us read every export as it is meant.
#
#   tests/readers/run.sh [DIR]
#
# DIR holds exports, NAME.npz with NAME.vtu, .glb, .obj, .ply and .stl beside it. Without DIR they
# are made: a sample of two pieces, and models converted by target/release/isospline. The readers
# are installed into .venv; where that cannot be, the script says so and is content, but under
# CI=true it fails.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../.." && pwd)
python="$root/.venv/bin/python"
modules="numpy, trimesh, vtkmodules.vtkIOXML"

skip() {
    echo "foreign readers: skipped vtk, trimesh and numpy ($1)"
    if [ "${CI:-}" = true ]; then exit 1; fi
    exit 0
}

install() {
    command -v python3 >/dev/null || skip "no python3"
    python3 -m venv "$root/.venv" >/dev/null 2>&1 || skip "python3 cannot make a venv"
    "$python" -m pip install --quiet --disable-pip-version-check \
        -r "$here/requirements.txt" || skip "pip cannot install them"
    "$python" -c "import $modules" || skip "they do not start"
}

make_exports() {
    "${CARGO:-cargo}" run --quiet --release -p isospline-export --example sample_exports -- "$1"
    local isospline="${CARGO_TARGET_DIR:-$root/target}/release/isospline"
    [ -x "$isospline" ] || { echo "foreign readers: build target/release/isospline first"; exit 1; }
    for model in sphere_80 torus_regular; do
        "$isospline" run "$root/configs/$model.toml" --out "$1/$model" >"$1/$model.log" 2>&1 ||
            { cat "$1/$model.log"; exit 1; }
        for format in npz vtu glb obj ply stl; do
            "$isospline" export "$1/$model" --format "$format" -o "$1/$model.$format" >/dev/null
        done
    done
}

"$python" -c "import $modules" >/dev/null 2>&1 || install
dir=${1:-}
if [ -z "$dir" ]; then
    dir=$(mktemp -d)
    trap 'rm -rf "$dir"' EXIT
    cd "$root"
    make_exports "$dir"
fi
"$python" "$here/npz.py" "$dir"
"$python" "$here/vtu.py" "$dir"
"$python" "$here/meshes.py" "$dir"
