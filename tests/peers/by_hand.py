"""What is made by hand today, from a scan to a textured mesh: ``by_hand.py PROGRAM SCAN OUT ...``.

``meshlab``: PyMeshLab's filters one after the other: crop, normals, screened Poisson, what is
hardly supported cut, quadric decimation, trivial UVs, the scan's colours to a texture, export.
``open3d``: the same in Open3D, with xatlas on the whole mesh, and the nearest point's colour a
texel. Both are told what tourgen finds out by itself: the room's box and a place to look from.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np

_CUT = 0.02
"""Of the vertices, the thinnest supported go."""
_TEXTURE_PX = 4096
_ROWS = 256


def main() -> int:
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program", choices=("meshlab", "open3d"))
    parser.add_argument("scan", type=Path)
    parser.add_argument("out", type=Path, help="folder for mesh.ply, texture.png and told.json")
    parser.add_argument("--box", type=float, nargs=6, required=True, help="lowest, highest corner")
    parser.add_argument("--eye", type=float, nargs=3, required=True, help="normals look there")
    parser.add_argument("--depth", type=int, required=True, help="of the octree")
    parser.add_argument("--faces", type=int, required=True, help="of the finished mesh")
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    vertices, faces = {"meshlab": _by_meshlab, "open3d": _by_open3d}[given.program](given)
    import open3d as o3d

    mesh = o3d.geometry.TriangleMesh(
        o3d.utility.Vector3dVector(vertices), o3d.utility.Vector3iVector(faces)
    )
    o3d.io.write_triangle_mesh(str(given.out / "mesh.ply"), mesh)
    (given.out / "told.json").write_text(json.dumps({"faces": len(faces)}), encoding="utf-8")
    return 0


def _by_meshlab(given: argparse.Namespace) -> tuple[Any, Any]:
    import pymeshlab

    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.load_new_mesh(str(given.scan))
    low, high = given.box[:3], given.box[3:]
    outside = " || ".join(
        f"{axis} < {a} || {axis} > {b}" for axis, a, b in zip("xyz", low, high, strict=True)
    )
    meshes.compute_selection_by_condition_per_vertex(condselect=outside)
    meshes.meshing_remove_selected_vertices()
    meshes.compute_normal_for_point_clouds(k=16, flipflag=True, viewpos=np.array(given.eye))
    meshes.generate_surface_reconstruction_screened_poisson(depth=given.depth, preclean=True)
    density = meshes.current_mesh().vertex_scalar_array()
    least = float(np.quantile(density, _CUT))
    meshes.compute_selection_by_condition_per_vertex(condselect=f"q < {least!r}")
    meshes.meshing_remove_selected_vertices()
    meshes.meshing_decimation_quadric_edge_collapse(targetfacenum=given.faces)
    meshes.compute_texcoord_parametrization_triangle_trivial_per_wedge(
        textdim=_TEXTURE_PX, border=2, method="Space-optimizing"
    )
    meshes.transfer_attributes_to_texture_per_vertex(
        sourcemesh=0,
        targetmesh=1,
        textname="texture.png",
        textw=_TEXTURE_PX,
        texth=_TEXTURE_PX,
        upperbound=pymeshlab.PureValue(0.2),
    )
    meshes.save_current_mesh(str(given.out / "mesh.obj"))
    mesh = meshes.current_mesh()
    return mesh.vertex_matrix(), mesh.face_matrix()


def _by_open3d(given: argparse.Namespace) -> tuple[Any, Any]:
    import open3d as o3d
    import xatlas
    from PIL import Image
    from scipy.spatial import cKDTree

    cloud = o3d.io.read_point_cloud(str(given.scan))
    low, high = given.box[:3], given.box[3:]
    cloud = cloud.crop(o3d.geometry.AxisAlignedBoundingBox(low, high))
    cloud.estimate_normals(o3d.geometry.KDTreeSearchParamKNN(16))
    cloud.orient_normals_towards_camera_location(np.array(given.eye))
    mesh, density = o3d.geometry.TriangleMesh.create_from_point_cloud_poisson(
        cloud, depth=given.depth
    )
    thin = np.asarray(density)
    mesh.remove_vertices_by_mask(thin < np.quantile(thin, _CUT))
    mesh = mesh.simplify_quadric_decimation(given.faces)
    vertices, faces = np.asarray(mesh.vertices), np.asarray(mesh.triangles)
    mapping, corners, uv = xatlas.parametrize(vertices.astype(np.float32), faces)
    places = _texel_places(vertices[mapping], corners, uv)
    covered = np.isfinite(places[:, 0])
    picture = np.zeros((_TEXTURE_PX * _TEXTURE_PX, 3), np.uint8)
    nearest = cKDTree(np.asarray(cloud.points)).query(places[covered], workers=-1)[1]
    picture[covered] = np.rint(np.asarray(cloud.colors)[nearest] * 255)
    image = Image.fromarray(picture.reshape(_TEXTURE_PX, _TEXTURE_PX, 3))
    image.save(given.out / "texture.png")
    return vertices, faces


def _texel_places(vertices: Any, faces: Any, uv: Any) -> Any:
    """(n, 3) where each texel lies, NaN where on no face: rays through the plane of the texture."""
    import open3d as o3d

    flat = np.column_stack([uv, np.zeros(len(uv))]).astype(np.float32)
    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(o3d.core.Tensor(flat), o3d.core.Tensor(faces.astype(np.uint32)))
    found = np.full((_TEXTURE_PX * _TEXTURE_PX, 3), np.nan, np.float32)
    column = (np.arange(_TEXTURE_PX) + 0.5) / _TEXTURE_PX
    for first in range(0, _TEXTURE_PX, _ROWS):
        row = (np.arange(first, first + _ROWS) + 0.5) / _TEXTURE_PX
        at = np.stack(np.meshgrid(column, row), axis=-1).reshape(-1, 2)
        rays = np.zeros((len(at), 6), np.float32)
        rays[:, :2], rays[:, 2], rays[:, 5] = at, 1, -1
        hit = scene.cast_rays(o3d.core.Tensor(rays))
        face = hit["primitive_ids"].numpy()
        met = np.flatnonzero(np.isfinite(hit["t_hit"].numpy()))
        u, v = hit["primitive_uvs"].numpy()[met].T[:, :, None]
        corner = vertices[faces[face[met]]]
        place = corner[:, 0] * (1 - u - v) + corner[:, 1] * u + corner[:, 2] * v
        found[first * _TEXTURE_PX + met] = place
    return found


if __name__ == "__main__":
    sys.exit(main())
