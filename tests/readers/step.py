"""Proves that OCCT takes every STEP file for valid closed solids of our volume, and cuts them."""

import re

from OCP.BRepAlgoAPI import BRepAlgoAPI_Common, BRepAlgoAPI_Cut
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.BRepGProp import BRepGProp
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox
from OCP.GProp import GProp_GProps
from OCP.IFSelect import IFSelect_ReturnStatus
from OCP.Message import Message, Message_Gravity
from OCP.STEPControl import STEPControl_Reader
from OCP.ShapeAnalysis import ShapeAnalysis_ShapeTolerance
from OCP.TopAbs import TopAbs_ShapeEnum as Kind
from OCP.TopExp import TopExp_Explorer
from OCP.gp import gp_Pnt

from surface import check, surfaces

# Millimetres: what OCCT itself takes two points to be one at is 1e-7.
TOLERANCE = 1e-6
VOLUME = 1e-10
# The curves of a cut are found to about 1e-7 of the model.
CUT_VOLUME = 1e-6
# OCCT takes seconds for a hundred patches.
CUT_PATCHES = 400


def parts(shape, kind):
    """All sub-shapes of a kind."""
    explorer, found = TopExp_Explorer(shape, kind), []
    while explorer.More():
        found.append(explorer.Current())
        explorer.Next()
    return found


def volume(shape):
    """Volume as OCCT integrates it."""
    properties = GProp_GProps()
    BRepGProp.VolumeProperties_s(shape, properties, 1e-12)
    return properties.Mass()


def read(path):
    """The shape in a STEP file."""
    reader = STEPControl_Reader()
    check(reader.ReadFile(str(path)) == IFSelect_ReturnStatus.IFSelect_RetDone, f"{path.name}: not read")
    reader.TransferRoots()
    return reader.OneShape()


def require_solid(path, surface):
    """Valid, closed, tight, and as large as the patches; returns the shape and a verdict."""
    shape = read(path)
    check(BRepCheck_Analyzer(shape).IsValid(), f"{path.name}: OCCT finds it invalid")
    solids, shells = parts(shape, Kind.TopAbs_SOLID), parts(shape, Kind.TopAbs_SHELL)
    expected = surface.component_volumes()
    check(len(shells) == len(expected), f"{path.name}: {len(shells)} shells of {len(expected)}")
    n_solids = sum(v > 0 for v in expected)
    check(len(solids) == n_solids, f"{path.name}: {len(solids)} solids of {n_solids}")
    check(all(shell.Closed() for shell in shells), f"{path.name}: a shell is open")
    per_face = 1 if ".compact" in path.name else 3
    n_faces = len(parts(shape, Kind.TopAbs_FACE))
    check(n_faces == per_face * len(surface.faces), f"{path.name}: {n_faces} faces")
    tolerance = ShapeAnalysis_ShapeTolerance().Tolerance(shape, 1)
    check(tolerance <= TOLERANCE, f"{path.name}: tolerance {tolerance:.1e}")
    found, stated, ours = volume(shape), stated_volume(path), sum(expected)
    worst = max(abs(found - ours), abs(stated - ours)) / abs(ours)
    check(worst <= VOLUME, f"{path.name}: OCCT {found}, stated {stated}, patches {ours}")
    verdict = f"valid, {n_solids} solids, {len(shells)} closed shells, {n_faces} faces"
    return shape, f"{verdict}, tolerance {tolerance:.1e}, volume within {worst:.0e}"


def stated_volume(path):
    """The volume among the validation properties."""
    return float(re.search(r"VOLUME_MEASURE\(([^)]*)\)", path.read_text()).group(1))


def cut(path, shape, surface):
    """A box that takes a part away; what goes and what stays make the whole."""
    low, high = surface.vertices.min(axis=0), surface.vertices.max(axis=0)
    margin = (high - low).max()
    # No symmetry of a model puts this plane through vertices or along edges.
    end = high + margin
    end[0] = low[0] + 0.337 * (high[0] - low[0])
    corners = (low - margin).tolist(), end.tolist()
    tool = BRepPrimAPI_MakeBox(*(gp_Pnt(*corner) for corner in corners)).Shape()
    operations = BRepAlgoAPI_Cut(shape, tool), BRepAlgoAPI_Common(shape, tool)
    for operation in operations:
        check(operation.IsDone(), f"{path.name}: the cut fails")
        check(BRepCheck_Analyzer(operation.Shape()).IsValid(), f"{path.name}: the cut is invalid")
    stays, goes = (volume(operation.Shape()) for operation in operations)
    whole = volume(shape)
    check(stays > 0 and goes > 0, f"{path.name}: cut into {stays} and {goes}")
    off = abs(stays + goes - whole) / whole
    check(off <= CUT_VOLUME, f"{path.name}: {stays} + {goes} is {off:.1e} off {whole}")
    return f"cut into {stays / whole:.4f} + {goes / whole:.4f}, off by {off:.0e}"


Message.DefaultMessenger_s().ChangePrinters().Clear()
for surface in surfaces():
    paths = [surface.beside("step"), *sorted(surface.path.parent.glob(surface.path.stem + ".*.step"))]
    for path in paths:
        shape, verdict = require_solid(path, surface)
        if path == paths[0] and len(surface.faces) <= CUT_PATCHES:
            verdict += "; " + cut(path, shape, surface)
        print(f"occt: {path.name}: {verdict}")
