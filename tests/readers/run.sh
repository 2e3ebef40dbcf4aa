#!/usr/bin/env bash
# Proves that programs which share no code with us read every export as it is meant.
#
#   tests/readers/run.sh [DIR]
#
# DIR holds exports, NAME.npz with NAME.<extension> of every other format beside it. Without DIR
# they are made: samples of several pieces, one within another, and models converted by
# target/release/isospline. The readers (1.4 GB) are installed into .venv; where one cannot be, the
# script says so in a line and goes on without it, but under CI=true it fails.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../.." && pwd)
python="$root/.venv/bin/python"
node_home="$root/.venv/node"

skip() {
    echo "foreign readers: skipped $1 ($2)"
    if [ "${CI:-}" = true ]; then exit 1; fi
}

# What a script needs, and what its readers are called.
needs() {
    case $1 in
        npz | bv | glb_picture) echo "numpy numpy" ;;
        vtu) echo "vtk vtkmodules.vtkIOXML" ;;
        meshes) echo "trimesh,manifold3d,vtk trimesh manifold3d vtkmodules.vtkFiltersCore" ;;
        step) echo "occt OCP.STEPControl" ;;
        volume_mesh | msh) echo "gmsh gmsh" ;;
        tolerance) echo "vtk vtkmodules.vtkIOPLY" ;;
        printing) echo "lib3mf lib3mf" ;;
        schema) echo "jsonschema jsonschema tomllib" ;;
    esac
}

install() {
    command -v python3 >/dev/null || return 0
    [ -x "$python" ] || python3 -m venv "$root/.venv" >/dev/null 2>&1 || return 0
    # All at once or, where one of them has no build for this machine, each that has.
    "$python" -m pip install --quiet --disable-pip-version-check -r "$here/requirements.txt" ||
        while read -r requirement; do
            "$python" -m pip install --quiet --disable-pip-version-check "$requirement" || true
        done <"$here/requirements.txt"
}

install_node_readers() {
    command -v npm >/dev/null || return 0
    npm install --silent --no-audit --no-fund --prefix "$node_home" \
        gltf-validator@2.0.0-dev.3.10 three@0.187.0 >/dev/null 2>&1 || true
}

has_node_reader() { [ -d "$node_home/node_modules/$1" ]; }

make_exports() {
    "${CARGO:-cargo}" run --quiet --release -p isospline-export --example sample_exports -- "$1"
    local isospline="${CARGO_TARGET_DIR:-$root/target}/release/isospline"
    [ -x "$isospline" ] || { echo "foreign readers: build target/release/isospline first"; exit 1; }
    convert() {
        "$isospline" run "$root/configs/$1.toml" --set "$3" --out "$2" >"$2.log" 2>&1 ||
            { cat "$2.log"; exit 1; }
    }
    convert sphere_80 "$1/sphere_80" target.fit=paper
    convert torus_regular "$1/torus_regular" target.fit=paper
    convert sphere_80 "$1/sphere_80_sextic" relax.degree=6
    for model in sphere_80 torus_regular sphere_80_sextic; do
        for format in npz vtu msh bv step glb obj ply stl 3mf; do
            "$isospline" export "$1/$model" --format "$format" -o "$1/$model.$format" >/dev/null
        done
        "$isospline" lint "$1/$model.step" | sed "s/^/isospline lint: $model.step: /"
    done
    "$isospline" schema >"$1/isospline.schema.json"
}

read_with() {
    local script=$1 readers modules
    read -r readers modules <<<"$(needs "$script")"
    for module in $modules; do
        "$python" -c "import $module" >/dev/null 2>&1 || { skip "$readers" "no module $module"; return; }
    done
    "$python" "$here/$script.py" "$dir"
}

scripts="npz bv vtu tolerance meshes printing step volume_mesh msh schema"
for script in $scripts; do
    read -r _ modules <<<"$(needs "$script")"
    for module in $modules; do
        "$python" -c "import $module" >/dev/null 2>&1 || { install; break 2; }
    done
done
{ has_node_reader gltf-validator && has_node_reader three; } || install_node_readers
dir=${1:-}
if [ -z "$dir" ]; then
    dir=$(mktemp -d)
    trap 'rm -rf "$dir"' EXIT
    cd "$root"
    make_exports "$dir"
fi
for script in $scripts; do read_with "$script"; done
if has_node_reader gltf-validator; then
    NODE_PATH="$node_home/node_modules" node "$here/gltf.js" "$dir"
else
    skip gltf-validator "npm cannot install it"
fi
browser=$(command -v chromium || command -v chromium-browser || command -v google-chrome || true)
if [ -z "$browser" ]; then
    skip three.js "no chromium"
elif has_node_reader three; then
    NODE_PATH="$node_home/node_modules" node "$here/glb_draw.js" "$dir" "$browser"
    read_with glb_picture
else
    skip three.js "npm cannot install it"
fi
