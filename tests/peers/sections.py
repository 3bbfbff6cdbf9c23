"""docs/benchmarks.md: one section a command, each rewritten by its own alone."""

from __future__ import annotations

from pathlib import Path

TITLE = "# Benchmarks"


def rewrite(file: Path, heading: str, text: str) -> None:
    """Put a section in the place of the one with its heading, or at the end.

    Args:
        file: Markdown whose sections begin with ``## ``; made where there is none.
        heading: Of the section.
        text: What stands below it.
    """
    told = file.read_text(encoding="utf-8") if file.exists() else TITLE
    head, *sections = told.split("\n## ")
    if not sections:
        head = TITLE
    fresh = f"{heading}\n\n{text.strip()}\n"
    names = [section.split("\n", 1)[0] for section in sections]
    if heading in names:
        sections[names.index(heading)] = fresh
    else:
        sections.append(fresh)
    body = "".join(f"\n## {section.strip()}\n" for section in sections)
    file.write_text(f"{head.strip()}\n{body}", encoding="utf-8")
