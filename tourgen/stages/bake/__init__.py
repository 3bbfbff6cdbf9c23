"""Bake: colour each texel of a tile's picture from the points of the scan.

A texel takes the blend of the points about its place on the surface that look its way. The
blend depends on the place alone, not on the chart or tile that the texel lies in, so colours
run through seams. Points are averaged in cells that double in size from level to level: a
coarse tile reads the level that fits its texels, which keeps it free of aliasing, and a texel
that no scan supports reads the first coarser level that has something to tell, so that holes
take the colours about them, across charts and tiles alike; those of floors were given points
before, which continue the floor's picture.

A million texels take 2 to 3 s on one busy core. Tried and rejected: a neighbour search and a
dense blend at each texel instead of one search for every 2 x 2 of a chart, 3.5 s; filling holes
inside the picture, which shows each chart's and each tile's border through the hole.
"""

from __future__ import annotations

import numpy as np

from tourgen.geometry import TexturedMesh, UvMesh
from tourgen.stages.bake.floors import continued_floors
from tourgen.stages.bake.overlook import VistaSettings, vistas
from tourgen.stages.bake.pictures import of_pictures
from tourgen.stages.bake.points import ColorIndex, Settings, color_index, of_points
from tourgen.stages.bake.texels import spread, texels_of, to_bytes
from tourgen.stages.bake.vista import Vista

__all__ = [
    "VERSION",
    "ColorIndex",
    "Settings",
    "Vista",
    "VistaSettings",
    "bake",
    "color_index",
    "continued_floors",
    "vistas",
]

VERSION = 14


def bake(
    uv_mesh: UvMesh, index: ColorIndex, settings: Settings, vistas: tuple[Vista, ...] = ()
) -> TexturedMesh:
    """Colour every texel that a face touches, and run the colours out over the rest.

    Args:
        uv_mesh: A tile.
        index: Of the tile's room.
        settings: See there.
        vistas: The room's panoramas, made ready; what they show goes before the points.

    Returns:
        The tile with its picture; the background holds the colours of the nearest charts at
        every scale, so that no mip level shows another one.
    """
    width, height = uv_mesh.texture_size
    texels = texels_of(uv_mesh)
    if vistas:
        colors = of_pictures(texels, vistas, index, uv_mesh.texel_m, settings)
    else:
        alone = np.zeros(len(texels.row), np.float32)
        colors = of_points(texels, index, uv_mesh.texel_m, settings, alone).colors
    picture = np.zeros((height, width, 3), np.float32)
    covered = np.zeros((height, width), np.float32)
    picture[texels.row, texels.column] = colors
    covered[texels.row, texels.column] = 1
    return TexturedMesh(uv_mesh, to_bytes(spread(picture, covered)))
