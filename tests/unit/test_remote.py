"""Scans on a web server are fetched once, and again when they have changed."""

from __future__ import annotations

import os
import threading
from collections.abc import Iterator
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest

from tourgen.errors import InputError
from tourgen.remote import fetch, local


@pytest.fixture
def web(tmp_path: Path) -> Iterator[tuple[Path, str]]:
    """A folder, and the address that it is served under."""
    folder = tmp_path / "web"
    folder.mkdir()
    answer = partial(SimpleHTTPRequestHandler, directory=str(folder))
    with ThreadingHTTPServer(("127.0.0.1", 0), answer) as server:
        thread = threading.Thread(target=server.serve_forever, args=(0.01,))
        thread.start()
        yield folder, f"http://127.0.0.1:{server.server_address[1]}"
        server.shutdown()
        thread.join()


def test_a_scan_on_the_web_is_fetched_again_when_it_has_changed(
    web: tuple[Path, str], tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    folder, address = web
    name = f"{address}/room.ply"
    (folder / "room.ply").write_bytes(b"first")
    fetch(tmp_path, name)
    assert local(tmp_path, name).read_bytes() == b"first"
    fetch(tmp_path, name)
    assert capfd.readouterr().err.count("fetching") == 1
    (folder / "room.ply").write_bytes(b"later")
    os.utime(folder / "room.ply", (2e9, 2e9))
    fetch(tmp_path, name)
    assert local(tmp_path, name).read_bytes() == b"later"


def test_what_is_not_there_is_told(web: tuple[Path, str], tmp_path: Path) -> None:
    with pytest.raises(InputError, match="expected a file, found none at"):
        fetch(tmp_path, f"{web[1]}/absent.ply")
