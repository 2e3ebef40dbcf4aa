"""Judges what three.js drew of GLB files: outline and shading as the patches themselves have them.

Brightness under a far light and parallel rays is a function of the normal. So it is fitted by a
polynomial in the exact normals of the patches: what is left over is what facets, wrong normals or
cracks add. Damaged files must each be found, by the sign that belongs to their damage.
"""

import functools
import json

import numpy as np

from surface import bernstein, check, slopes, surfaces

BACKGROUND = (255, 0, 255)
# Levels of 255. Rounding to whole levels leaves 0.3 of some 0.5; facets at the default tolerance
# leave 1.7.
MOST_UNEVEN = 0.8
# No point that is seen is darker; the ambient light alone gives 60.
BLACK = 30
# Where the surface faces the sun it is brighter.
LIT = 160
# Part of the pixels seen that may be astray; a border three pixels wide is not judged.
MOST_ASTRAY = 0.002
# The samples of export/sample.rs: their patches meet at an angle, which is to be seen.
CREASED = {"sample", "hollow", "sextic"}
# By which sign each damage is found.
DAMAGES = {
    "facets": "uneven",
    "no_normals": "uneven",
    "turned": "unlit",
    "metal": "dark",
    "holes": "outline",
}


class Drawing:
    """The pixels of one picture, and where the camera stood."""

    def __init__(self, path):
        frame = json.loads(path.with_name(path.name + ".json").read_text())
        self.size, self.half = frame["size"], frame["half"]
        self.center, self.axes = np.array(frame["center"]), np.array(frame["axes"])
        self.sun = self.axes @ frame["sun"]
        data = np.fromfile(path.with_name(path.name + ".rgba"), dtype=np.uint8)
        # Rows of WebGL run upward.
        self.rgb = data.reshape(self.size, self.size, 4)[::-1, :, :3]
        self.is_drawn = (self.rgb != BACKGROUND).any(axis=2)
        self.brightness = self.rgb.astype(float).mean(axis=2)


class Truth:
    """What the patches themselves show to a camera: the outline, and the normal at each pixel."""

    def __init__(self, surface, drawing):
        size = drawing.size
        self.depth = np.full(size * size, -np.inf)
        for pixels, depth, _ in seen_points(surface, drawing):
            np.maximum.at(self.depth, pixels, depth)
        # The mean over a pixel of what is in front stands for its middle.
        pixel = 2 * drawing.half / size
        in_front = self.depth - 4 * pixel
        self.normals = np.zeros((size * size, 3))
        for pixels, depth, normals in seen_points(surface, drawing):
            is_seen = depth >= in_front[pixels]
            np.add.at(self.normals, pixels[is_seen], normals[is_seen])
        length = np.linalg.norm(self.normals, axis=1, keepdims=True)
        self.normals = (self.normals / np.maximum(length, 1e-300)).reshape(size, size, 3)
        self.is_covered = np.isfinite(self.depth).reshape(size, size)


def seen_points(surface, drawing):
    """Pixels, depths and unit normals of points of each patch, two a pixel along its sides."""
    scale = drawing.size / 2 / drawing.half
    lengths = np.linalg.norm(surface.nets[:, 1:] - surface.nets[:, :1], axis=2).max(axis=1)
    for net, length in zip(surface.nets, lengths):
        values, *directions = grid(int(np.ceil(2 * scale * length)), surface.degree)
        net = (net - drawing.center) @ drawing.axes.T
        position, along, across = values @ net, directions[0] @ net, directions[1] @ net
        columns = np.floor(drawing.size / 2 + scale * position[:, 0]).astype(int)
        rows = np.floor(drawing.size / 2 - scale * position[:, 1]).astype(int)
        normals = np.cross(along, across)
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        yield rows * drawing.size + columns, position[:, 2], normals


@functools.cache
def grid(steps, degree):
    """Bernstein values and slopes at the points of a triangular grid."""
    places = [(i, j, steps - i - j) for i in range(steps + 1) for j in range(steps + 1 - i)]
    points = np.array(places) / steps
    return bernstein(points, degree), slopes(points, 1, degree), slopes(points, 2, degree)


def around(mask, join):
    """Joins each pixel of a mask with its eight neighbours."""
    wide = np.pad(mask, 1)
    rows, columns = mask.shape
    shifted = [wide[r : r + rows, c : c + columns] for r in range(3) for c in range(3)]
    return join.reduce(shifted)


def unevenness(drawing, truth):
    """Root mean square of what exact normals do not explain of the brightness, in levels."""
    inside = around(truth.is_covered & drawing.is_drawn, np.logical_and)
    # Where the surface turns away a pixel spans many normals.
    inside &= truth.normals[:, :, 2] > 0.5
    x, y, z = truth.normals[inside].T
    powers = [x**a * y**b * z**c for c in (0, 1) for a in range(8) for b in range(8 - a)]
    basis = np.stack(powers, axis=1)
    brightness = drawing.brightness[inside]
    fit = np.linalg.lstsq(basis, brightness, rcond=None)[0]
    return float(np.sqrt(np.mean((basis @ fit - brightness) ** 2)))


def judge(drawing, truth):
    """What is wrong, by name; and the figures."""
    edge = around(truth.is_covered, np.logical_or) & ~around(truth.is_covered, np.logical_and)
    astray = (drawing.is_drawn != truth.is_covered) & ~edge
    share = astray.sum() / truth.is_covered.sum()
    border = (drawing.is_drawn ^ truth.is_covered).sum() / truth.is_covered.sum()
    inside = around(truth.is_covered, np.logical_and) & drawing.is_drawn
    darkest = float(drawing.brightness[inside].min()) if inside.any() else 0.0
    lit = float(drawing.brightness[inside & (truth.normals @ drawing.sun > 0.9)].mean())
    uneven = unevenness(drawing, truth)
    found = {
        "outline": share > MOST_ASTRAY,
        "dark": darkest < BLACK,
        "unlit": not lit > LIT,
        "uneven": uneven > MOST_UNEVEN,
    }
    figures = f"{drawing.is_drawn.mean():.1%} drawn, {border:.1%} off the patches' outline, "
    figures += f"brightness from {darkest:.0f} to {lit:.0f} of 255, uneven by {uneven:.2f}"
    return {name for name, is_so in found.items() if is_so}, figures


def look_at(surface):
    """Judges one file, and its damaged forms where they were drawn."""
    path, stem = surface.path, surface.path.stem
    drawing = Drawing(path.with_name(f"{stem}.none"))
    truth = Truth(surface, drawing)
    wrong, figures = judge(drawing, truth)
    expected = {"uneven"} if stem in CREASED else set()
    check(wrong == expected, f"three.js: {stem}.glb: {', '.join(sorted(wrong))}: {figures}")
    creased = ", as patches that meet at an angle are" if stem in CREASED else ""
    print(f"three.js: {stem}.glb: {figures}{creased}")
    if not path.with_name(f"{stem}.holes.rgba").exists():
        return
    for damage, sign in DAMAGES.items():
        wrong, figures = judge(Drawing(path.with_name(f"{stem}.{damage}")), truth)
        check(sign in wrong, f"three.js: {stem}.glb with {damage} passes: {figures}")
    print(f"three.js: {stem}.glb with {', '.join(DAMAGES)}: each refused")


for one in surfaces():
    look_at(one)
