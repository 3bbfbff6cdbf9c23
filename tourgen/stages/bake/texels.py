"""Texels: where each one lies on the surface, and what fills those that lie nowhere."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from tourgen.geometry import Float32, Float64, Int32, UInt8, UvMesh
from tourgen.raster import rasterize

Int64 = npt.NDArray[np.int64]

_TOUCH = 0.71  # half a texel's diagonal: any texel touched at all


@dataclass(frozen=True, slots=True)
class Texels:
    """Texels on the surface: t of them, in b blocks of up to 2 x 2 of one chart.

    Attributes:
        row: (t,)
        column: (t,)
        block: (t,)
        positions: (t, 3) metres.
        middles: (b, 3) mean position of each block.
        normals: (b, 3) unit.
    """

    row: Int64
    column: Int64
    block: Int64
    positions: Float32
    middles: Float64
    normals: Float32

    def part(self, which: slice) -> Texels:
        """Some of the texels, of the same blocks."""
        return replace(
            self,
            row=self.row[which],
            column=self.column[which],
            block=self.block[which],
            positions=self.positions[which],
        )

    def blocks(self) -> Texels:
        """The blocks' middles, as if they were texels."""
        number = np.arange(len(self.middles))
        return Texels(
            number, number, number, self.middles.astype(np.float32), self.middles, self.normals
        )


def texels_of(uv_mesh: UvMesh) -> Texels:
    """Every texel that a face touches, once: the face that it lies deepest in says where."""
    width, height = uv_mesh.texture_size
    mesh = uv_mesh.mesh
    corners = uv_mesh.uv.astype(np.float64)[mesh.faces] * (width, height)
    hits = rasterize(corners, width, height, reach=_TOUCH)
    place = hits.row.astype(np.int64) * width + hits.column
    depth = hits.barycentric.min(1)
    outside = np.flatnonzero(depth < 0)
    outside = outside[np.argsort(depth[outside], kind="stable")]
    best = np.full(width * height, -1)
    best[place[outside]] = outside
    inside = np.flatnonzero(depth >= 0)
    best[place[inside]] = inside
    chosen = best[best >= 0]
    face, row, column = hits.face[chosen], hits.row[chosen], hits.column[chosen]
    share = np.maximum(hits.barycentric[chosen], 0)
    share /= share.sum(1, keepdims=True)
    at = mesh.faces[face]
    positions = _mixed(share, mesh.vertices, at)
    block_rows, block_columns = (height + 1) // 2, (width + 1) // 2
    key = (uv_mesh.chart[face].astype(np.int64) * block_rows + row // 2) * block_columns
    _, first, block, sizes = np.unique(
        key + column // 2, return_index=True, return_inverse=True, return_counts=True
    )
    sums = [np.bincount(block, axis, len(first)) for axis in positions.T]
    return Texels(
        row.astype(np.int64),
        column.astype(np.int64),
        block.astype(np.int64),
        positions,
        np.stack(sums, axis=1) / sizes[:, None],
        unit(_mixed(share[first], _vertex_normals(uv_mesh), at[first])),
    )


def _mixed(share: Float32, values: Float32, at: Int32) -> Float32:
    """The values at three corners, by their shares."""
    mixed: Float32 = share[:, :1] * values[at[:, 0]]
    for corner in (1, 2):
        mixed += share[:, corner : corner + 1] * values[at[:, corner]]
    return mixed


def _vertex_normals(uv_mesh: UvMesh) -> Float32:
    """(v, 3) mean normal of the faces about each place, across chart borders too."""
    mesh = uv_mesh.mesh
    corners = mesh.vertices[mesh.faces].astype(np.float64)
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    _, place = np.unique(mesh.vertices, axis=0, return_inverse=True)
    place = place.ravel()
    at = place[mesh.faces].ravel()
    sums = np.stack([np.bincount(at, np.repeat(cross[:, i], 3)) for i in range(3)], axis=1)
    return unit(sums[place].astype(np.float32))


def unit(vectors: Float32) -> Float32:
    """(n, 3) vectors at length 1."""
    lengths = np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-12)
    return np.asarray(vectors / lengths, np.float32)


def to_bytes(colors: npt.NDArray[np.floating]) -> UInt8:
    """Rounded and within 0 to 255."""
    rounded: UInt8 = np.clip(np.rint(colors), 0, 255).astype(np.uint8)
    return rounded


def spread(picture: Float32, covered: Float32) -> Float32:
    """Fill what is not covered from what is, by halving the picture until all is known.

    Gortler, Grzeszczuk, Szeliski, Cohen: The lumigraph, 1996, section 3.4 (pull and push).
    """
    if covered.min() > 0 or covered.max() <= 0:
        return picture
    height, width = covered.shape
    pad = ((0, height % 2), (0, width % 2))
    weight = np.pad(covered, pad)
    value = np.pad(picture * covered[..., None], (*pad, (0, 0)))
    weights = weight.reshape(weight.shape[0] // 2, 2, -1, 2).sum((1, 3))
    values = value.reshape(value.shape[0] // 2, 2, -1, 2, 3).sum((1, 3))
    half = values / np.maximum(weights, 1e-12)[..., None]
    coarse = spread(half, np.minimum(weights, 1))
    fine = _doubled(coarse)[:height, :width]
    return picture * covered[..., None] + fine * (1 - covered[..., None])


def _doubled(picture: Float32) -> Float32:
    """Twice the size, blended between centres."""
    for axis in (0, 1):
        size = picture.shape[axis]
        before = picture.take(np.maximum(np.arange(size) - 1, 0), axis)
        after = picture.take(np.minimum(np.arange(size) + 1, size - 1), axis)
        pair = np.stack([0.75 * picture + 0.25 * before, 0.75 * picture + 0.25 * after], axis + 1)
        shape = list(picture.shape)
        shape[axis] *= 2
        picture = pair.reshape(shape)
    return picture
