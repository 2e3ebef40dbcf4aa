"""Proves that trimesh, manifold3d and VTK find the triangle meshes closed, of the right topology
and of one volume."""

import json
import struct

import manifold3d
import numpy as np
import trimesh
from vtkmodules.vtkFiltersCore import vtkFeatureEdges, vtkMassProperties
from vtkmodules.vtkIOPLY import vtkPLYReader

from surface import check, surfaces

# Part of the volume that chords may cut off.
CHORDS = 0.01


def require_closed(name, mesh, surface):
    """Watertight, consistently wound, outward, and with the Euler number of the patches."""
    check(mesh.is_watertight, f"{name}: not watertight")
    check(mesh.is_winding_consistent, f"{name}: winding is not consistent")
    check(mesh.volume > 0, f"{name}: volume {mesh.volume}")
    expected = surface.euler_characteristic()
    check(mesh.euler_number == expected, f"{name}: Euler number {mesh.euler_number}")


def require_gltf(path):
    """The material does not render black; stored normals are unit and look where faces do."""
    data = path.read_bytes()
    (length,) = struct.unpack_from("<I", data, 12)
    tree, binary = json.loads(data[20 : 20 + length]), data[28 + length :]

    def rows(accessor, dtype):
        accessor = tree["accessors"][accessor]
        view = tree["bufferViews"][accessor["bufferView"]]
        flat = np.frombuffer(binary, dtype, view["byteLength"] // 4, view["byteOffset"])
        return flat.reshape(-1, 3)

    (primitive,) = tree["meshes"][0]["primitives"]
    factor = tree["materials"][primitive["material"]]["pbrMetallicRoughness"]["metallicFactor"]
    # A metal without surroundings renders black.
    check(factor == 0, f"{path.name}: metallicFactor {factor}")
    positions = rows(primitive["attributes"]["POSITION"], "<f4").astype(float)
    normals = rows(primitive["attributes"]["NORMAL"], "<f4").astype(float)
    faces = rows(primitive["indices"], "<u4")
    stated = tree["accessors"][primitive["attributes"]["POSITION"]]
    check(np.array_equal(positions.min(axis=0), stated["min"]), f"{path.name}: min")
    check(np.array_equal(positions.max(axis=0), stated["max"]), f"{path.name}: max")
    lengths = np.linalg.norm(normals, axis=1)
    check(np.abs(lengths - 1).max() < 1e-6, f"{path.name}: normals are not of unit length")
    a, b, c = (positions[faces[:, k]] for k in range(3))
    facing = np.einsum("fcx,fx->fc", normals[faces], np.cross(b - a, c - a))
    check((facing > 0).all(), f"{path.name}: {(facing <= 0).sum()} normals look inward")


def require_manifold(path, surface):
    """The components by manifold3d: as many, and together of the Euler number of the patches."""
    mesh = trimesh.load(path, force="mesh", process=False)
    triangles = np.asarray(mesh.faces, dtype=np.uint64)
    solid = manifold3d.Manifold(manifold3d.Mesh64(np.asarray(mesh.vertices), triangles))
    check(solid.status() == manifold3d.Error.NoError, f"{path.name}: manifold3d: {solid.status()}")
    parts = solid.decompose()
    expected = surface.component_volumes()
    check(len(parts) == len(expected), f"{path.name}: manifold3d finds {len(parts)} parts")
    euler = sum(2 - 2 * part.genus() for part in parts)
    check(euler == surface.euler_characteristic(), f"{path.name}: manifold3d: Euler number {euler}")
    return solid.volume()


def require_vtk(path):
    """No edge with one or three triangles by VTK; returns the volume."""
    reader = vtkPLYReader()
    reader.SetFileName(str(path))
    edges = vtkFeatureEdges()
    edges.SetInputConnection(reader.GetOutputPort())
    edges.FeatureEdgesOff()
    edges.ManifoldEdgesOff()
    edges.Update()
    n_open = edges.GetOutput().GetNumberOfCells()
    check(n_open == 0, f"{path.name}: VTK finds {n_open} open or branching edges")
    mass = vtkMassProperties()
    mass.SetInputConnection(reader.GetOutputPort())
    mass.Update()
    return mass.GetVolume()


for surface in surfaces():
    volumes = []
    for extension in ["glb", "obj", "ply", "stl"]:
        path = surface.beside(extension)
        # An STL is a soup by nature; the others must be welded as they are.
        is_soup = extension == "stl"
        mesh = trimesh.load(path, force="mesh", process=is_soup)
        require_closed(path.name, mesh, surface)
        volumes.append(mesh.volume)
    require_gltf(surface.beside("glb"))
    volumes += [require_manifold(surface.beside("ply"), surface), require_vtk(surface.beside("ply"))]
    exact = sum(surface.component_volumes())
    off = abs(volumes[0] - exact) / exact
    check(off < CHORDS, f"{surface.path.stem}: the triangles hold {volumes[0]} of {exact}")
    spread = np.ptp(volumes) / volumes[0]
    check(spread < 1e-6, f"{surface.path.stem}: volumes differ by {spread:.1e}")
    exact = trimesh.load(surface.beside("ply"), force="mesh", process=False).vertices
    n_vertices = len(surface.vertices)
    same = np.array_equal(exact[:n_vertices].view("u8"), surface.vertices.view("u8"))
    check(same, f"{surface.path.stem}: vertices of the PLY differ in bits")
    euler = surface.euler_characteristic()
    print(
        f"trimesh, manifold3d, vtk: {surface.path.stem}: glb obj ply stl closed, Euler number {euler}, "
        f"volumes agree to {spread:.0e}, {off:.0e} off the patches"
    )
