"""All that tour.toml may say: every key once, with its type, its range and its meaning.

The checks that need more than one key (a link's target, a text's language, a file that must
exist) are validators of the key itself, fed by a context, so that one fault never hides another.

Coordinates are in the frame of the scan after `unit` and `up` were applied: metres, right-handed,
z up. Paths are relative to the folder of the tour file.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Final, Literal

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    ValidationInfo,
    field_validator,
    model_validator,
)

from tourgen.errors import InputError
from tourgen.tour.values import (
    Address,
    File,
    Form,
    Hours,
    Languages,
    Moment,
    NeighbourRef,
    Number,
    OnlyWith,
    Pin,
    Pose,
    Position,
    Radii,
    RoomId,
    RoomRef,
    Stations,
    Text,
    TextFiles,
    Whole,
    fault,
    near,
    shown,
)

TOUR_FILE: Final = "tour.toml"
UNITS: Final[Mapping[str, float]] = {"m": 1.0, "cm": 0.01, "mm": 0.001, "ft": 0.3048}
SOUNDS: Final = (".mp3", ".m4a", ".ogg", ".wav")
"""What browsers play."""


class _Table(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class Box(_Table):
    """A box along the axes."""

    min: Position = Field(description="The lowest corner, metres.")
    max: Position = Field(description="The highest corner, metres.")

    @model_validator(mode="after")
    def _has_inside(self) -> Box:
        for axis, low, high in zip("xyz", self.min, self.max, strict=True):
            if low >= high:
                raise fault(
                    f"expected min below max along {axis}, found {low:g} and {high:g}",
                    "swap them",
                )
        return self


class Viewpoint(_Table):
    """Where a visitor stands and what the visitor faces."""

    position: Position = Field(description="The eye, metres.")
    look_at: Position = Field(description="What the eye looks at, metres.")

    @model_validator(mode="after")
    def _looks_somewhere(self) -> Viewpoint:
        if self.position == self.look_at:
            raise fault("expected `look_at` away from `position`, found both at one place")
        return self


class Place(_Table):
    """Where a room stands in its building."""

    at: Position = Field(
        description="Where the origin of the room's coordinates lies in the building, metres."
    )
    turn_deg: Number = Field(
        default=0.0,
        ge=-360,
        le=360,
        description="By how much the room is turned, counter-clockwise seen from above.",
    )


class ScanRef(_Table):
    """A scan of a room: a file name, or a table."""

    file: File = Field(
        description="The scan: `.ply` or `.e57`, or the address of one that fsspec opens, as `s3://`."
    )
    pose: Pose | None = Field(
        default=None,
        description="Rotation and shift, four rows of four numbers, that carry this scan's "
        "coordinates into the frame of the room; in metres, after `unit` and `up`.",
    )
    station: Position | None = Field(
        default=None,
        description="Where the scanner stood, in this scan's coordinates before `pose`; "
        "only for a scan from one station.",
    )


def _as_reference(value: object) -> object:
    return {"file": value} if isinstance(value, str) else value


class Clean(_Table):
    """Which points are kept."""

    min_points: Whole = Field(
        default=10_000, ge=100, description="A room of fewer points is refused."
    )
    thin_mm: Number | None = Field(
        default=None,
        ge=0.5,
        le=100,
        description="Points closer together than this are merged for the surface; the colours "
        "come from all points. Left out: half of `surface.detail_mm`; more, up to twice as much, "
        "where the scan is denser than that.",
    )


_POISSON: Final = OnlyWith(("poisson",))
_BALLS: Final = OnlyWith(("ball-pivoting",))
_DISTANCE: Final = OnlyWith(("auto", "signed-distance"))
_CRUST: Final = OnlyWith(("crust",))


class Surface(_Table):
    """How the surface is made from the points."""

    method: Literal["auto", "poisson", "ball-pivoting", "signed-distance", "crust"] = Field(
        default="auto",
        description="The method. `auto`: signed distance where the scan is dense, the "
        "winding number across its gaps. `poisson`: closes every gap, rounds edges. "
        "`ball-pivoting`: a mesh of the points themselves, open where they end. "
        "`signed-distance`: flat walls and sharp edges, open where the points end; the fastest, "
        "for a preview. `crust`: for small clean clouds.",
    )
    detail_mm: Number | None = Field(
        default=None,
        ge=1,
        le=500,
        description="The finest detail that the surface shall show; at most a tenth of the room. "
        "Left out: the spacing of the scan's points in the middle, at least 6.",
    )
    offset_mm: Number = Field(
        default=0.0,
        ge=-100,
        le=100,
        description="Moves the surface along its normals, into the room; below zero, away from it.",
    )
    depth: Annotated[Whole | None, _POISSON] = Field(
        default=None,
        ge=5,
        le=12,
        description="`poisson`: the octree's depth, whatever `detail_mm` says; a step halves its "
        "cells and takes four times the memory and time. Left out: such that its cells are as "
        "wide as `detail_mm`.",
    )
    full_depth: Annotated[Whole, _POISSON] = Field(
        default=5,
        ge=1,
        le=8,
        description="`poisson`: down to this depth the octree is complete, points or none; at most "
        "`depth`.",
    )
    samples_per_node: Annotated[Number, _POISSON] = Field(
        default=1.0,
        ge=0.5,
        le=20,
        description="`poisson`: how many points make a cell; 15 to 20 for a noisy scan.",
    )
    point_weight: Annotated[Number, _POISSON] = Field(
        default=16.0,
        ge=0,
        le=100,
        description="`poisson`: how strongly the surface is drawn through the points; 0 is the "
        "unscreened method.",
    )
    linear_fit: Annotated[bool, _POISSON, Form("true or false")] = Field(
        default=False,
        strict=True,
        description="`poisson`: places vertices by linear instead of quadratic interpolation.",
    )
    radii_mm: Annotated[Radii | None, _BALLS] = Field(
        default=None,
        min_length=1,
        max_length=8,
        description="`ball-pivoting`: radii of the balls, small to large. Left out: once, twice "
        "and four times the spacing of the points.",
    )
    agree_deg: Annotated[Number, _BALLS] = Field(
        default=75.0,
        ge=10,
        le=90,
        description="`ball-pivoting`: a face whose normal lies farther from that of one of its "
        "points is dropped.",
    )
    crease_deg: Annotated[Number, _DISTANCE] = Field(
        default=12.0,
        ge=3,
        le=45,
        description="`auto`, `signed-distance`: spread of the normals on one side of a crease; "
        "less keeps creases sharper and walls rougher.",
    )
    neighbours: Annotated[Whole, _DISTANCE] = Field(
        default=16,
        ge=4,
        le=64,
        description="`auto`, `signed-distance`: points that speak for a plane; more are smoother.",
    )
    reach: Annotated[Number, _DISTANCE] = Field(
        default=1.5,
        ge=0.5,
        le=5,
        description="`auto`, `signed-distance`: how far a point's plane goes on, in spacings.",
    )
    filter_deg: Annotated[Number, _CRUST] = Field(
        default=60.0,
        ge=10,
        le=90,
        description="`crust`: how far a face may lie from square to the line to the pole at its "
        "widest corner.",
    )

    @field_validator("full_depth")
    @classmethod
    def _within_depth(cls, value: int, info: ValidationInfo) -> int:
        depth = info.data.get("depth")  # none where it is itself at fault
        if depth is not None and value > depth:
            raise fault(f"expected at most `depth`, {depth}, found {value}")
        return value


class Texture(_Table):
    """How fine the pictures on the surface are."""

    texel_mm: Number = Field(
        default=4.0,
        ge=0.5,
        le=100,
        description="Edge of a texel on the surface at the finest level; never finer than the "
        "scan's own points.",
    )
    quality: Whole = Field(default=80, ge=1, le=100, description="Quality of the WebP pictures.")


class Link(_Table):
    """A door to another room."""

    to: NeighbourRef = Field(description="The room behind the door, by its `id`.")
    at: Position = Field(description="Where the door's mark stands in this room, metres.")
    title: Text | None = Field(
        default=None, description="What the mark says. Left out: the title of the other room."
    )
    arrive: Viewpoint | None = Field(
        default=None,
        description="Where one arrives in the other room, in that room's coordinates. Left out: "
        "at its door back, facing away from it; else at its entry.",
    )


class Note(_Table):
    """A mark that tells something about one place of the room."""

    at: Position = Field(description="Where the mark stands, metres.")
    title: Text = Field(description="What the mark says.")
    text: Text | None = Field(default=None, description="What opens on a click; Markdown.")
    image: File | None = Field(default=None, description="A picture shown with the text.")
    image_text: Text | None = Field(
        default=None,
        description="What the picture shows, for those who do not see it. Left out: the title.",
    )
    sound: File | None = Field(
        default=None, description="A sound played with the text: `.mp3`, `.m4a`, `.ogg`, `.wav`."
    )
    captions: TextFiles = Field(
        default={},
        description="What the sound says, WebVTT files; `{lang}` stands for the language.",
    )

    @field_validator("sound")
    @classmethod
    def _is_played(cls, value: str | None) -> str | None:
        if value is not None and Path(value).suffix.lower() not in SOUNDS:
            raise fault(f"expected a file that ends in {', '.join(SOUNDS)}, found {shown(value)}")
        return value

    @field_validator("captions")
    @classmethod
    def _of_a_sound(cls, value: Mapping[str, str], info: ValidationInfo) -> Mapping[str, str]:
        if value and info.data.get("sound", "") is None:
            raise fault("expected a `sound` that they belong to, found none")
        return value


class Room(_Table):
    """A room of the tour."""

    id: RoomId = Field(description="Name of the room's folder and address: a-z, 0-9, - and _.")
    title: Text = Field(default={}, description="The room's name. Left out: its `id`.")
    scans: tuple[Annotated[ScanRef, BeforeValidator(_as_reference)], ...] = Field(
        min_length=1,
        description="The room's scans: file names or tables; none may lie more than a metre apart "
        "from the others.",
    )
    stations: Stations = Field(
        default="auto",
        description='Where the scanner stood: positions, or "auto": as the scans tell, else '
        "found from the points.",
    )
    unit: Literal["m", "cm", "mm", "ft"] = Field(
        default="m",
        description="The unit of the scans' coordinates; a room narrower than 5 cm or wider than "
        "1 km in it is refused.",
    )
    up: Literal["z", "-z", "y", "-y", "x", "-x"] = Field(
        default="z", description="The axis of the scans that points up."
    )
    keep: Box | None = Field(
        default=None, description="Points outside this box are dropped. Left out: none are."
    )
    remove: tuple[Box, ...] = Field(
        default=(),
        description="Points inside these boxes are dropped: people, furniture, what is seen "
        "through a window.",
    )
    closed: tuple[Box, ...] = Field(
        default=(),
        description="Inside these boxes every gap of the surface is closed: mirrors, black "
        "screens and glass, which a scanner looks through.",
    )
    text: TextFiles = Field(
        default={},
        description="Markdown files about the room; `{lang}` stands for the language.",
    )
    captured: Moment | None = Field(
        default=None, description="When the room was scanned, a date or a date with a time."
    )
    place: Place | None = Field(
        default=None,
        description="Where the room stands in its building. Left out: where its doors say, each "
        "door and the door back being one.",
    )
    start: Viewpoint | None = Field(
        default=None,
        description="Where one enters, if not by a door. Left out: a free place is found.",
    )
    clean: Clean = Field(default=Clean(), description="Which points are kept.")
    surface: Surface = Field(default=Surface(), description="How the surface is made.")
    mesh: File | None = Field(
        default=None,
        description="A surface mended elsewhere (.ply, .obj, .stl, .glb), in the coordinates of "
        "the scans; it is taken as it is, and coloured from the scans. Left out: the surface is "
        "made from the points.",
    )
    texture: Texture = Field(default=Texture(), description="How fine the pictures are.")
    links: tuple[Link, ...] = Field(default=(), alias="link", description="Doors to other rooms.")
    notes: tuple[Note, ...] = Field(default=(), alias="note", description="Marks with texts.")

    @model_validator(mode="before")
    @classmethod
    def _enter(cls, data: Any, info: ValidationInfo) -> Any:
        if info.context and isinstance(data, dict):
            info.context.room = data.get("id")
        return data

    @property
    def unit_m(self) -> float:
        """Metres in one unit of the scans."""
        return UNITS[self.unit]


class TourHead(_Table):
    """The tour as a whole."""

    title: Text = Field(description="The tour's name.")
    languages: Languages = Field(
        default=("en",),
        min_length=1,
        description="Codes of the languages that the texts are in; the first one is shown first. "
        "Buttons and messages are there in ar, br, de, en, es, fr, it, nl and pt, and in English "
        "beside texts in any other.",
    )
    start: RoomRef | None = Field(
        default=None, description="The room in which the tour starts. Left out: the first one."
    )
    north_deg: Number | None = Field(
        default=None,
        ge=-360,
        le=360,
        description="Where north is, counter-clockwise from the x axis of the building, which is "
        "that of a room without `place.turn_deg`. Left out: plans show no north.",
    )
    credits: TextFiles = Field(
        default={},
        description="Markdown files that say who made the tour; `{lang}` stands for the language.",
    )
    license: Text | None = Field(
        default=None, description='What others may do with it, as "CC BY 4.0".'
    )
    address: Address | None = Field(
        default=None,
        description="Where the tour will be published, `https://...`. Left out: no site map is "
        "written, and pictures in previews of links are named relative to their page.",
    )


class Stop(_Table):
    """A place where the guided tour stops."""

    room: RoomRef = Field(description="The room, by its `id`.")
    position: Position = Field(description="The eye, metres, in that room's coordinates.")
    look_at: Position = Field(description="What the eye looks at, metres.")
    text: Text | None = Field(default=None, description="What is told there.")
    seconds: Number | None = Field(
        default=None,
        ge=1,
        le=600,
        description="How long the tour stays. Left out: as long as reading the text takes.",
    )


class Kiosk(_Table):
    """The tour at a screen that nobody attends."""

    idle_s: Number = Field(
        default=60.0,
        ge=10,
        le=3600,
        description="After so long without a touch visitors are asked whether they are there.",
    )
    warning_s: Number = Field(
        default=15.0,
        ge=5,
        le=120,
        description="How long they are asked; then the tour returns to its start.",
    )
    controls: Literal["usual", "low"] = Field(
        default="usual",
        description='Where controls stand; "low": all in the lower half, for those who sit.',
    )
    hours: Hours | None = Field(
        default=None,
        description='When the screen is awake, as "10:00-18:00"; a day left out of the table is '
        "closed, and hours may go beyond midnight. Left out: always.",
    )
    pin: Pin | None = Field(
        default=None,
        description="What opens the service corner: five touches in the upper left corner, then "
        "these digits. Left out: there is no service corner.",
    )


class TourFile(_Table):
    """A tour file."""

    tour: TourHead = Field(description="The tour as a whole.")
    room: tuple[Room, ...] = Field(min_length=1, description="The rooms.")
    stop: tuple[Stop, ...] = Field(
        default=(),
        description="The guided tour. Left out: every room's entry and notes.",
    )
    kiosk: Kiosk = Field(default=Kiosk(), description="The tour at a screen that nobody attends.")


class Tour(_Table):
    """A tour file that was read and found without fault.

    Attributes:
        folder: Absolute; the paths of the rooms start here.
        title: By language.
        languages: The first one is shown first.
        start: Id of the room in which the tour starts.
        north_deg: Where north is, counter-clockwise from the x axis of the building.
        credits: Markdown files by language.
        license: By language.
        address: Where the tour will be published; ends with a slash.
        rooms: In the order of the file.
        stops: Of the guided tour, as given.
        kiosk: How it is shown at a screen that nobody attends.
    """

    folder: Path
    title: Mapping[str, str]
    languages: tuple[str, ...]
    start: str
    north_deg: float | None
    credits: Mapping[str, str]
    license: Mapping[str, str] | None
    address: str | None
    rooms: tuple[Room, ...]
    stops: tuple[Stop, ...]
    kiosk: Kiosk

    def room(self, room_id: str) -> Room:
        """The room of that id.

        Raises:
            InputError: There is none.
        """
        for room in self.rooms:
            if room.id == room_id:
                return room
        ids = tuple(room.id for room in self.rooms)
        raise InputError(f"{TOUR_FILE}: room `{room_id}` does not exist", near(room_id, ids))
