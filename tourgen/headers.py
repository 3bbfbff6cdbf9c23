"""The HTTP headers that a published tour is safe with, for our server and for other hosts.

Everything comes from the tour's own host. Three things need saying beyond that: the Draco decoder
is WebAssembly in workers made of blobs, textures are pictures made of blobs, and anybody may show
the tour in a frame of their page: there is nothing in it that a visitor could be tricked into.
"""

from __future__ import annotations

from collections.abc import Mapping
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

SECURITY_HEADERS: Final[Mapping[str, str]] = {
    "Content-Security-Policy": "; ".join(f"{key} {value}" for key, value in _POLICY.items()),
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


def headers_file() -> str:
    """The same as a ``_headers`` file, which Netlify, Cloudflare Pages and others follow."""
    every = "".join(f"  {key}: {value}\n" for key, value in SECURITY_HEADERS.items())
    return f"/*\n{every}\n/viewer/*\n  Cache-Control: {IMMUTABLE}\n"
