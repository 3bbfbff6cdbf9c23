"""Theme: the colours, the font and the logo of a tour, from ``theme.toml`` in its folder."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Final, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError, ValidationInfo

from tourgen.errors import Faults, InputError
from tourgen.tour.faults import faults_of
from tourgen.tour.toml import read_toml
from tourgen.tour.values import Context, File, Form, fault, shown

THEME_FILE: Final = "theme.toml"
_COLOR: Final = re.compile(r"#[0-9a-fA-F]{6}")
_FONTS: Final = {".woff2": "woff2", ".woff": "woff", ".ttf": "truetype", ".otf": "opentype"}
_LOGOS: Final = (".svg", ".png", ".webp")
_READABLE: Final = 0.18
"""The luminance up to which a colour is read on white."""


def _check_color(value: str) -> str:
    if not _COLOR.fullmatch(value):
        raise fault(f"expected a colour such as `#e9c46a`, found {shown(value)}")
    return value


def _one_of(name: str, info: ValidationInfo) -> str:
    kinds = _LOGOS if info.field_name == "logo" else tuple(_FONTS)
    if Path(name).suffix.lower() not in kinds:
        raise fault(f"expected a file that ends in {', '.join(kinds)}, found {shown(name)}")
    return name


Color = Annotated[str, AfterValidator(_check_color), Form("colour")]
Asset = Annotated[File, AfterValidator(_one_of)]


class ThemeFile(BaseModel):
    """All that theme.toml may say."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    accent: Color | None = Field(
        default=None, description="Of links and of what is chosen, on dark ground."
    )
    accent_light: Color | None = Field(
        default=None, description="The same on light ground. Left out: `accent`, darkened."
    )
    scheme: Literal["auto", "light", "dark"] = Field(
        default="auto",
        description="Light or dark sheets and pages; `auto`: as the visitor's system has it.",
    )
    logo: Asset | None = Field(
        default=None, description="A logo, `.svg`, `.png` or `.webp`, beside the tour's title."
    )
    font: Asset | None = Field(default=None, description="A font for texts.")
    heading_font: Asset | None = Field(default=None, description="A font for headings.")


@dataclass(frozen=True, slots=True)
class Theme:
    """What it comes to.

    Attributes:
        scheme: "auto", "light" or "dark".
        style: Path of a style sheet, if there is anything to say.
        logo: Path of the logo, if there is one.
        files: What is published of it, by path.
    """

    scheme: str = "auto"
    style: str | None = None
    logo: str | None = None
    files: Mapping[str, bytes] = field(default_factory=dict)


def load_theme(folder: Path) -> Theme:
    """Read `folder`/theme.toml, if there is one.

    Raises:
        Faults: All that is wrong with it.
    """
    try:
        data = read_toml(folder / THEME_FILE)
    except FileNotFoundError:
        return Theme()
    try:
        told = ThemeFile.model_validate(data, context=Context(folder, (), ()))
    except ValidationError as error:
        raise Faults(
            tuple(
                InputError(f"{THEME_FILE}: {each.message}", each.hint)
                for each in faults_of(error, data, ThemeFile)
            )
        ) from None
    return _published(told, folder)


def _published(told: ThemeFile, folder: Path) -> Theme:
    files: dict[str, bytes] = {}

    def publish(name: str | None, role: str) -> str | None:
        if name is None:
            return None
        path = f"theme/{role}{Path(name).suffix.lower()}"
        files[path] = (folder / name).read_bytes()
        return path

    logo = publish(told.logo, "logo")
    rules = [
        *_font(publish(told.font, "font"), "tour-text", "--sans"),
        *_font(publish(told.heading_font, "heading-font"), "tour-heading", "--serif"),
    ]
    if told.accent:
        rules.append(f":root {{ --accent-dark: {told.accent}; }}")
    light = told.accent_light or (told.accent and darkened(told.accent))
    if light:
        rules.append(f":root {{ --accent-light: {light}; }}")
    style = "theme/theme.css" if rules else None
    if style:
        files[style] = ("\n".join(rules) + "\n").encode()
    return Theme(told.scheme, style, logo, files)


def _font(path: str | None, family: str, variable: str) -> list[str]:
    if path is None:
        return []
    name = Path(path).name
    return [
        f'@font-face {{ font-family: "{family}"; font-display: swap; '
        f'src: url("{name}") format("{_FONTS[Path(path).suffix]}"); }}',
        f':root {{ {variable}: "{family}", system-ui, sans-serif; }}',
    ]


def darkened(color: str) -> str:
    """A colour dark enough to be read on white: a contrast of at least 4.5 to 1 (WCAG 2.2)."""
    part = min(1.0, _READABLE / max(luminance(color), 1e-6))
    return "#" + "".join(f"{int(255 * _encoded(part * value)):02x}" for value in _linear(color))


def luminance(color: str) -> float:
    """Relative luminance of a colour `#rrggbb`, as WCAG 2.2 defines it."""
    red, green, blue = _linear(color)
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


def _linear(color: str) -> list[float]:
    channels = [int(color[at : at + 2], 16) / 255 for at in (1, 3, 5)]
    return [((c + 0.055) / 1.055) ** 2.4 if c > 0.04045 else c / 12.92 for c in channels]


def _encoded(value: float) -> float:
    return float(1.055 * value ** (1 / 2.4) - 0.055) if value > 0.0031308 else 12.92 * value
