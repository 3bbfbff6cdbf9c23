"""The HTTP headers that a published tour is safe with, for our server and for other hosts.

Everything comes from the tour's own host. Three things need saying beyond that: the Draco decoder
is WebAssembly in workers made of blobs, textures are pictures made of blobs, and anybody may show
the tour in a frame of their page: there is nothing in it that a visitor could be tricked into.
"""

from __future__ import annotations

import mimetypes
from collections.abc import Mapping, Sequence
from pathlib import PurePath
from typing import Final

_POLICY: Final[Mapping[str, str]] = {
    "default-src": "'none'",
    "script-src": "'self' 'wasm-unsafe-eval'",
    "worker-src": "'self' blob:",
    "connect-src": "'self' blob:",
    "img-src": "'self' blob: data:",
    "media-src": "'self'",
    "style-src": "'self'",
    "font-src": "'self'",
    "manifest-src": "'self'",
    "base-uri": "'none'",
    "form-action": "'none'",
    "frame-ancestors": "*",
}

_TYPES: Final = {
    ".css": "text/css; charset=utf-8",
    ".glb": "model/gltf-binary",
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".json": "application/json",
    ".m4a": "audio/mp4",
    ".mp3": "audio/mpeg",
    ".ogg": "audio/ogg",
    ".otf": "font/otf",
    ".svg": "image/svg+xml",
    ".ttf": "font/ttf",
    ".vtt": "text/vtt; charset=utf-8",
    ".wasm": "application/wasm",
    ".wav": "audio/wav",
    ".webmanifest": "application/manifest+json",
    ".webp": "image/webp",
    ".woff": "font/woff",
    ".woff2": "font/woff2",
}


def _written(policy: Mapping[str, str]) -> str:
    return "; ".join(f"{key} {value}" for key, value in policy.items())


SECURITY_HEADERS: Final[Mapping[str, str]] = {
    "Content-Security-Policy": _written(_POLICY),
    "Cross-Origin-Opener-Policy": "same-origin",
    "Permissions-Policy": "camera=(), geolocation=(), microphone=()",
    "Referrer-Policy": "strict-origin-when-cross-origin",
    "X-Content-Type-Options": "nosniff",
}
"""Sent with every file of a tour."""

REVALIDATED: Final = "no-cache"
"""``Cache-Control`` of what keeps its name when its content changes."""

IMMUTABLE: Final = "public, max-age=31536000, immutable"
"""``Cache-Control`` of ``viewer/``, whose names carry their digest."""


def content_type(name: str) -> str:
    """What a file holds, by its name: by our own table first, a machine's may lack newer ones."""
    suffix = PurePath(name).suffix.lower()
    return _TYPES.get(suffix) or mimetypes.types_map.get(suffix, "application/octet-stream")


def carried_policy(scripts: Sequence[str], styles: Sequence[str]) -> str:
    """The policy of a page that carries all it shows, for its ``meta`` element.

    Args:
        scripts: SHA-256 digests of those that may run, in Base64.
        styles: The same of style sheets.
    """

    def allowed(digests: Sequence[str]) -> str:
        return " ".join(f"'sha256-{digest}'" for digest in digests)

    policy = {
        **_POLICY,
        "script-src": f"{allowed(scripts)} 'wasm-unsafe-eval'",
        "worker-src": "blob:",
        "connect-src": "blob: data:",
        "img-src": "blob: data:",
        "media-src": "data:",
        "style-src": allowed(styles),
        "font-src": "data:",
    }
    del policy["frame-ancestors"]  # has no meaning there
    return _written(policy)


def headers_file() -> str:
    """The same as a ``_headers`` file, which Netlify, Cloudflare Pages and others follow."""
    every = "".join(f"  {key}: {value}\n" for key, value in SECURITY_HEADERS.items())
    return f"/*\n{every}\n/viewer/*\n  Cache-Control: {IMMUTABLE}\n"
