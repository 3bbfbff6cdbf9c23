"""Pictures of an E57 file come out as panoramas in the room's frame, odd ones not at all."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from scan_files import SHARED_SCANS

from tourgen.errors import InputError
from tourgen.geometry import Panorama
from tourgen.scans import open_scan, read_panoramas
from tourgen.stages.bake.vista import directions

LEVEL = (1.0, 0.0, 0.0, 0.0)
AHEAD = (0.5, 0.5, -0.5, -0.5)  # a camera that looks along x, its head up along z


@dataclass(frozen=True)
class Picture:
    kind: str
    numbers: Mapping[str, float]
    blobs: Mapping[str, bytes]
    rotation: Sequence[float] | None = LEVEL
    translation: Sequence[float] = field(default=(1.0, 2.0, 3.0))


def encoded(image: np.ndarray) -> bytes:
    stream = io.BytesIO()
    Image.fromarray(image).save(stream, "PNG")
    return stream.getvalue()


def write(path: Path, pictures: Sequence[Picture]) -> Path:
    import pye57
    from pye57 import libe57

    with pye57.E57(str(path), mode="w") as file:
        points = np.random.default_rng(0).normal(size=(3, 10))
        file.write_scan_raw({f"cartesian{axis}": points[k] for k, axis in enumerate("XYZ")})
        imf = file.image_file
        for picture in pictures:
            node = libe57.StructureNode(imf)
            if picture.rotation is not None:
                pose = libe57.StructureNode(imf)
                for name, keys, values in (
                    ("rotation", "wxyz", picture.rotation),
                    ("translation", "xyz", picture.translation),
                ):
                    part = libe57.StructureNode(imf)
                    for key, value in zip(keys, values, strict=True):
                        part.set(key, libe57.FloatNode(imf, float(value)))
                    pose.set(name, part)
                node.set("pose", pose)
            about = libe57.StructureNode(imf)
            blobs = {name: libe57.BlobNode(imf, len(data)) for name, data in picture.blobs.items()}
            for name, blob in blobs.items():
                about.set(name, blob)
            for name, number in picture.numbers.items():
                whole = name in ("imageWidth", "imageHeight")
                value = libe57.IntegerNode(imf, int(number)) if whole else None
                about.set(name, value or libe57.FloatNode(imf, float(number)))
            node.set(picture.kind, about)
            file.root["images2D"].append(node)
            for name, blob in blobs.items():
                blob.write(picture.blobs[name], 0, len(picture.blobs[name]))
    return path


def read(path: Path, **given: object) -> tuple[Panorama, ...]:
    return read_panoramas([open_scan(path, **given)], np.zeros(3))


def size_of(image: np.ndarray) -> dict[str, float]:
    return {"imageWidth": image.shape[1], "imageHeight": image.shape[0]}


def quarters(height: int, width: int) -> np.ndarray:
    """Red above on the left, green above on the right, blue and white below."""
    image = np.zeros((height, width, 3), np.uint8)
    image[: height // 2, : width // 2] = (250, 0, 0)
    image[: height // 2, width // 2 :] = (0, 250, 0)
    image[height // 2 :, : width // 2] = (0, 0, 250)
    image[height // 2 :, width // 2 :] = (250, 250, 250)
    return image


def sphere(image: np.ndarray, **changes: float) -> dict[str, float]:
    height, width = image.shape[:2]
    step = {"pixelWidth": 2 * np.pi / width, "pixelHeight": np.pi / height}
    return {**size_of(image), **step, **changes}


def colour_toward(panorama: Panorama, way: Sequence[float]) -> list[int]:
    height, width = panorama.image.shape[:2]
    seen = directions(panorama, width, height) @ np.array(way) / np.linalg.norm(way)
    row, column = np.unravel_index(seen.argmax(), seen.shape)
    return [int(value) for value in panorama.image[row, column]]


def test_a_spherical_picture_has_its_left_along_y(tmp_path: Path) -> None:
    image = quarters(32, 64)
    blobs = {"pngImage": encoded(image)}
    (found,) = read(
        write(tmp_path / "a.e57", [Picture("sphericalRepresentation", sphere(image), blobs)])
    )
    assert found.position.tolist() == [1, 2, 3]
    assert found.pixel_rad == pytest.approx((np.pi / 32, np.pi / 32))
    assert np.array_equal(found.image, image)
    assert colour_toward(found, (1, 1, 1)) == [250, 0, 0]
    assert colour_toward(found, (1, -1, 1)) == [0, 250, 0]
    assert colour_toward(found, (1, 1, -1)) == [0, 0, 250]
    assert colour_toward(found, (1, -1, -1)) == [250, 250, 250]


def test_the_pose_of_picture_and_scan_carry_it(tmp_path: Path) -> None:
    image = quarters(32, 64)
    turned = Picture(
        "sphericalRepresentation",
        sphere(image),
        {"pngImage": encoded(image)},
        rotation=(np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)),
    )
    path = write(tmp_path / "a.e57", [turned])
    (found,) = read(path)
    assert colour_toward(found, (-1, 1, 1)) == [250, 0, 0]
    (placed,) = read(path, unit_m=0.001, up="y")
    assert placed.position == pytest.approx([0.001, -0.003, 0.002])
    assert np.linalg.det(placed.rotation) == pytest.approx(1)
    assert colour_toward(placed, (-1, -1, 1)) == [250, 0, 0]  # (x, y, z) is (x, -z, y) here


def test_a_pinhole_picture_looks_along_minus_z(tmp_path: Path) -> None:
    image = quarters(60, 80)
    numbers = {
        "focalLength": 0.02,
        "pixelWidth": 0.02 / 40,  # 45 degrees to either side
        "pixelHeight": 0.02 / 40,
        "principalPointX": 40.0,
        "principalPointY": 30.0,
        **size_of(image),
    }
    blobs = {"pngImage": encoded(image)}
    camera = Picture("pinholeRepresentation", numbers, blobs, rotation=AHEAD)
    (found,) = read(write(tmp_path / "a.e57", [camera]))
    assert colour_toward(found, (1, 0.5, 0.4)) == [250, 0, 0]
    assert colour_toward(found, (1, -0.5, 0.4)) == [0, 250, 0]
    assert colour_toward(found, (1, 0.5, -0.4)) == [0, 0, 250]
    assert found.image.shape[1] * found.pixel_rad[0] == pytest.approx(np.pi / 2)


def test_a_cylindrical_picture_comes_out_by_elevation(tmp_path: Path) -> None:
    image = quarters(40, 80)
    numbers = {
        "radius": 1.0,
        "pixelWidth": 2 * np.pi / 80,
        "pixelHeight": 0.05,  # as high as the cylinder is wide: 45 degrees up and down
        "principalPointY": 20.0,
        **size_of(image),
    }
    picture = Picture("cylindricalRepresentation", numbers, {"pngImage": encoded(image)})
    (found,) = read(write(tmp_path / "a.e57", [picture]))
    assert found.image.shape[0] * found.pixel_rad[1] == pytest.approx(np.pi / 2)
    assert colour_toward(found, (1, 1, 1)) == [250, 0, 0]
    assert colour_toward(found, (1, -1, -1)) == [250, 250, 250]


def test_a_mask_leaves_black(tmp_path: Path) -> None:
    image = quarters(32, 64)
    mask = np.full((32, 64), 255, np.uint8)
    mask[16:] = 0
    blobs = {"pngImage": encoded(image), "imageMask": encoded(mask)}
    picture = Picture("sphericalRepresentation", sphere(image), blobs)
    (found,) = read(write(tmp_path / "a.e57", [picture]))
    assert not found.image[16:].any()
    assert np.array_equal(found.image[:16], image[:16])


def test_what_cannot_colour_a_surface_is_passed_over(tmp_path: Path) -> None:
    image = quarters(32, 64)
    good = encoded(image)
    about = sphere(image)
    pictures = [
        Picture("visualReferenceRepresentation", size_of(image), {"pngImage": good}),
        Picture("sphericalRepresentation", about, {"pngImage": good}, rotation=None),
        Picture("sphericalRepresentation", about, {"jpegImage": b"no picture"}),
        Picture("sphericalRepresentation", about, {"pngImage": good[: len(good) // 2]}),
        Picture("sphericalRepresentation", about, {}),
        Picture("sphericalRepresentation", {**about, "pixelWidth": 0.0}, {"pngImage": good}),
        Picture("sphericalRepresentation", {**about, "pixelWidth": 0.5}, {"pngImage": good}),
        Picture("sphericalRepresentation", {**about, "imageWidth": 0}, {"pngImage": good}),
        Picture("pinholeRepresentation", about, {"pngImage": good}),
        Picture("cylindricalRepresentation", about, {"pngImage": good}),
    ]
    path = write(tmp_path / "a.e57", pictures)
    scan = open_scan(path)
    assert scan.panoramas() == ()
    assert sum(len(chunk.points) for chunk in scan.chunks()) == 10


def test_a_picture_whose_pose_cannot_be_is_passed_over(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def no_pose(_: object) -> None:
        raise InputError("expected a pose of finite numbers, found others")

    image = quarters(32, 64)
    picture = Picture("sphericalRepresentation", sphere(image), {"pngImage": encoded(image)})
    scan = open_scan(write(tmp_path / "a.e57", [picture]))
    monkeypatch.setattr("tourgen.scans.e57._pose", no_pose)
    assert scan.panoramas() == ()


def test_wide_pictures_are_halved(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tourgen.scans.e57_images.WIDEST_PX", 20)
    image = quarters(32, 64)
    picture = Picture("sphericalRepresentation", sphere(image), {"pngImage": encoded(image)})
    (found,) = read(write(tmp_path / "a.e57", [picture]))
    assert found.image.shape == (8, 16, 3)
    assert found.image.shape[1] * found.pixel_rad[0] == pytest.approx(2 * np.pi)
    assert found.image[0, 0].tolist() == [250, 0, 0]


def test_a_file_that_breaks_off_is_told_by_name(tmp_path: Path) -> None:
    image = quarters(32, 64)
    picture = Picture("sphericalRepresentation", sphere(image), {"pngImage": encoded(image)})
    path = write(tmp_path / "a.e57", [picture])
    scan = open_scan(path)
    path.write_bytes(path.read_bytes()[:2000])
    with pytest.raises(InputError, match=r"scan `a\.e57`: expected an E57 file that can be read"):
        scan.panoramas()


@pytest.mark.skipif(not SHARED_SCANS.is_dir(), reason="../shared/scans is absent")
def test_real_files_with_pictures_are_read() -> None:
    pump = open_scan(SHARED_SCANS / "real_e57" / "pumpAVisualReferenceImage.e57")
    assert pump.panoramas() == ()  # a visual reference
    odd = open_scan(SHARED_SCANS / "odd" / "cry_e57" / "tiny_pc_and_images.e57")
    assert [each.image.shape for each in odd.panoramas()] == [(100, 100, 3)]
