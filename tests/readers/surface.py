"""Reads npz exports with numpy alone and evaluates their patches: the yardstick of the readers."""

import pathlib
import sys

import numpy as np

# Degree of patches of so many control points.
DEGREES = {28: 6, 36: 7}
FACTORIAL = [1, 1, 2, 6, 24, 120, 720, 5040]


def exponents_of(degree):
    """Exponents (i, j, k) of the control points in storage order: i descends, then j."""
    return [(degree - r, r - k, k) for r in range(degree + 1) for k in range(r + 1)]


class Surface:
    """The arrays of one npz export."""

    def __init__(self, path):
        self.path = path
        with np.load(path) as arrays:
            self.vertices = arrays["vertices"]
            self.faces = arrays["faces"]
            self.nets = arrays["control_points"]
            self.degree = int(arrays["degree"])

    def beside(self, extension):
        """Path of the same surface in another format."""
        return self.path.with_suffix("." + extension)

    def half_edges(self):
        """Maps each directed edge (a, b) to its (face, corner); fails if one occurs twice."""
        found = {}
        for f, face in enumerate(self.faces.tolist()):
            for corner in range(3):
                edge = (face[corner], face[(corner + 1) % 3])
                check(edge not in found, f"edge {edge} runs twice in one direction")
                found[edge] = (f, corner)
        return found

    def components(self):
        """The faces of each connected part, in the order of their first faces."""
        part = np.arange(len(self.vertices))
        while True:
            lowest = part[self.faces].min(axis=1)
            before = part.copy()
            for corner in range(3):
                np.minimum.at(part, self.faces[:, corner], lowest)
            if np.array_equal(part, before):
                break
        of_face = part[self.faces[:, 0]]
        return [np.flatnonzero(of_face == p) for p in dict.fromkeys(of_face.tolist())]

    def component_volumes(self):
        """Volume of each component, negative for a hole: exact but for rounding."""
        return [volume(self.nets[faces]) for faces in self.components()]

    def euler_characteristic(self):
        """V - E + F of a closed surface, where E = 3F / 2."""
        return len(self.vertices) - 3 * len(self.faces) // 2 + len(self.faces)


def bernstein(points, degree):
    """Bernstein values (n, 28 or 36) at barycentric points (n, 3)."""
    u, v, w = np.asarray(points, dtype=float).T
    columns = []
    for i, j, k in exponents_of(degree):
        multinomial = FACTORIAL[degree] // (FACTORIAL[i] * FACTORIAL[j] * FACTORIAL[k])
        columns.append(multinomial * u**i * v**j * w**k)
    return np.stack(columns, axis=1)


def volume(nets):
    """Signed volume within patches (n, points, 3): Gauss integration of the flux, exact to degree 26."""
    degree = DEGREES[nets.shape[1]]
    nodes, weights = np.polynomial.legendre.leggauss(14)
    a, b = np.meshgrid((nodes + 1) / 2, (nodes + 1) / 2, indexing="ij")
    a, b = a.ravel(), b.ravel()
    # The square collapsed into the triangle.
    weight = np.outer(weights, weights).ravel() / 4 * (1 - a)
    points = np.stack([a, (1 - a) * (1 - b), (1 - a) * b], axis=1)
    values = bernstein(points, degree)
    along, across = (slopes(points, corner, degree) for corner in (1, 2))
    nets = nets - nets[0, 0]
    position, du, dv = (np.einsum("pc,fcx->fpx", basis, nets) for basis in (values, along, across))
    return np.einsum("p,fpx,fpx->", weight, position, np.cross(du, dv)) / 3


def slopes(points, corner, degree):
    """Derivatives (n, 28 or 36) of the Bernstein polynomials from corner 0 towards `corner`."""
    powers = np.asarray(points, dtype=float)
    columns = []
    for exponents in exponents_of(degree):
        factor = FACTORIAL[degree] / np.prod([FACTORIAL[e] for e in exponents])
        column = 0
        for k, sign in ((corner, 1), (0, -1)):
            if exponents[k] > 0:
                lowered = np.array(exponents) - np.eye(3, dtype=int)[k]
                column = column + sign * exponents[k] * np.prod(powers**lowered, axis=1)
        columns.append(factor * column * np.ones(len(powers)))
    return np.stack(columns, axis=1)


def boundary(corner, degree):
    """Storage indices of the control points from `corner` to the next one."""
    out = []
    for s in range(degree + 1):
        exponents = [0, 0, 0]
        exponents[corner] = degree - s
        exponents[(corner + 1) % 3] = s
        out.append(exponents_of(degree).index(tuple(exponents)))
    return out


def check(condition, message):
    """Ends the script with `message` unless `condition` holds."""
    if not condition:
        sys.exit("FAILED: " + message)


def surfaces():
    """All npz exports in the folder named on the command line; none is a failure."""
    folder = pathlib.Path(sys.argv[1])
    found = [Surface(path) for path in sorted(folder.glob("*.npz"))]
    check(found, f"no npz file in {folder}")
    return found
