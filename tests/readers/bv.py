"""Proves that BezierView text, read by its published format alone, gives the patches' own nets.

The format [https://www.cise.ufl.edu/research/SurfLab/bview]: a group has a line `Group NUMBER
NAME`, each of its patches a kind; kind 3 goes on with a degree and the control points by rows that
rise from the base, so that the last point is the apex. No program that reads it can be installed
here.
"""

import numpy as np

from surface import bernstein, check, exponents_of, surfaces

TOTAL_DEGREE_PATCH = "3"


def patches(path):
    """Control points [n][rows from the base, each from left to right] of every patch of a file."""
    words = iter(path.read_text(encoding="ascii").split())
    found = []
    for word in words:
        if word == "Group":
            check(next(words).isdigit(), f"{path.name}: a group without a number")
            next(words)  # its name
            continue
        check(word == TOTAL_DEGREE_PATCH, f"{path.name}: a patch of kind {word}")
        degree = int(next(words))
        widths = range(degree + 1, 0, -1)
        point = lambda: [float(next(words)) for _ in range(3)]
        found.append([[point() for _ in range(width)] for width in widths])
    return found


def order(n):
    """Storage indices of the points in the file: the base runs from corner 0 to corner 1, the apex
    is corner 2."""
    places = [(n - row - step, step, row) for row in range(n + 1) for step in range(n + 1 - row)]
    return [exponents_of(n).index(place) for place in places]


for surface in surfaces():
    path = surface.beside("bv")
    read = patches(path)
    check(len(read) == len(surface.faces), f"{path.name}: {len(read)} patches")
    degree = surface.degree
    check(all(len(rows) == degree + 1 for rows in read), f"{path.name}: another degree")
    # A point of each patch that no symmetry of the triangle moves onto itself.
    at = bernstein([[0.5, 0.3, 0.2]], degree)
    points = np.array([[point for row in rows for point in row] for rows in read])
    nets = np.empty_like(points)
    nets[:, order(degree)] = points
    agree = np.array_equal(nets.view(np.uint64), surface.nets.view(np.uint64))
    check(agree, f"{path.name}: control points are not those of the npz")
    # The file's own reading, by de Casteljau on its rows, against the polynomials of the npz.
    for rows, expected in zip(read[::7], (at @ surface.nets)[::7, 0]):
        rows = [np.array(row) for row in rows]
        while len(rows) > 1:
            rows = [
                0.5 * here[:-1] + 0.3 * here[1:] + 0.2 * above
                for here, above in zip(rows, rows[1:])
            ]
        off = np.linalg.norm(rows[0][0] - expected)
        check(off < 1e-13, f"{path.name}: a point is {off:.1e} off")
    print(f"bview format: {path.name}: {len(read)} patches, control points equal in all bits")
