"""Kiosk: what the page for an unattended screen is told beside the tour.

A kiosk opens no address outside of the tour. What its texts link to is shown as a QR code, made
here, which visitors take along on a telephone of their own.
"""

from __future__ import annotations

import hashlib
import io
import re
from collections.abc import Iterable, Mapping
from html import unescape
from typing import Any, Final

import segno

from tourgen.tour import Kiosk

_LINK: Final = re.compile(r'<a [^>]*?href="([^"]+)"')
_ROUNDS: Final = 200_000
"""Of the derivation of a PIN's digest. It keeps curious fingers out, nothing more: whoever has the
published files may try all PINs."""

Json = dict[str, Any]


def codes(told: Json) -> dict[str, str]:
    """The published path of the QR code of every address that a tour's texts name.

    Args:
        told: What tour.json says.
    """
    found = {address for text in _texts(told) for address in _addresses(text)}
    if told["address"]:
        found.add(told["address"])
    return {address: _path(address) for address in sorted(found)}


def code_of(address: str) -> bytes:
    """A QR code, SVG, dark on light with its quiet zone (ISO/IEC 18004)."""
    drawing = io.BytesIO()
    segno.make(address, micro=False, error="m").save(
        drawing,
        kind="svg",
        xmldecl=False,
        svgclass=None,
        lineclass=None,
        light="#fff",
        omitsize=True,
    )
    return drawing.getvalue()


def kiosk_settings(kiosk: Kiosk, told: Json) -> Json:
    """What the kiosk's page is told."""
    return {
        "idle_s": kiosk.idle_s,
        "warning_s": kiosk.warning_s,
        "low": kiosk.controls == "low",
        "hours": dict(kiosk.hours) if kiosk.hours else None,
        "pin": _lock(kiosk.pin, told) if kiosk.pin else None,
        "codes": codes(told),
    }


def _lock(pin: str, told: Json) -> Mapping[str, Any]:
    """A digest of a PIN, by PBKDF2 (RFC 8018), salted by what the tour is called."""
    salt = hashlib.sha256(repr(sorted(told["title"].items())).encode()).hexdigest()[:32]
    digest = hashlib.pbkdf2_hmac("sha256", pin.encode(), bytes.fromhex(salt), _ROUNDS)
    return {"salt": salt, "rounds": _ROUNDS, "digest": digest.hex(), "length": len(pin)}


def _path(address: str) -> str:
    return f"kiosk/{hashlib.sha256(address.encode()).hexdigest()[:16]}.svg"


def _texts(told: Json) -> Iterable[str]:
    yield from told["credits"].values()
    for room in told["rooms"]:
        yield from room["text"].values()
        for note in room["notes"]:
            yield from note["text"].values()


def _addresses(html: str) -> list[str]:
    return [unescape(address) for address in _LINK.findall(html)]
