"""The local server: types, ranges, headers, ports."""

from __future__ import annotations

import http.client
import os
import socket
import struct
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from tourgen.cli import main
from tourgen.errors import InputError, StageError
from tourgen.headers import SECURITY_HEADERS, headers_file
from tourgen.serve import TourServer, open_server

TILE = bytes(range(256)) * 8


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "viewer").mkdir()
    (tmp_path / "tour.json").write_text('{"format": 1, "rooms": []}')
    (tmp_path / "index.html").write_text("<!doctype html><title>Tour</title>")
    (tmp_path / "r.glb").write_bytes(TILE)
    for name in ("viewer/viewer-1.js", "viewer/d.wasm", "p.webp", "viewer/style-1.css", "i.svg"):
        (tmp_path / name).write_bytes(b"x")
    for name in ("sea.m4a", "sea.ogg", "sea.vtt", "text.woff2"):
        (tmp_path / name).write_bytes(b"x")
    (tmp_path.parent / "secret").write_text("not yours")
    return tmp_path


@pytest.fixture
def server(folder: Path) -> Iterator[TourServer]:
    with open_server(folder, port=0) as running:
        thread = threading.Thread(target=running.serve_forever, args=(0.01,))
        thread.start()
        yield running
        running.shutdown()
        thread.join()


def ask(
    server: TourServer, path: str, method: str = "GET", **headers: str
) -> tuple[http.client.HTTPResponse, bytes]:
    connection = http.client.HTTPConnection("127.0.0.1", server.server_address[1], timeout=10)
    connection.request(method, path, headers=headers)
    answer = connection.getresponse()
    body = answer.read()
    connection.close()
    return answer, body


@pytest.mark.parametrize(
    ("path", "type_"),
    [
        ("/", "text/html; charset=utf-8"),
        ("/tour.json", "application/json"),
        ("/r.glb", "model/gltf-binary"),
        ("/p.webp", "image/webp"),
        ("/i.svg", "image/svg+xml"),
        ("/sea.m4a", "audio/mp4"),
        ("/sea.ogg", "audio/ogg"),
        ("/sea.vtt", "text/vtt; charset=utf-8"),
        ("/text.woff2", "font/woff2"),
        ("/viewer/viewer-1.js", "text/javascript; charset=utf-8"),
        ("/viewer/style-1.css", "text/css; charset=utf-8"),
        ("/viewer/d.wasm", "application/wasm"),
    ],
)
def test_types(server: TourServer, path: str, type_: str) -> None:
    answer, body = ask(server, path)
    assert answer.status == 200
    assert answer.headers["Content-Type"] == type_
    assert int(answer.headers["Content-Length"]) == len(body) > 0


@pytest.mark.parametrize(
    ("asked", "first", "last"),
    [("0-99", 0, 99), ("100-", 100, 2047), ("-48", 2000, 2047), ("2000-9999", 2000, 2047)],
)
def test_ranges(server: TourServer, asked: str, first: int, last: int) -> None:
    answer, body = ask(server, "/r.glb", Range=f"bytes={asked}")
    assert answer.status == 206
    assert answer.headers["Content-Range"] == f"bytes {first}-{last}/2048"
    assert answer.headers["Content-Type"] == "model/gltf-binary"
    assert body == TILE[first : last + 1]


def test_a_range_beyond_the_end_is_refused(server: TourServer) -> None:
    answer, body = ask(server, "/r.glb", Range="bytes=2048-")
    assert (answer.status, answer.headers["Content-Range"], body) == (416, "bytes */2048", b"")


@pytest.mark.parametrize("asked", ["lines=1-2", "bytes=-", "bytes=1-2,4-5"])
def test_what_is_no_single_range_gets_the_whole(server: TourServer, asked: str) -> None:
    answer, body = ask(server, "/r.glb", Range=asked)
    assert (answer.status, body) == (200, TILE)
    assert answer.headers["Accept-Ranges"] == "bytes"


def test_heads_have_no_body(server: TourServer) -> None:
    answer, body = ask(server, "/r.glb", "HEAD")
    assert (answer.status, answer.headers["Content-Length"], body) == (200, "2048", b"")


@pytest.mark.parametrize("path", ["/", "/r.glb", "/missing"])
def test_every_answer_has_the_published_headers(server: TourServer, path: str) -> None:
    answer, _ = ask(server, path)
    for name, value in SECURITY_HEADERS.items():
        assert answer.headers[name] == value
        assert f"  {name}: {value}\n" in headers_file()


def test_the_policy_allows_nothing_inline_and_nobody_else() -> None:
    policy = SECURITY_HEADERS["Content-Security-Policy"]
    assert "default-src 'none'" in policy
    assert "unsafe-inline" not in policy
    assert "'unsafe-eval'" not in policy
    assert "http" not in policy
    assert [part.strip() for part in policy.split(";") if "*" in part] == ["frame-ancestors *"]


def test_only_what_is_named_by_its_content_is_kept_for_ever(server: TourServer) -> None:
    kept, _ = ask(server, "/viewer/viewer-1.js")
    asked_again, _ = ask(server, "/r.glb")
    assert "immutable" in kept.headers["Cache-Control"]
    assert asked_again.headers["Cache-Control"] == "no-cache"
    unchanged, body = ask(
        server, "/r.glb", **{"If-Modified-Since": asked_again.headers["Last-Modified"]}
    )
    assert (unchanged.status, body) == (304, b"")


def test_what_is_older_than_the_copy_asked_about_is_sent_all_the_same(
    server: TourServer, folder: Path
) -> None:
    """The clock was set back, or a version before was copied here with its dates."""
    kept, _ = ask(server, "/r.glb")
    (folder / "r.glb").write_bytes(b"other")
    os.utime(folder / "r.glb", (1e9, 1e9))
    for more in ({}, {"Range": "bytes=0-"}):
        asked = {"If-Modified-Since": kept.headers["Last-Modified"], **more}
        assert ask(server, "/r.glb", **asked)[1] == b"other"


def test_a_page_that_is_not_there_is_told_by_the_tours_own(
    server: TourServer, folder: Path
) -> None:
    (folder / "404.html").write_text("<!doctype html>elsewhere")
    for path in ("/rooms/attic/index.html", "/rooms/attic/", "/attic?lang=fr"):
        answer, body = ask(server, path)
        assert answer.status == 404
        assert answer.headers["Content-Type"] == "text/html; charset=utf-8"
        assert body == b"<!doctype html>elsewhere"
    answer, body = ask(server, "/rooms/attic/tiles/r.glb")
    assert answer.status == 404
    assert b"elsewhere" not in body


@pytest.mark.parametrize("path", ["/../secret", "/%2e%2e/secret", "/viewer/../../secret"])
def test_nothing_outside_the_folder_is_served(server: TourServer, path: str) -> None:
    answer, body = ask(server, path)
    assert answer.status == 404
    assert b"not yours" not in body


def test_serves_what_was_swapped_in_meanwhile(server: TourServer, folder: Path) -> None:
    folder.rename(folder.with_name("old"))
    folder.mkdir()
    (folder / "r.glb").write_bytes(b"new")
    assert ask(server, "/r.glb")[1] == b"new"


def test_takes_the_next_port_that_is_free(folder: Path) -> None:
    with open_server(folder, port=0) as first:
        taken = first.server_address[1]
        with open_server(folder, port=taken) as second:
            assert second.server_address[1] > taken
            assert second.address == f"http://127.0.0.1:{second.server_address[1]}/"


def test_has_its_port_again_at_once(folder: Path) -> None:
    """Under another port a kiosk would find neither its visits nor the tour taken along."""
    with open_server(folder, port=0) as first:
        answer = threading.Thread(target=first.handle_request)
        answer.start()
        port = first.server_address[1]
        with socket.create_connection(("127.0.0.1", port)) as visitor:
            visitor.sendall(b"GET /r.glb HTTP/1.1\r\nConnection: close\r\n\r\n")
            while visitor.recv(4096):
                pass
        answer.join()
    with open_server(folder, port=port) as second:
        assert second.server_address[1] == port


def test_says_when_no_port_is_free(folder: Path) -> None:
    with socket.socket() as holder:
        holder.bind(("127.0.0.1", 65535))
        holder.listen()
        with pytest.raises(StageError, match="expected a free port from 65535 on"):
            open_server(folder, port=65535)


def test_a_browser_that_dies_is_no_error(
    server: TourServer, capfd: pytest.CaptureFixture[str]
) -> None:
    """Each connection that it had open ended in a trace on the screen."""
    with socket.create_connection(server.server_address[:2]) as visitor:
        visitor.sendall(b"GET /index.html HTTP/1.1\r\nHost: x\r\n\r\n")
        visitor.recv(1)
        at_once = struct.pack("ii", 1, 0)  # as the system does for who was killed
        visitor.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, at_once)
    answered = http.client.HTTPConnection(*server.server_address[:2])
    answered.request("GET", "/index.html")
    assert answered.getresponse().status == 200
    answered.close()
    time.sleep(0.2)
    assert "Traceback" not in capfd.readouterr().err


def test_serves_nothing_but_tours(tmp_path: Path) -> None:
    (tmp_path / "letter.txt").write_text("dear")
    with pytest.raises(InputError, match="expected a tour"):
        open_server(tmp_path, port=0)


@pytest.mark.parametrize("port", ["0", "70000", "abc", "-1", "8000.5"])
def test_what_is_no_port_is_refused_in_a_line(
    folder: Path, port: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["serve", str(folder), f"--port={port}"])
    assert ended.value.code == 2
    said = capsys.readouterr().err
    assert f"--port: expected a whole number from 1 to 65535, found {port}" in said
