"""One file gives a tour its looks; what is wrong with it is told by its key."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tourgen.errors import Faults
from tourgen.tour.theme import Theme, darkened, load_theme, luminance


def write(folder: Path, text: str) -> Path:
    (folder / "theme.toml").write_text(text, "utf-8")
    return folder


def test_a_tour_without_a_theme_has_the_usual_looks(tmp_path: Path) -> None:
    assert load_theme(tmp_path) == Theme()


def test_colours_font_and_logo_are_published(tmp_path: Path) -> None:
    (tmp_path / "logo.svg").write_text("<svg/>")
    (tmp_path / "Sea.woff2").write_bytes(b"wOF2")
    text = 'accent = "#e9c46a"\nscheme = "light"\nlogo = "logo.svg"\nheading_font = "Sea.woff2"'
    theme = load_theme(write(tmp_path, text))
    assert theme.scheme == "light"
    assert theme.logo == "theme/logo.svg"
    assert theme.style
    style = theme.files[theme.style].decode()
    assert "--accent-dark: #e9c46a" in style
    assert 'src: url("heading-font.woff2") format("woff2")' in style
    assert theme.files["theme/heading-font.woff2"] == b"wOF2"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('accent = "gold"', "theme.toml: accent: expected a colour such as `#e9c46a`"),
        ('akcent = "#e9c46a"', "theme.toml: akcent: unknown key"),
        ('logo = "logo.svg"', "theme.toml: logo: expected a file, found none at `logo.svg`"),
        ('scheme = "blue"', "theme.toml: scheme: expected one of auto, light, dark"),
        ("accent = gold", "theme.toml: line 1, column 10: expected TOML"),
    ],
)
def test_what_is_wrong_is_told(tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises(Faults) as caught:
        load_theme(write(tmp_path, text))
    assert caught.value.faults[0].message.startswith(said)


def test_a_logo_must_be_a_picture(tmp_path: Path) -> None:
    (tmp_path / "logo.pdf").write_text("%PDF")
    with pytest.raises(Faults) as caught:
        load_theme(write(tmp_path, 'logo = "logo.pdf"'))
    assert "expected a file that ends in .svg, .png, .webp" in caught.value.faults[0].message


@given(st.integers(0, 0xFFFFFF).map(lambda value: f"#{value:06x}"))
def test_an_accent_is_darkened_until_it_is_read_on_white(color: str) -> None:
    contrast = 1.05 / (luminance(darkened(color)) + 0.05)
    assert contrast >= 4.5
