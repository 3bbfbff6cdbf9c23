"""What `pip install` and `make` rely on."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
LOCKS = sorted((ROOT / "requirements").glob("*.txt"))
NODE_LOCKS = [ROOT / "static/package-lock.json", ROOT / "tests/package-lock.json"]


def test_a_wheel_is_complete(tmp_path: Path) -> None:
    """Viewer and templates are inside, so that no user needs Node or a checkout."""
    command = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation"]
    subprocess.run([*command, "--wheel-dir", str(tmp_path), str(ROOT)], check=True)
    (wheel,) = tmp_path.glob("tourgen-*.whl")
    inside = set(zipfile.ZipFile(wheel).namelist())
    static, templates = ROOT / "static/dist", ROOT / "templates"
    for folder, name in ((static, "_viewer"), (templates, "_templates")):
        wanted = {f"tourgen/{name}/{file.relative_to(folder)}" for file in _files(folder)}
        assert wanted
        assert wanted <= inside
    assert not any(name.startswith(("tests/", "sites/", "static/")) for name in inside)


def _files(folder: Path) -> list[Path]:
    return [file for file in folder.rglob("*") if file.is_file()]


@pytest.mark.parametrize("file", LOCKS, ids=lambda file: file.name)
def test_every_requirement_is_pinned_and_hashed(file: Path) -> None:
    text = file.read_text(encoding="utf-8")
    entries = re.split(r"\n(?=\S)", text.strip())
    assert len(entries) >= 8
    for entry in entries:
        assert re.match(r"[a-z0-9-]+(\[[a-z,]+\])?==\S+", entry), entry
        assert re.search(r"--hash=sha256:[0-9a-f]{64}", entry), entry


@pytest.mark.parametrize("file", NODE_LOCKS, ids=lambda file: file.parent.name)
def test_every_node_package_is_pinned_and_hashed(file: Path) -> None:
    packages = json.loads(file.read_text(encoding="utf-8"))["packages"]
    unhashed = [name for name, about in packages.items() if name and "integrity" not in about]
    assert unhashed == []


@pytest.mark.parametrize("file", [*LOCKS, *NODE_LOCKS], ids=lambda file: file.name)
def test_no_registry_is_named(file: Path) -> None:
    """Who installs says where from."""
    text = file.read_text(encoding="utf-8")
    assert '"resolved"' not in text
    if file.suffix == ".txt":
        assert "://" not in text
        assert not re.search(r"^\s*-(?!-hash=)", text, re.MULTILINE)
