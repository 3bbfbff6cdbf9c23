"""Offline: the service worker that takes a whole tour along, and what makes it an app.

The worker is told every file with its digest. It takes a version over only when all of its files
have come and are what this build wrote: a copy that stopped half way is never shown.
"""

from __future__ import annotations

import base64
import hashlib
import io
import json
from pathlib import Path
from typing import Any, Final

from PIL import Image

WORKER: Final = "sw.js"
MANIFEST: Final = "tour.webmanifest"
ICONS: Final = (192, 512)
_GROUND: Final = "#16181c"
_LEFT: Final = frozenset(
    {"_headers", "report.html", "report.json", "robots.txt", "sitemap.xml", WORKER}
)
"""What nobody visits."""
_LEFT_NAMES: Final = frozenset({"preview.jpg"})

Json = dict[str, Any]


def worker_script(out: Path, code: str) -> str:
    """The service worker of a site that is written but for it.

    Args:
        out: The site's folder.
        code: The worker as the viewer brings it; it reads ``self.tour``.
    """
    files = [_entry(out, path) for path in sorted(out.rglob("*")) if _is_taken(out, path)]
    size = sum(path.stat().st_size for path in out.rglob("*") if _is_taken(out, path))
    told = json.dumps({"bytes": size, "files": files})
    return f"self.tour={told};\n{code}"


def _is_taken(out: Path, path: Path) -> bool:
    name = path.relative_to(out).as_posix()
    return path.is_file() and name not in _LEFT and path.name not in _LEFT_NAMES


def _entry(out: Path, path: Path) -> Json:
    """A file as Workbox wants it told: its address, its version, and what its bytes must be."""
    digest = hashlib.sha384(path.read_bytes()).digest()
    return {
        "url": path.relative_to(out).as_posix(),
        "revision": digest.hex()[:16],
        "integrity": f"sha384-{base64.b64encode(digest).decode()}",
    }


def manifest(told: Json) -> str:
    """A web app manifest (W3C), in the tour's first language."""
    language = told["languages"][0]
    name = told["title"][language]
    described: Json = {
        "name": name,
        "short_name": name,
        "lang": language,
        "start_url": "index.html",
        "scope": "./",
        "display": "standalone",
        "background_color": _GROUND,
        "theme_color": _GROUND,
        "icons": [
            {"src": icon_path(size), "sizes": f"{size}x{size}", "type": "image/png"}
            for size in ICONS
        ],
    }
    return json.dumps(described, ensure_ascii=False, indent=1) + "\n"


def icon_path(size: int) -> str:
    """Where an icon is published."""
    return f"icons/{size}.png"


def icon(poster: bytes, size: int) -> bytes:
    """The middle of a picture as a square PNG of so many pixels a side."""
    with Image.open(io.BytesIO(poster)) as picture:
        side = min(picture.size)
        left, top = ((length - side) // 2 for length in picture.size)
        square = picture.convert("RGB").crop((left, top, left + side, top + side))
    drawn = io.BytesIO()
    square.resize((size, size), Image.Resampling.LANCZOS).save(drawn, "PNG")
    return drawn.getvalue()
