"""The best that our texture can be: the same points with clean colours, on the true mesh.

Every point that truly hit the room's surface is put at its true place and takes the true colour
there; mixed pixels, strays, reflections and the passer-by are gone. The room is then built with
``room.mesh`` set to the true surface, so that levels, tiles, texture and packing are the
pipeline's own. The surface that exact points give (``exact``) is coloured in the same way, and the
true one by panoramas, from the scan as it came.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from drawing import blended, tensor
from results import EXACT
from rooms import BenchRoom, read_scan, stamp
from true_picture import TexturedTruth
from variants import alone, built, link, scanned

from tourgen.geometry import Float64, Int32
from tourgen.simulation.atlas import sample
from tourgen.simulation.output import write_ply
from tourgen.tour import Tour

SURFACE = 0
NAME, WITH_PANORAMAS = "oracle", "oracle-panoramas"
_MESH = "scans/surface.ply"
_NO_BOXES: dict[str, Any] = {"keep": None, "remove": (), "closed": ()}


def clean_tour(
    tour: Tour, room: BenchRoom, truth: TexturedTruth, mesh: tuple[Float64, Int32], folder: Path
) -> Tour:
    """One room with its clean scan, a given mesh and true stations, without boxes."""
    cloud = folder / "scans" / f"clean-{stamp(room.scan)}.ply"
    if not cloud.exists():
        cloud.parent.mkdir(parents=True, exist_ok=True)
        write_clean(cloud, room, truth)
    write_mesh(folder / _MESH, *mesh)
    return alone(
        tour,
        room.id,
        folder,
        mesh=_MESH,
        stations=tuple(map(tuple, np.round(room.stations(), 4).tolist())),
        **_NO_BOXES,
        **scanned(tour, room.id, f"scans/{cloud.name}"),
    )


def write_mesh(file: Path, vertices: Float64, faces: Int32) -> None:
    """A surface without what takes no area."""
    import open3d as o3d

    mesh = o3d.geometry.TriangleMesh(
        o3d.utility.Vector3dVector(vertices), o3d.utility.Vector3iVector(faces)
    )
    mesh.remove_duplicated_vertices()
    mesh.remove_degenerate_triangles()
    file.parent.mkdir(parents=True, exist_ok=True)
    o3d.io.write_triangle_mesh(str(file), mesh)


def write_clean(file: Path, room: BenchRoom, truth: TexturedTruth) -> None:
    """The points of a scan that hit the surface, where they hit it, in its colours."""
    points, _ = read_scan(room.scan)
    label = np.load(room.truth_folder / f"{room.id}.npz")["label"]
    nearest = truth.scene.compute_closest_points(tensor(points[label == SURFACE]))
    face = nearest["primitive_ids"].numpy().astype(np.int64)
    at = blended(truth.uv[truth.faces[face]], nearest["primitive_uvs"].numpy())
    write_ply(file, nearest["points"].numpy(), sample(truth.texture, at))


def built_oracle(tour: Tour, room: BenchRoom, truth: TexturedTruth, scratch: Path) -> Path | str:
    """The oracle's site; why not, where it cannot be built."""
    mesh = truth.vertices, truth.faces
    return built(clean_tour(tour, room, truth, mesh, scratch / NAME / room.id))


def built_exact(
    tour: Tour,
    room: BenchRoom,
    truth: TexturedTruth,
    mesh: tuple[Float64, Int32],
    scratch: Path,
) -> Path | str:
    """The site of the surface that exact points give."""
    return built(clean_tour(tour, room, truth, mesh, scratch / EXACT / room.id))


def built_with_panoramas(
    tour: Tour, room: BenchRoom, truth: TexturedTruth, scratch: Path
) -> Path | str:
    """The site of a room's true surface in the colours of its E57's panoramas."""
    folder, scan = scratch / WITH_PANORAMAS / room.id, f"scans/{room.id}.e57"
    write_mesh(folder / _MESH, truth.vertices, truth.faces)
    link(folder / scan, tour.folder / scan)
    changes = scanned(tour, room.id, scan)
    return built(alone(tour, room.id, folder, mesh=_MESH, **_NO_BOXES, **changes))
