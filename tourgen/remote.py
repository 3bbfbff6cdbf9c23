"""Remote files: what lies behind an address that fsspec opens, `s3://`, `https://` and their like.

A scan is fetched once and kept beside the cache until it changes there; a site is built here and
then sent. Programs and pages only ever see files of this machine.
"""

from __future__ import annotations

import hashlib
import shutil
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from tourgen.errors import InputError, MissingTool

_FOLDER = Path(".tourgen") / "fetched"
_CHANGES = ("size", "ETag", "Last-Modified")
"""What a web server tells of a file that has changed."""
_PAGES = (".html", ".json")
"""Of a site, these are sent last: until then it shows what was there before."""


def is_remote(name: str) -> bool:
    """Whether a name is an address, and no path."""
    return "://" in name


def local(folder: Path, name: str) -> Path:
    """Where a file lies on this machine.

    Args:
        folder: The tour's, where paths start.
        name: A path, or the address of a file that has been fetched.
    """
    if not is_remote(name):
        return folder / name
    kept = hashlib.sha256(name.encode()).hexdigest()[:16]
    return folder / _FOLDER / kept / name.rstrip("/").rsplit("/", 1)[-1]


def has_fetched(folder: Path) -> bool:
    """Whether a tour takes anything from elsewhere, or once did."""
    return (folder / _FOLDER).exists()


def fetch(folder: Path, name: str) -> None:
    """Bring a remote file here, unless it is here as it is there.

    Raises:
        InputError: It cannot be read.
        MissingTool: The library for such addresses is not installed.
    """
    target = local(folder, name)
    note = target.parent / "state"
    with _told(name):
        storage, path = _storage(name)
        if not storage.exists(path):
            raise InputError(
                f"expected a file, found none at `{name}`", "look at its address in tour.toml"
            )
        about = storage.info(path)
        # What `ukey` tells of a web page is its address alone.
        state = " ".join(str(each) for each in (storage.ukey(path), *map(about.get, _CHANGES)))
        if target.exists() and note.exists() and note.read_text("utf-8") == state:
            return
        size = f", {about['size'] / 1e6:.0f} MB" if about.get("size") else ""
        print(f"fetching {name}{size}", file=sys.stderr, flush=True)
        shutil.rmtree(target.parent, ignore_errors=True)
        target.parent.mkdir(parents=True)
        aside = target.with_name(f".{target.name}")
        storage.get_file(path, str(aside))
        aside.rename(target)
        note.write_text(state, "utf-8")


def send(site: Path, address: str) -> None:
    """Put a site where an address says, in place of what lies there.

    Raises:
        InputError: It cannot be written, or other files lie there.
        MissingTool: The library for such addresses is not installed.
    """
    with _told(address):
        storage, root = _storage(address)
        root = root.rstrip("/")
        there = storage.find(root) if storage.exists(root) else []
        before = {each.removeprefix(root).lstrip("/") for each in there}
        if before and "tour.json" not in before:
            raise InputError(
                f"expected a tour or nothing at `{address}`, found other files",
                "choose another place with `-o`",
            )
        files = sorted(each for each in site.rglob("*") if each.is_file())
        for file in sorted(files, key=lambda each: each.suffix in _PAGES):
            name = file.relative_to(site).as_posix()
            storage.makedirs(f"{root}/{name}".rsplit("/", 1)[0], exist_ok=True)
            storage.put_file(str(file), f"{root}/{name}")
            before.discard(name)
        for name in sorted(before):
            storage.rm_file(f"{root}/{name}")


def _storage(address: str) -> tuple[Any, str]:
    """The file system behind an address, as it is now, and the path on it."""
    from fsspec.core import url_to_fs

    storage, path = url_to_fs(address, skip_instance_cache=True, use_listings_cache=False)
    return storage, str(path)


@contextmanager
def _told(address: str) -> Iterator[None]:
    """Tell in words what storage libraries raise, which is all manner of things."""
    try:
        yield
    except (InputError, MissingTool):
        raise
    except ImportError as error:
        raise MissingTool(
            f"`{address}`: expected a library for it, found none", str(error)
        ) from None
    except Exception as error:
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise InputError(
            f"`{address}`: expected storage that answers, found: {reason}",
            "check the address, and the credentials in the environment",
        ) from error
