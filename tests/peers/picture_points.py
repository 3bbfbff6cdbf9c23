"""How true colours are: ``python tests/peers/picture_points.py TOUR [--room ID]``.

Quicker than a browser: places spread evenly over the leaf tiles take their colours from the tile's
picture and are held against the true texture where the built surface stands for the true one. What
is compared are means over squares of 5 mm, about what a screen's pixel shows from two metres. One
gain a channel is fitted first, since no scan tells how bright a room is. Looking glasses and what
glows are left out, and so is what lies more than 30 mm from the truth.

psnr_db       Of the colours on surfaces that a station sees.
psnr_all_db   The same with what no station sees: there the tour can only guess.
seam          For each pair of stations, how far apart (of 255) their neighbourhoods' errors are
              in cells of 0.1 m that both colour: the median over the cells, the worst pair and
              channel.
"""

from __future__ import annotations

import argparse
import io
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from score import Truth, markdown

from tourgen.geometry import Float32, Float64, Int32, TexturedMesh, UInt8
from tourgen.rays import rays_of

SAMPLES = 50_000
PIXEL_M = 0.005
PIXEL_SAMPLES = 4  # along each side
NEAR_M = 0.03
GLOW = 254
SEAM_CELL_M = 0.1
Bools = NDArray[np.bool_]


@dataclass(frozen=True)
class Leaf:
    """A tile with its picture.

    Attributes:
        vertices: (v, 3) metres, z up.
        faces: (f, 3)
        uv: (v, 2), (0, 0) the picture's upper left corner.
        picture: (h, w, 3) sRGB.
    """

    vertices: Float64
    faces: Int32
    uv: Float32
    picture: UInt8

    @classmethod
    def of(cls, textured: TexturedMesh) -> Leaf:
        """From the arrays that a build makes."""
        tile = textured.uv_mesh
        return cls(
            tile.mesh.vertices.astype(np.float64), tile.mesh.faces, tile.uv, textured.texture
        )


def published(tileset: Path) -> Iterator[Leaf]:
    """The leaves of a published room; its tiles stand in the room's frame, only y is up."""
    import json

    waiting = [json.loads(tileset.read_text(encoding="utf-8"))["root"]]
    while waiting:
        tile = waiting.pop()
        waiting += tile.get("children", [])
        if not tile.get("children") and "content" in tile:
            yield glb(tileset.parent / tile["content"]["uri"])


def glb(path: Path) -> Leaf:
    """The one textured primitive of a tile."""
    import DracoPy
    import pygltflib
    from PIL import Image

    file = pygltflib.GLTF2.load_binary(str(path))
    blob = file.binary_blob()

    def view(number: int) -> bytes:
        at = file.bufferViews[number]
        return bytes(blob[at.byteOffset or 0 : (at.byteOffset or 0) + at.byteLength])

    primitive = file.meshes[0].primitives[0]
    mesh = DracoPy.decode(view(primitive.extensions["KHR_draco_mesh_compression"]["bufferView"]))
    x, y, z = np.asarray(mesh.points, np.float64).T
    picture = Image.open(io.BytesIO(view(file.images[0].bufferView))).convert("RGB")
    return Leaf(
        np.stack([x, -z, y], axis=1),
        np.asarray(mesh.faces, np.int32),
        np.asarray(mesh.tex_coord, np.float32),
        np.asarray(picture),
    )


def spread(leaves: Sequence[Leaf]) -> tuple[Float64, Float64, Float64]:
    """Squares spread evenly over the leaves.

    Returns:
        (n, k, 3) places in each of n squares, (n, 3) normals, (n, k, 3) colours, 0 to 255.
    """
    rng = np.random.default_rng(3)
    areas = []
    for leaf in leaves:
        a, b, c = (leaf.vertices[leaf.faces[:, k]] for k in range(3))
        areas.append(np.linalg.norm(np.cross(b - a, c - a), axis=1))
    total = sum(float(area.sum()) for area in areas)
    side = ((np.arange(PIXEL_SAMPLES) + 0.5) / PIXEL_SAMPLES - 0.5) * PIXEL_M
    square = np.stack(np.meshgrid(side, side), -1).reshape(-1, 2)
    found = []
    for leaf, area in zip(leaves, areas, strict=True):
        n = rng.poisson(SAMPLES * area.sum() / total)
        face = rng.choice(len(area), n, p=area / area.sum())
        at = leaf.faces[face]
        corners = leaf.vertices[at]
        edges = corners[:, 1:] - corners[:, :1]
        across = np.cross(edges[:, 0], edges[:, 1])
        normals = across / np.linalg.norm(across, axis=1, keepdims=True)
        right = edges[:, 0] / np.linalg.norm(edges[:, 0], axis=1, keepdims=True)
        frame = np.stack([right, np.cross(normals, right)], axis=1)
        away = square @ frame  # (n, k, 3)
        share = rng.dirichlet((1, 1, 1), n)
        middle = np.einsum("nc,ncx->nx", share, corners)
        uv = leaf.uv[at].astype(np.float64)
        # The picture's own place of each sample: the face's plane carried on past its edges.
        steps = away @ np.linalg.pinv(edges)
        places = np.einsum("nc,ncx->nx", share, uv)[:, None] + steps @ (uv[:, 1:] - uv[:, :1])
        shown = bilinear(leaf.picture, places.reshape(-1, 2)).reshape((*places.shape[:2], 3))
        found.append((middle[:, None] + away, normals, shown))
    places, normals, shown = (np.concatenate(each) for each in zip(*found, strict=True))
    return places, normals, shown


def bilinear(picture: UInt8, uv: Float64) -> Float64:
    """(n, 3) colours as a graphics card reads them."""
    height, width = picture.shape[:2]
    x = np.clip(uv[:, 0] * width - 0.5, 0, width - 1)
    y = np.clip(uv[:, 1] * height - 0.5, 0, height - 1)
    left, top = (np.minimum(at.astype(int), size - 2) for at, size in ((x, width), (y, height)))
    u, v = (x - left)[:, None], (y - top)[:, None]
    upper = picture[top, left] * (1 - u) + picture[top, left + 1] * u
    lower = picture[top + 1, left] * (1 - u) + picture[top + 1, left + 1] * u
    return np.asarray(upper * (1 - v) + lower * v)


class TruePicture:
    """The true surface with its colours."""

    def __init__(self, folder: Path, room: str) -> None:
        from PIL import Image

        Image.MAX_IMAGE_PIXELS = None
        self.truth = Truth(folder, room)
        self.texture = np.asarray(Image.open(folder / f"{room}.png").convert("RGB"))
        vertices = np.frombuffer(
            (folder / f"{room}.ply").read_bytes().split(b"end_header\n", 1)[1],
            np.dtype([("xyz", "<f4", 3), ("st", "<f4", 2)]),
            len(self.truth.vertices),
        )
        self.uv = vertices["st"] * (1, -1) + (0, 1)

    def facing(self, places: Float64, normals: Float64) -> tuple[Float64, Bools, Bools]:
        """(n, 3) the true colours; which places are judged; which of these a station sees."""
        import open3d as o3d

        scene = self.truth.scene
        start = places + NEAR_M * normals
        hit = scene.cast_rays(rays_of(start, -normals))
        face = hit["primitive_ids"].numpy().astype(np.int64)
        share = hit["primitive_uvs"].numpy()
        along = hit["t_hit"].numpy()
        looks = np.where(along < np.inf, face, 0)
        fits = (along < 2 * NEAR_M) & ((self.truth.normals[looks] * normals).sum(1) > 0.3)
        near = scene.compute_closest_points(o3d.core.Tensor(places.astype(np.float32)))
        face = np.where(fits, face, near["primitive_ids"].numpy().astype(np.int64))
        share = np.where(fits[:, None], share, near["primitive_uvs"].numpy())
        at = self.truth.faces[face]
        weights = np.column_stack([1 - share.sum(1), share])
        foot = np.einsum("nc,ncx->nx", weights, self.truth.vertices[at])
        uv = np.einsum("nc,ncx->nx", weights, self.uv[at])
        height, width = self.texture.shape[:2]
        column = np.clip((uv[:, 0] * width).astype(int), 0, width - 1)
        row = np.clip((uv[:, 1] * height).astype(int), 0, height - 1)
        colors = self.texture[row, column].astype(np.float64)
        judged = np.linalg.norm(foot - places, axis=1) < NEAR_M
        judged &= ~self.truth.mirror[face] & (colors.min(1) < GLOW)
        return colors, judged, self.truth.seen(foot, face)


def gain_of(shown: Float64, true: Float64) -> Float64:
    """(3,) the factors that bring what is shown nearest to the truth."""
    factors: Float64 = (shown * true).sum(0) / (shown**2).sum(0)
    return factors


def psnr(off: Float64) -> float:
    """Decibels of (n, 3) errors of 255."""
    return float(10 * np.log10(255**2 / (off**2).mean()))


def figures(
    leaves: Sequence[Leaf],
    true: TruePicture,
    points: Float32 | None = None,
    owner: NDArray[Any] | None = None,
) -> dict[str, float]:
    """The figures of one room.

    Args:
        leaves: Its tiles.
        true: Its truth.
        points: (p, 3) the scan, metres, and
        owner: (p,) its stations, where they are known: seams are looked for between them.
    """
    squares, normals, shown = spread(leaves)
    count = squares.shape[1]
    each = [
        all_.reshape(len(squares), count, *all_.shape[1:])
        for all_ in true.facing(squares.reshape(-1, 3), np.repeat(normals, count, axis=0))
    ]
    colors, judged, seen = each[0].mean(1), each[1].all(1), each[2].all(1)
    places, shown = squares.mean(1), shown.mean(1)
    seen &= judged
    gain = gain_of(shown[seen], colors[seen])
    off = shown * gain - colors
    found = {
        "psnr_db": round(psnr(off[seen]), 2),
        "psnr_all_db": round(psnr(off[judged]), 2),
        "median_off": round(float(np.median(np.abs(off[seen]))), 2),
        "seen_share": round(float(seen.mean()), 3),
    }
    if points is not None and owner is not None:
        found["seam"] = round(seam(places[seen], off[seen], points, owner), 2)
    return found


def seam(places: Float64, off: Float64, points: Float32, owner: NDArray[Any]) -> float:
    """The worst pair's difference, of 255."""
    from scipy.spatial import cKDTree

    station = owner[cKDTree(points, balanced_tree=False).query(places, workers=2)[1]]
    at = np.floor((places - places.min(0)) / SEAM_CELL_M).astype(np.int64)
    span = at.max(0) + 1
    _, cell = np.unique((at[:, 0] * span[1] + at[:, 1]) * span[2] + at[:, 2], return_inverse=True)
    count = int(station.max()) + 1
    group = cell * count + station
    sizes = np.bincount(group, minlength=(cell.max() + 1) * count).reshape(-1, count)
    sums = [np.bincount(group, off[:, k], sizes.size).reshape(-1, count) for k in range(3)]
    means = np.stack(sums, -1) / np.maximum(sizes, 1)[..., None]
    worst = 0.0
    for a in range(count):
        for b in range(a):
            both = (sizes[:, a] >= 5) & (sizes[:, b] >= 5)
            if both.sum() >= 30:
                apart = np.median(means[both, a] - means[both, b], axis=0)
                worst = max(worst, float(np.abs(apart).max()))
    return worst


def main() -> int:
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("tour", type=Path, help="a tour's folder, with site/ and truth/")
    parser.add_argument("--room", action="append", help="only this room")
    given = parser.parse_args()
    truth = given.tour / "truth"
    rooms = given.room or sorted(file.stem for file in truth.glob("*.json"))
    print(
        markdown(
            {
                room: figures(
                    list(published(given.tour / "site/rooms" / room / "tileset.json")),
                    TruePicture(truth, room),
                )
                for room in rooms
            }
        )
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
