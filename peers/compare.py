"""Faces, bytes and seconds for an error on the decorative cube, with what users would pick instead.

`make bench-peers` runs it: isospline in tolerance mode, marching cubes (numpy and scikit-image, on a
regular grid) and fidget (manifold dual contouring on an octree), one after another on this machine.
The error is the largest |f| / |grad f| over the samples of every triangle, or isospline's own check,
over the diagonal of the surface's box. Where a peer would need more memory or time than it is
given, triangles are extrapolated by its measured order and marked with *.
"""

import json
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
from skimage.measure import marching_cubes

A_SQ, B, HALF_SIDE = 0.64, 0.02, 1.18
TOLERANCES = [1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8]
CELLS = [32, 64, 128, 256, 384]
DEPTHS = [5, 6, 7, 8, 9]
# Corners of triangles, coordinates of floats, and indices: what STL's compact kin would store.
BYTES_A_TRIANGLE = 12 * 0.5 + 12


def field(points):
    """Values and gradients, (N,) and (N, 3), of configs/deccube.toml."""
    square = points**2
    value, slope = np.ones(len(points)), np.zeros_like(points)
    for axis in range(3):
        i, j, k = axis, (axis + 1) % 3, (axis + 2) % 3
        ring, height = square[:, i] + square[:, j] - A_SQ, square[:, k] - 1
        factor = ring**2 + height**2
        own = np.zeros_like(points)
        own[:, i] = 4 * ring * points[:, i]
        own[:, j] = 4 * ring * points[:, j]
        own[:, k] = 4 * height * points[:, k]
        slope = slope * factor[:, None] + own * value[:, None]
        value = value * factor
    return value - B, slope


def error(vertices, triangles):
    """Largest distance over the diagonal, at a barycentric grid of 15 places a triangle."""
    largest = 0.0
    steps = [(i, j, 4 - i - j) for i in range(5) for j in range(5 - i)]
    for part in np.array_split(triangles, len(triangles) // 200_000 + 1):
        corners = vertices[part]
        for weights in steps:
            points = np.tensordot(np.array(weights) / 4, corners, axes=(0, 1))
            value, slope = field(points)
            largest = max(largest, np.max(np.abs(value) / np.linalg.norm(slope, axis=1)))
    return largest / np.linalg.norm(vertices.max(0) - vertices.min(0))


def grid_meshes():
    for cells in CELLS:
        start = time.perf_counter()
        axis = np.linspace(-HALF_SIDE, HALF_SIDE, cells + 1)
        square = axis**2
        x, y, z = square[:, None, None], square[None, :, None], square[None, None, :]
        value = ((x + y - A_SQ) ** 2 + (z - 1) ** 2) * ((y + z - A_SQ) ** 2 + (x - 1) ** 2)
        value *= (z + x - A_SQ) ** 2 + (y - 1) ** 2
        spacing = 3 * (2 * HALF_SIDE / cells,)
        vertices, triangles, _, _ = marching_cubes(value, B, spacing=spacing)
        seconds = time.perf_counter() - start
        yield vertices.astype(float) - HALF_SIDE, triangles, seconds


def octree_meshes(program, folder):
    for depth in DEPTHS:
        path = folder / f"fidget_{depth}.bin"
        ran = subprocess.run([program, str(depth), path], capture_output=True, text=True, check=True)
        data = path.read_bytes()
        n = int.from_bytes(data[:8], "little")
        vertices = np.frombuffer(data, "<f8", 3 * n, 8).reshape(-1, 3)
        triangles = np.frombuffer(data, "<u4", -1, 8 + 24 * n).reshape(-1, 3)
        yield vertices, triangles, float(ran.stdout)
        path.unlink()


def peer(meshes):
    """Error, triangles and seconds of each mesh."""
    return [(error(v, t), len(t), seconds) for v, t, seconds in meshes]


def at(tolerance, found):
    """What a peer needs: its first mesh that is near enough, or an extrapolation; None if its error
    no longer falls."""
    for reached, triangles, seconds in found:
        if reached <= tolerance:
            return f"{triangles:>11} {mega(triangles * BYTES_A_TRIANGLE):>9} {seconds:>8.2f}"
    (e0, n0, _), (e1, n1, s1) = found[-2:]
    order = np.log(e0 / e1) / np.log(n1 / n0)
    if order < 0.5:
        return f"{'never':>11} {'':>9} {'':>8}"
    more = (e1 / tolerance) ** (1 / order)
    bytes_ = n1 * more * BYTES_A_TRIANGLE
    return f"{n1 * more:>10.2g}* {mega(bytes_):>8}* {s1 * more:>7.0f}*"


def mega(size):
    return f"{size / 1e6:.2f} MB" if size < 1e8 else f"{size / 1e9:.2f} GB"


def converted(program, config, tolerance, folder):
    out = folder / f"isospline_{tolerance:g}"
    command = [program, "run", config, "--no-sync", "--out", out]
    start = time.perf_counter()
    ran = subprocess.run(
        [*command, "--set", f"target.tolerance={tolerance:g}"], capture_output=True, text=True
    )
    seconds = time.perf_counter() - start
    check = json.loads((out / "report.json").read_text())["check"]
    reached = "" if ran.returncode == 0 else "  not reached"
    # 15 interior points a patch, its share of 3 points an edge, of the corners.
    bytes_ = check["faces"] * 24 * (15 + 1.5 * 3 + 0.5)
    figures = f"{check['faces']:>8} {mega(bytes_):>9} {seconds:>8.2f}"
    return f"{figures} {check['rel_error_max']:>9.1e}{reached}"


def main():
    isospline, fidget, config, folder = sys.argv[1:]
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    cubes, octree = peer(grid_meshes()), peer(octree_meshes(fidget, folder))
    for name, found in [("marching cubes", cubes), ("fidget", octree)]:
        for reached, triangles, seconds in found:
            print(f"{name:<15} {triangles:>9} triangles {reached:9.1e} {seconds:8.2f} s")
    print(f"\n{'error':>7} | {'isospline: patches, size, s, error':<38} |", end="")
    print(f" {'marching cubes: triangles, size, s':<31} | {'fidget: triangles, size, s':<31}")
    for tolerance in TOLERANCES:
        own = converted(isospline, config, tolerance, folder)
        print(f"{tolerance:7.0e} | {own:<38} | {at(tolerance, cubes)} | {at(tolerance, octree)}")


if __name__ == "__main__":
    main()
