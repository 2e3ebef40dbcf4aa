"""Decimation of one large mesh, beside open3d: time, error, and whether the result is a manifold.

`make bench-decimate` runs it. Both take the same triangles, those that polygonize makes of the
decorative cube, down to FACES; the error is that of compare.py, over the diagonal. isospline's time
is that of its stage, reading and writing included, open3d's that of the call.
"""

import json
import struct
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import open3d
from compare import error

FACES = 5000
# Cells a side: a fifth and near a whole million triangles.
CELLS = [136, 304]
REPEATS = 3


def text(data, at):
    (length,) = struct.unpack_from("<Q", data, at)
    return data[at + 8 : at + 8 + length].decode(), at + 8 + length


def mesh(path):
    """Vertices and triangles of a mesh artifact, by FORMAT.md."""
    data = path.read_bytes()
    _, at = text(data, 24)
    _, at = text(data, at + 4)
    at += 4 + 32 + 32
    (n_sections,) = struct.unpack_from("<Q", data, at)
    at, found = at + 8, {}
    for _ in range(n_sections):
        name, at = text(data, at)
        _, rows, offset, _ = struct.unpack_from("<IQQI", data, at)
        found[name] = (rows, offset)
        at += 24
    (n, vertices), (m, faces) = found["position"], found["face"]
    return (
        np.frombuffer(data, "<f8", 3 * n, vertices).reshape(n, 3).copy(),
        np.frombuffer(data, "<i4", 3 * m, faces).reshape(m, 3).copy(),
    )


def edges_without_two_faces(triangles):
    sides = [triangles[:, [k, (k + 1) % 3]] for k in range(3)]
    _, counts = np.unique(np.sort(np.concatenate(sides)), axis=0, return_counts=True)
    return int(np.sum(counts != 2))


def row(name, n_in, seconds, vertices, triangles):
    n_vertices = len(np.unique(triangles))
    euler = n_vertices - len(triangles) // 2
    print(
        f"| {n_in} | {name} | {len(triangles)} | {seconds:.3f} | {n_in / seconds / 1e6:.2f} "
        f"| {error(vertices, triangles):.1e} | {edges_without_two_faces(triangles)} | {euler} |",
        flush=True,
    )


def by_isospline(isospline, config, out, threads):
    (out / "03-decimate.isos").unlink(missing_ok=True)
    command = ["stage", "decimate", config, "--out", out, "--no-sync", "--threads", str(threads)]
    subprocess.run([isospline, *command, *settings(out)], check=True, capture_output=True)
    return json.loads((out / "03-decimate.json").read_text())["cost"]["seconds"]


def settings(out):
    keys = [f"target.faces={FACES}", "target.fit=paper", f"polygonize.cells={out.name}"]
    return [word for key in keys for word in ("--set", key)]


def by_open3d(vertices, triangles):
    points = open3d.utility.Vector3dVector(vertices)
    mesh = open3d.geometry.TriangleMesh(points, open3d.utility.Vector3iVector(triangles))
    start = time.perf_counter()
    made = mesh.simplify_quadric_decimation(FACES)
    return time.perf_counter() - start, np.asarray(made.vertices), np.asarray(made.triangles)


def main(isospline, config, folder):
    heads = ["in", "by", "out", "seconds", "million/s", "error", "edges without 2 faces", "Euler"]
    print("|", " | ".join(heads), "|")
    print("|---" * len(heads) + "|")
    for cells in CELLS:
        out = Path(folder) / str(cells)
        first = ["stage", "polygonize", config, "--out", out, "--no-sync", *settings(out)]
        subprocess.run([isospline, *first], check=True, capture_output=True)
        vertices, triangles = mesh(out / "02-polygonize.isos")
        for threads in (1, 2):
            seconds = min(by_isospline(isospline, config, out, threads) for _ in range(REPEATS))
            made = mesh(out / "03-decimate.isos")
            row(f"isospline, threads {threads}", len(triangles), seconds, *made)
        seconds, *made = by_open3d(vertices, triangles)
        row("open3d", len(triangles), seconds, *made)


if __name__ == "__main__":
    main(*sys.argv[1:])
