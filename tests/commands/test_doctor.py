"""What the doctor finds lacking, and how it says so."""

from __future__ import annotations

import ctypes
from pathlib import Path

import pytest

from tourgen import doctor
from tourgen.cli import main


def test_a_whole_machine_lacks_nothing(tmp_path: Path) -> None:
    assert doctor.findings(tmp_path, tests=True) == []


def test_a_missing_library_is_told_with_its_package(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def load(name: str) -> None:
        if name == "libusb-1.0.so.0":
            raise OSError(f"{name}: cannot open shared object file")

    monkeypatch.setattr(ctypes, "CDLL", load)
    monkeypatch.setattr(doctor.sys, "platform", "linux")
    (finding,) = doctor.findings(tmp_path)
    assert finding.subject == "libusb-1.0.so.0"
    assert finding.package == "libusb-1.0-0"
    assert "libusb-1.0-0" in finding.mend or finding.subject in finding.mend


def test_a_build_goes_without_browsers(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    (finding,) = doctor.findings(tmp_path)
    assert finding.optional
    assert main(["doctor"]) == 0
    assert "chromium: needed by `tourgen kiosk` and `tourgen film`" in capsys.readouterr().out
    packages = [finding.package for finding in doctor.findings(tmp_path, tests=True)]
    assert packages == ["chromium", "firefox-esr", "xvfb", "xdotool"]


def test_a_library_of_the_peers_matters_to_benches_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def load(name: str) -> None:
        if name == "libOpenGL.so.0":
            raise OSError(f"{name}: cannot open shared object file")

    monkeypatch.setattr(ctypes, "CDLL", load)
    monkeypatch.setattr(doctor.sys, "platform", "linux")
    assert doctor.findings(tmp_path) == []
    (finding,) = doctor.findings(tmp_path, bench=True)
    assert finding.package == "libopengl0"


def test_a_full_disk_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(doctor, "DISK_NEEDED", 1 << 60)
    (finding,) = doctor.findings(tmp_path)
    assert "GiB free" in finding.fault
    assert "tourgen clean" in finding.mend
