"""Transfer maps: what was kept gives the picture that was made without."""

import zlib

import numpy as np
import pytest
from correspondences import planar_correspondence, sheet
from test_resample import bent, flat_uv, pictures, smooth_picture

from solver.carry.textures import (
    Carrying,
    FromPictures,
    InLayout,
    MapPaint,
    Picture,
    TransferMap,
    Wanted,
    exr_bytes,
    resample,
)


@pytest.mark.parametrize("there", [64, 500])
def test_a_map_gives_the_same_picture_again(there: int) -> None:
    source, target = sheet(20)[0], sheet(15, 17)[0]
    carrying = Carrying(planar_correspondence(source, target), bent(source), bent(target))
    uv, own = flat_uv(source, 0.45), flat_uv(target, 0.35, 0.5)
    pixels = smooth_picture(256)
    size = (there, there)
    confidence = np.full((len(target.faces), 3), 0.75)
    found = resample(
        InLayout.of(carrying, own, size), size,
        [
            Wanted(pictures(pixels, uv, source), np.asarray),
            Wanted(MapPaint(uv, np.full(len(uv), 3), confidence), np.asarray),
        ],
    )  # fmt: skip
    kept = found.pixels[1]
    assert (kept[found.known][:, 2:] == [3, 0.75]).all()
    kept[~found.known, 2] = -1
    unit = np.array([[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]])
    paint = FromPictures.of([Picture.of(pixels)], [unit], np.zeros(1, int), [np.zeros(1, np.uint16)], 3)
    again = resample(TransferMap(kept, {(3, 1001): 0}), size, [Wanted(paint, np.asarray)])
    assert (again.known == found.known).all()
    error = np.abs(again.pixels[0] - found.pixels[0])[found.known]
    assert error.mean() < 3e-3
    # texels at the border of an island lie nearer to their neighbours than a texel: their slopes are not known
    inner = found.known & np.roll(found.known, 2, 0) & np.roll(found.known, -2, 0)
    inner &= np.roll(found.known, 2, 1) & np.roll(found.known, -2, 1)
    assert np.percentile(np.abs(again.pixels[0] - found.pixels[0])[inner], 99) < 0.01


def test_an_exr_file_holds_what_it_was_given() -> None:
    """Taken apart by the rules of the format; Blender reads them in the tests of the add-on."""
    pixels = np.random.default_rng(0).normal(size=(37, 21, 4)).astype(np.float32)
    pixels[:20] = 0.5  # compresses
    data = exr_bytes(pixels)
    assert data[:4] == b"\x76\x2f\x31\x01"
    blocks = -(-37 // 16)
    end = data.index(b"screenWindowWidth\0float\0") + len(b"screenWindowWidth\0float\0") + 4 + 4 + 1
    offsets = np.frombuffer(data[end : end + 8 * blocks], "<u8")
    lines = []
    for offset in offsets.tolist():
        first, length = np.frombuffer(data[offset : offset + 8], "<i4")
        raw = data[offset + 8 : offset + 8 + length]
        rows = min(16, 37 - first)
        if len(raw) < rows * 21 * 16:
            change = np.frombuffer(zlib.decompress(raw), np.uint8).astype(int)
            change[1:] -= 128
            halves = (np.cumsum(change) % 256).astype(np.uint8)
            middle = -(-len(halves) // 2)
            raw = np.stack([halves[:middle], halves[middle:]], axis=1).tobytes()
        lines.append(np.frombuffer(raw, "<f4").reshape(rows, 4, 21))
    found = np.concatenate(lines).transpose(0, 2, 1)[::-1, :, ::-1]
    assert (found == pixels).all()
