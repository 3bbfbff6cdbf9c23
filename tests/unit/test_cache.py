"""The cache keeps what it is given, whole or not at all."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from tourgen.cache import Cache, Cost, key_of
from tourgen.errors import StageError

COST = Cost(1.5, 200.0)


def test_a_result_comes_back(tmp_path: Path) -> None:
    cache = Cache(tmp_path)
    cache.store("k", {"points": np.arange(5)}, COST)
    assert np.array_equal(cache.load("k")["points"], np.arange(5))
    assert cache.cost("k") == COST


def test_arrays_are_mapped_and_what_is_written_to_them_is_not_kept(tmp_path: Path) -> None:
    cache = Cache(tmp_path)
    arrays = (np.arange(1000), np.empty((0, 3)), np.asfortranarray(np.eye(3)), np.ones(5)[::2])
    cache.store("k", arrays, COST)
    found = cache.load("k")
    for one, other in zip(arrays, found, strict=True):
        assert one.dtype == other.dtype
        np.testing.assert_array_equal(one, other)
    found[0][:] = 7
    np.testing.assert_array_equal(cache.load("k")[0], arrays[0])


def test_an_array_cut_short_or_flipped_counts_as_absent(tmp_path: Path) -> None:
    cache = Cache(tmp_path)
    for key, spoil in (("cut", lambda data: data[:-9]), ("flipped", lambda data: b"x" + data[1:])):
        cache.store(key, np.arange(1000), COST)
        (file,) = (tmp_path / ".tourgen").rglob(f"{key}/arrays.bin")
        file.write_bytes(spoil(file.read_bytes()))
        assert cache.load(key) is None
        assert not cache.has(key)


def test_an_absent_entry_is_none(tmp_path: Path) -> None:
    assert Cache(tmp_path).load("k") is None
    assert Cache(tmp_path).cost("k") is None


def test_a_flipped_byte_counts_as_absent_and_is_dropped(tmp_path: Path) -> None:
    cache = Cache(tmp_path)
    cache.store("k", list(range(1000)), COST)
    (data,) = tmp_path.rglob("result.pickle")
    broken = bytearray(data.read_bytes())
    broken[len(broken) // 2] ^= 1
    data.write_bytes(broken)
    assert cache.load("k") is None
    assert not cache.has("k")


def test_an_entry_cut_short_counts_as_absent(tmp_path: Path) -> None:
    cache = Cache(tmp_path)
    cache.store("k", list(range(1000)), COST)
    (data,) = tmp_path.rglob("result.pickle")
    data.write_bytes(data.read_bytes()[:100])
    assert cache.load("k") is None


@pytest.mark.parametrize("name", ["about.json", "result.pickle", "arrays.bin"])
@pytest.mark.parametrize("left", [b"", b"{}", None])
def test_an_entry_that_lacks_a_file_counts_as_absent_and_is_dropped(
    tmp_path: Path, name: str, left: bytes | None
) -> None:
    """A power cut leaves files empty, a killed pruning leaves some out."""
    cache = Cache(tmp_path)
    cache.store("k", np.arange(1000), COST)
    (file,) = tmp_path.rglob(name)
    file.unlink()
    if left is not None:
        file.write_bytes(left)
    assert cache.load("k") is None
    assert not cache.has("k")
    cache.store("k", 2, COST)
    assert cache.load("k") == 2


def test_an_entry_that_can_neither_be_read_nor_dropped_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Another user's, for example: a build that took it for absent would never end."""
    cache = Cache(tmp_path)
    cache.store("k", 1, COST)
    monkeypatch.setattr("shutil.rmtree", lambda *_, **__: None)
    next(tmp_path.rglob("about.json")).unlink()
    with pytest.raises(StageError, match="expected a result that can be read or dropped"):
        cache.load("k")


def test_storing_twice_keeps_the_first(tmp_path: Path) -> None:
    cache = Cache(tmp_path)
    cache.store("k", 1, COST)
    cache.store("k", 1, Cost(9, 9))
    assert cache.cost("k") == COST


def test_pruning_drops_the_longest_unused_but_never_what_is_kept(tmp_path: Path) -> None:
    cache = Cache(tmp_path)
    for age, key in enumerate(["newest", "middle", "oldest", "kept"]):
        cache.store(key, bytes(1000), COST)
        (folder,) = tmp_path.rglob(key)
        os.utime(folder, (1e9 - age, 1e9 - age))
    cache.prune(frozenset({"kept"}), limit_bytes=3500)
    assert [cache.has(k) for k in ("newest", "middle", "oldest", "kept")] == [
        True,
        True,
        False,
        True,
    ]


def test_pruning_drops_what_a_killed_build_left(tmp_path: Path) -> None:
    cache = Cache(tmp_path)
    cache.store("k", 1, COST)
    (folder,) = tmp_path.rglob("k")
    left = folder.with_name("aside-left")
    left.mkdir()
    cache.prune(frozenset({"k"}))
    assert not left.exists()
    assert cache.has("k")


def test_keys_follow_values_and_not_their_order() -> None:
    assert key_of({"a": 1, "b": 2}) == key_of({"b": 2, "a": 1})
    assert key_of({"a": 1}) != key_of({"a": 2})


def test_a_digest_is_remembered_until_the_file_changes(tmp_path: Path) -> None:
    cache, file = Cache(tmp_path), tmp_path / "scan.ply"
    file.write_bytes(b"one")
    first = cache.file_digests([file])[file]
    stamp = file.stat().st_mtime_ns
    file.write_bytes(b"two")
    os.utime(file, ns=(stamp, stamp))
    assert cache.file_digests([file])[file] == first, "size and time of change are the same"
    os.utime(file, ns=(stamp + 10**9, stamp + 10**9))
    assert cache.file_digests([file])[file] != first


def test_clearing_says_what_it_freed(tmp_path: Path) -> None:
    cache = Cache(tmp_path)
    cache.store("k", bytes(5000), COST)
    assert cache.clear() > 5000
    assert not cache.has("k")
