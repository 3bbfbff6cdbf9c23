"""Prose: the publisher's Markdown as HTML that carries none of theirs, and as plain words."""

from __future__ import annotations

import re
from functools import cache
from html import unescape
from typing import Final

import nh3
from markdown_it import MarkdownIt

_TAGS: Final = {
    "a", "blockquote", "br", "code", "em", "h1", "h2", "h3", "h4", "h5", "h6", "hr", "li", "ol",
    "p", "pre", "strong", "table", "tbody", "td", "th", "thead", "tr", "ul",
}  # fmt: skip
_ATTRIBUTES: Final = {"a": {"href", "title"}, "ol": {"start"}}


@cache
def _markdown() -> MarkdownIt:
    # Text comes from many hands: no HTML of theirs; pictures belong to notes.
    return MarkdownIt("commonmark", {"html": False}).enable("table").disable("image")


def html_of(markdown: str) -> str:
    """Markdown as HTML: no scripts, no pictures, links to the web and to mail alone."""
    rendered: str = _markdown().render(markdown)
    return nh3.clean(
        rendered,
        tags=_TAGS,
        attributes=_ATTRIBUTES,
        url_schemes={"http", "https", "mailto"},
        link_rel="noopener",
    ).strip()


def plain(html: str, most: int | None = None) -> str:
    """The words of HTML on one line, cut at a word where there are more than ``most`` letters."""
    html = re.sub(r"</?(a|code|em|strong)\b[^>]*>", "", html)
    words = " ".join(unescape(re.sub(r"<[^>]*>", " ", html)).split())
    if most is None or len(words) <= most:
        return words
    return words[:most].rsplit(" ", 1)[0] + "…"
