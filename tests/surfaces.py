"""Small surfaces with known answers, for the tests of the stages that texture them."""

from __future__ import annotations

import itertools

import numpy as np

from tourgen.geometry import Float32, Mesh, OrientedCloud, PointCloud, UInt8


def mesh(vertices: object, faces: object) -> Mesh:
    return Mesh(np.zeros(3), np.asarray(vertices, np.float32), np.asarray(faces, np.int32))


def sheet(width_m: float, height_m: float, cells: int, noise_m: float = 0.0, seed: int = 0) -> Mesh:
    """A rectangle in z = 0 that looks up, of ``cells`` x ``cells`` squares, rough by noise."""
    x, y = np.meshgrid(np.linspace(0, width_m, cells + 1), np.linspace(0, height_m, cells + 1))
    z = np.random.default_rng(seed).normal(0, noise_m, x.shape) if noise_m else np.zeros_like(x)
    at = np.arange((cells + 1) ** 2).reshape(cells + 1, cells + 1)
    a, b, c, d = at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]
    faces = np.concatenate(
        [np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)]
    )
    return mesh(np.stack([x, y, z], -1).reshape(-1, 3), faces)


def box_room(size_m: float, cells: int, noise_m: float, seed: int = 0) -> Mesh:
    """A cube seen from within, its six walls joined, rough by noise."""
    vertices, faces, base = [], [], 0
    for axis, side in itertools.product(range(3), (0, 1)):
        flat = sheet(1, 1, cells)
        wall = flat.vertices - 0.5
        wall[:, 2] = 0.5
        turned = np.roll(wall, axis + 1, axis=1) * (1 if side else -1)
        corner = flat.faces[:, ::-1] if side else flat.faces
        vertices.append(turned * size_m)
        faces.append(corner + base)
        base += len(turned)
    every = np.concatenate(vertices)
    key = np.rint(every / size_m * cells * 2).astype(np.int64)
    _, first, place = np.unique(key, axis=0, return_index=True, return_inverse=True)
    joined = every[first] + np.random.default_rng(seed).normal(0, noise_m, (len(first), 3))
    return mesh(joined, place.ravel()[np.concatenate(faces)])


def oriented(points: object, normals: object, colors: object) -> OrientedCloud:
    at = np.asarray(points, np.float32)
    cloud = PointCloud(
        np.zeros(3), at, np.asarray(colors, np.uint8), np.full(len(at), -1, np.int16)
    )
    return OrientedCloud(cloud, np.asarray(normals, np.float32), np.zeros((0, 3)))


def ramp(points: Float32, width_m: float) -> UInt8:
    """Red grows along x, green along y; blue is 100."""
    share = np.clip(points[:, :2] / width_m, 0, 1) * 200 + 20
    return np.rint(np.column_stack([share, np.full(len(points), 100.0)])).astype(np.uint8)
