"""Carried: a published page that names nothing any more that lies beside it."""

from __future__ import annotations

import posixpath
import re
from base64 import b64encode
from collections.abc import Sequence
from html import escape
from html.parser import HTMLParser
from pathlib import Path
from typing import Final
from urllib.parse import unquote, urlsplit

from tourgen.headers import content_type

_MEDIA: Final = frozenset({"audio", "img", "source", "track", "video"})
_PREVIEWED: Final = ("og:", "twitter:")
"""What previews of a link read; a file on a disk has none."""

_URL: Final = re.compile(r"""url\(["']?(?!data:|#)([^"')]+)["']?\)""")
_ROOM_PAGE: Final = re.compile(r"rooms/([^/]+)/index\.html")
_EMPTY: Final = re.compile(r"<(li|ul|p)>\s*</\1>\n?")

Attributes = dict[str, str | None]


def data_address(path: str, content: bytes) -> str:
    """A file as an address that holds it."""
    kind = content_type(path).replace(" ", "")
    return f"data:{kind};base64,{b64encode(content).decode('ascii')}"


class Carrying(HTMLParser):
    """A published page whose styles, icon and poster are in it.

    Its other pictures and sounds are named for the viewer (``data-shows``), which lets them show
    what it carries where the room cannot be drawn. Links lead to places in the page or are left
    out, and so are scripts.

    Args:
        site: The site's folder.
        page: The page's path there.
        rooms: Ids of the rooms that it shall have places of.
        first: Path of the picture that is seen before any script runs.

    Attributes:
        text: The page.
        styles: What its style sheets hold.
        poster: Path of the picture that it carries, or "".
    """

    def __init__(self, site: Path, page: str, rooms: Sequence[str], first: str = "") -> None:
        super().__init__(convert_charrefs=False)
        self.styles: list[str] = []
        self.poster = ""
        self._site, self._page, self._rooms, self._first = site, page, rooms, first
        self._parts: list[str] = []
        self._left_out = ""  # the element whose end is waited for
        self.feed((site / page).read_text("utf-8"))
        self.close()
        self.text = _EMPTY.sub("", _EMPTY.sub("", "".join(self._parts)))

    # ---- what the parser finds

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Put an element as it is, changed, or not at all."""
        given = dict(attrs)
        if tag == "a":
            self._put_link(given)
        elif tag == "link":
            self._put_resource(given)
        elif tag == "script" and "src" in given:
            self._left_out = tag
        elif tag in _MEDIA and "src" in given:
            self._put_medium(tag, given)
        elif tag == "meta" and _is_of_hosts(given):
            return
        elif "data-site" in given:
            self._put_tag(tag, {key: value for key, value in given.items() if key != "data-site"})
        else:
            self._put(self.get_starttag_text() or "")

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Put an element that has no content."""
        self.handle_starttag(tag, attrs)

    def handle_endtag(self, tag: str) -> None:
        """Put it, or end what is left out."""
        if tag == self._left_out:
            self._left_out = ""
        else:
            self._put(f"</{tag}>")

    def handle_data(self, data: str) -> None:
        """Put text."""
        self._put(data)

    def handle_entityref(self, name: str) -> None:
        """Put it as it stands."""
        self._put(f"&{name};")

    def handle_charref(self, name: str) -> None:
        """Put it as it stands."""
        self._put(f"&#{name};")

    def handle_comment(self, data: str) -> None:
        """Put it."""
        self._put(f"<!--{data}-->")

    def handle_decl(self, decl: str) -> None:
        """Put it."""
        self._put(f"<!{decl}>")

    # ---- what becomes of it

    def _put(self, text: str) -> None:
        if not self._left_out:
            self._parts.append(text)

    def _put_tag(self, tag: str, attributes: Attributes) -> None:
        given = (f' {k}="{escape(v)}"' if v is not None else f" {k}" for k, v in attributes.items())
        self._put(f"<{tag}{''.join(given)}>")

    def _put_link(self, given: Attributes) -> None:
        path = self._path(given.get("href"))
        if path is None:
            self._put(self.get_starttag_text() or "")
        elif (room := _ROOM_PAGE.fullmatch(path)) and room[1] in self._rooms:
            self._put_tag("a", {**given, "href": f"#room={room[1]}"})
        else:
            self._left_out = "a"

    def _put_resource(self, given: Attributes) -> None:
        path = self._path(given.get("href"))
        if path is None:
            self._put(self.get_starttag_text() or "")
        elif given.get("rel") == "icon":
            self._put_tag("link", {**given, "href": self._data(path)})
        elif given.get("rel") == "stylesheet":
            style = self._style(path)
            self.styles.append(style)
            self._put(f"<style>{style}</style>")

    def _put_medium(self, tag: str, given: Attributes) -> None:
        path = self._path(given.get("src"))
        if path is None:
            self._put(self.get_starttag_text() or "")
        elif path == self._first and not self.poster:
            self.poster = path
            self._put_tag(tag, {**given, "src": self._data(path), "data-file": path})
        else:
            rest = {key: value for key, value in given.items() if key != "src"}
            self._put_tag(tag, {**rest, "data-shows": path})

    def _style(self, path: str) -> str:
        """A style sheet with the fonts that it names."""
        folder = posixpath.dirname(path)
        return _URL.sub(
            lambda url: f'url("{self._data(posixpath.join(folder, url[1]))}")',
            (self._site / path).read_text("utf-8").strip(),
        )

    def _path(self, address: str | None) -> str | None:
        """The path in the site of what a relative address names; None for any other address."""
        parts = urlsplit(address or "")
        if parts.scheme or parts.netloc or not parts.path:
            return None
        return posixpath.normpath(
            posixpath.join(posixpath.dirname(self._page), unquote(parts.path))
        )

    def _data(self, path: str) -> str:
        return data_address(path, (self._site / path).read_bytes())


def _is_of_hosts(meta: Attributes) -> bool:
    """Whether it speaks of what comes from a host; a single file says anew how it is written."""
    name = meta.get("property") or meta.get("name") or ""
    return "charset" in meta or name.startswith(_PREVIEWED)
