"""What a visitor's machine is asked for in each room, beside what is allowed."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from hosting import Host
from net import slowed
from playwright.sync_api import Browser
from published import DRACO, read_glb, rooms_of, tileset
from visitor import Visitor, visitor

KB, MB = 1e3, 1e6
DIRECTIONS = 8
CHANGES = 50
WATCHING = Path(__file__).with_name("watching.js")


@dataclass(frozen=True)
class Device:
    """What a room is looked at with.

    Attributes:
        name: In the tables.
        settings: Of the visitor.
        room_bytes: A room may take so many, all levels.
        texture_bytes: On the graphics card.
    """

    name: str
    settings: Mapping[str, Any]
    room_bytes: float
    texture_bytes: float


DEVICES = (
    Device("desktop", {"size": (1280, 800)}, 8 * MB, 256 * MB),
    Device(
        "phone",
        {"size": (390, 844), "has_touch": True, "is_mobile": True, "device_scale_factor": 3},
        3 * MB,
        128 * MB,
    ),
)


@dataclass(frozen=True)
class Figure:
    """One thing that is asked for.

    Attributes:
        name: What.
        most: Allowed.
        found: In a room.
        unit: Of both, and how many of it make one of the table's.
        scale: See there.
    """

    name: str
    most: float
    found: float
    unit: str = ""
    scale: float = 1.0


def room_figures(browser: Browser, host: Host, site: Path, room: str) -> list[Figure]:
    """All figures of one room."""
    return [*_packed(site, room), *_first(browser, host, room), *_looked(browser, host, room)]


def _packed(site: Path, room: str) -> Iterator[Figure]:
    """What the files tell."""
    _, root = tileset(site / rooms_of(site)[room]["tileset"])
    told = [_geometry(node.file) for node in root.leaves()]
    share = sum(size for _, size in told) / sum(faces for faces, _ in told)
    yield Figure("geometry, a face", 3, share, "bytes")
    yield Figure("collision mesh", 20_000, _geometry(root.file)[0], "faces")


def _geometry(file: Path) -> tuple[int, int]:
    """Faces of a tile, and the bytes that they take."""
    document, _ = read_glb(file.read_bytes())
    (mesh,) = document["meshes"]
    (primitive,) = mesh["primitives"]
    packed = document["bufferViews"][primitive["extensions"][DRACO]["bufferView"]]
    return document["accessors"][primitive["indices"]]["count"] // 3, packed["byteLength"]


def _first(browser: Browser, host: Host, room: str) -> Iterator[Figure]:
    """What comes until the room stands open."""
    here = _come(browser, host, room, DEVICES[0])
    here.wait("window.tourgen?.ready")
    answers = list(host.answers)
    names = [answer.path for answer in answers]
    folder = f"/rooms/{room}"

    def sent(*paths: str) -> int:
        return sum(answer.size for answer in answers if answer.path in paths)

    to_poster = answers[: names.index(f"{folder}/poster.webp") + 1]
    view = sent(f"{folder}/tileset.json", f"{folder}/tiles/r.glb")
    yield Figure("script before the first tile", 250 * KB, host.sent(kind=".js"), "KB", KB)
    yield Figure("first 3D view", 200 * KB, view, "KB", KB)
    yield Figure("first transfer, all told", 1600 * KB, sum(a.size for a in answers), "KB", KB)
    yield Figure("poster within the first", 150 * KB, sum(a.size for a in to_poster), "KB", KB)
    here.settle()
    seen = here.page.evaluate("window.seen")
    yield Figure("largest contentful paint", 2500, seen["shownMs"], "ms")
    yield Figure("layout shift", 0.1, seen["shift"])
    _leave(here)


def _looked(browser: Browser, host: Host, room: str) -> Iterator[Figure]:
    """What it takes to be sharp all around."""
    for device in DEVICES:
        here = _come(browser, host, room, device)
        here.wait("window.tourgen?.ready")
        here.settle()
        eye = here.position
        at_entry = _tile_bytes(host, room)
        calls, triangles = [], []
        for number in range(DIRECTIONS):
            turn = 2 * math.pi * number / DIRECTIONS
            here.teleport(eye, eye + np.array([math.cos(turn), math.sin(turn), 0]))
            calls.append(here.stats["drawCalls"])
            triangles.append(here.stats["triangles"])
        textures = here.page.evaluate("window.seen.mostTextureBytes")
        on = f" ({device.name})"
        around = _tile_bytes(host, room)
        yield Figure(f"the first view sharp{on}", device.room_bytes, at_entry, "KB", KB)
        yield Figure(f"sharp all around{on}", device.room_bytes, around, "KB", KB)
        yield Figure(f"texture memory{on}", device.texture_bytes, textures, "MB", MB)
        yield Figure(f"draw calls{on}", 100, max(calls))
        yield Figure(f"triangles{on}", math.inf, max(triangles))
        _leave(here)


def _tile_bytes(host: Host, room: str) -> int:
    folder = f"/rooms/{room}/"
    return sum(
        answer.size
        for answer in host.answers
        if answer.path.startswith(folder) and answer.path.endswith((".glb", "tileset.json"))
    )


def heap_growth(browser: Browser, host: Host, rooms: Sequence[str]) -> float:
    """How much more script holds after many changes of rooms, as a share: last over first tenth."""
    here = _come(browser, host, rooms[0], Device("small", {"size": (480, 320)}, 0, 0))
    here.await_room(rooms[0])
    session = here.page.context.new_cdp_session(here.page)
    session.send("HeapProfiler.enable")
    held = []
    for change in range(1, CHANGES + 1):
        room = rooms[change % len(rooms)]
        here.page.evaluate(
            "(room) => { history.pushState(null, '', new URL(`../${room}/index.html`, location));"
            " dispatchEvent(new PopStateEvent('popstate')); }",
            room,
        )
        here.await_room(room)
        here.settle()
        session.send("HeapProfiler.collectGarbage")
        held.append(session.send("Runtime.getHeapUsage")["usedSize"])
    _leave(here)
    tenth = CHANGES // 10
    return float(np.mean(held[-tenth:]) / np.mean(held[:tenth]) - 1)


def _come(browser: Browser, host: Host, room: str, device: Device) -> Visitor:
    """A visitor who opens a room's page, over a network as visitors have it."""
    here = visitor(browser, host.origin, **device.settings)
    here.page.add_init_script(path=WATCHING)
    slowed(here.page)
    host.answers.clear()
    here.page.goto(f"{host.origin}/rooms/{room}/index.html")
    return here


def _leave(here: Visitor) -> None:
    here.page.context.close()
    if here.faults:
        raise RuntimeError("\n".join(here.faults))
