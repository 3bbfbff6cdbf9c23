"""Pages: a page a room that stands without script, and what search engines and previews read.

Templates come from the tour's own folder ``templates/`` where it has one of that name, else from
tourgen's.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from functools import cached_property
from importlib.resources import files as package_files
from pathlib import Path
from typing import Any, Final
from urllib.parse import urljoin, urlsplit

import jinja2

from tourgen.errors import InputError, MissingTool
from tourgen.site.prose import plain
from tourgen.tour.theme import Theme

_DESCRIPTION_LENGTH: Final = 200
_RIGHT_TO_LEFT: Final = frozenset({"ar", "fa", "he", "ur", "yi", "ps", "sd", "ug", "dv"})

Json = dict[str, Any]


class Pages:
    """The pages of one tour.

    Args:
        folder: The tour's, which may hold templates.
        told: What tour.json says.
        theme: Its looks.
        viewer: The names of the viewer's files.
        kiosk: What the kiosk's page is told.
    """

    def __init__(self, folder: Path, told: Json, theme: Theme, viewer: Json, kiosk: Json) -> None:
        self._folder, self._told, self._theme, self._viewer = folder, told, theme, viewer
        self._kiosk = kiosk
        self._language: str = told["languages"][0]

    def every(self) -> Iterator[tuple[str, str]]:
        """Path and content of each but the report."""
        rooms = self._told["rooms"]
        start = next(room for room in rooms if room["id"] == self._told["start"])
        for room in rooms:
            yield f"rooms/{room['id']}/index.html", self._room(room, site="../../", is_start=False)
        yield "index.html", self._room(start, site="", is_start=True)
        yield "kiosk.html", self._page("kiosk.html", site="", room=start, kiosk=self._kiosk)
        yield "404.html", self._page("404.html", site=self._root or "../../")
        if self._told["address"]:
            yield "sitemap.xml", self._page("sitemap.xml")
            yield "robots.txt", f"User-agent: *\nAllow: /\nSitemap: {self._at('sitemap.xml')}\n"

    def report(self, report: Json) -> str:
        """The page of the report."""
        return self._page("report.html", site="", report=report)

    @property
    def _root(self) -> str | None:
        """The path of the site's folder on its host, where that is known."""
        address = self._told["address"]
        return urlsplit(address).path if address else None

    def _at(self, path: str) -> str | None:
        """The address of a file, where it is known."""
        address = self._told["address"]
        return urljoin(address, path) if address else None

    def _room(self, room: Json, site: str, *, is_start: bool) -> str:
        path = "" if is_start else f"rooms/{room['id']}/index.html"
        return self._page(
            "room.html",
            site=site,
            room=room,
            is_start=is_start,
            description=self._description(room),
            address=self._at(path),
            structured=self._structured(room, is_start=is_start),
        )

    def _page(self, template: str, **values: Any) -> str:
        try:
            return self._templates.get_template(template).render(
                tour=self._told,
                viewer=self._viewer,
                theme=self._theme,
                language=self._language,
                direction=direction,
                at=self._at,
                **values,
            )
        except jinja2.TemplateError as error:
            line = f" line {error.lineno}" if isinstance(error, jinja2.TemplateSyntaxError) else ""
            raise InputError(
                f"`templates/{template}`: expected a template that can be filled in, "
                f"found{line}: {error.message}",
                "compare it with tourgen's own, or remove it",
            ) from error

    @cached_property
    def _templates(self) -> jinja2.Environment:
        folders = [self._folder / "templates", _shipped("_templates", "templates")]
        return jinja2.Environment(
            loader=jinja2.FileSystemLoader(folders),
            autoescape=True,
            undefined=jinja2.StrictUndefined,
            trim_blocks=True,
            lstrip_blocks=True,
        )

    def _description(self, room: Json) -> str:
        """The beginning of the room's text, for search engines and previews; else the names."""
        text = plain(room["text"].get(self._language, ""), _DESCRIPTION_LENGTH)
        names = room["title"][self._language], self._told["title"][self._language]
        return text or " – ".join(dict.fromkeys(names))

    def _structured(self, room: Json, *, is_start: bool) -> str:
        """What the page is about, as schema.org's JSON-LD."""
        language = self._language
        tour = {"@type": "TouristAttraction", "name": self._told["title"][language]}
        about: Json = {
            "@context": "https://schema.org",
            **(tour if is_start else {"@type": "Place", "name": room["title"][language]}),
            "description": self._description(room),
        }
        if not is_start:
            about["containedInPlace"] = tour
        if self._told["address"]:
            about["image"] = self._at(room["preview"])
            about["url"] = self._at("" if is_start else f"rooms/{room['id']}/index.html")
        # `<` would end the element that holds it.
        return json.dumps(about, ensure_ascii=False).replace("<", "\\u003c")


def direction(language: str) -> str:
    """Which way a language is written, as the attribute ``dir`` says it."""
    return "rtl" if language.split("-")[0] in _RIGHT_TO_LEFT else "ltr"


def viewer_folder() -> Path:
    """Where the compiled viewer lies.

    Raises:
        MissingTool: It has not been compiled.
    """
    folder = _shipped("_viewer", "static/dist")
    if not (folder / "manifest.json").is_file():
        raise MissingTool(
            f"viewer: expected it compiled in `{folder}`, found none", "run `make viewer`"
        )
    return folder


def _shipped(packaged: str, in_checkout: str) -> Path:
    """A folder that a wheel carries inside the package, and a checkout beside it."""
    package = Path(str(package_files("tourgen")))
    inside = package / packaged
    return inside if inside.is_dir() else package.parent / in_checkout
