"""Pictures carried between surfaces that are known: what arrives in each texel is computed by other means."""

from typing import Any

import numpy as np
import pytest
from correspondences import planar_correspondence, sheet
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import ndimage

from solver import Correspondence, TriangleMesh
from solver.carry.interpolate import places
from solver.carry.textures import (
    CLIP,
    EXTEND,
    MIRROR,
    REPEAT,
    Carrying,
    FromCorners,
    FromPictures,
    InLayout,
    LayoutError,
    Picture,
    Wanted,
    compiled,
    encoded,
    island_numbers,
    picture_size,
    place_in_tiles,
    reference,
    resample,
)
from solver.carry.textures.layout import in_texels
from solver.carry.textures.margins import Margin
from solver.carry.textures.paints import Page, at_corners
from solver.carry.textures.picture import with_margin

LINEAR = {"store": np.asarray}


def bent(mesh: TriangleMesh) -> TriangleMesh:
    x, y, _ = mesh.vertices.T
    return TriangleMesh(np.stack([x, y, 0.3 * np.exp(-8 * ((x - 0.3) ** 2 + y**2))], axis=1), mesh.faces)


def flat_uv(mesh: TriangleMesh, scale: float = 0.5, turn: float = 0.0) -> np.ndarray:
    """A layout of a sheet over [-1, 1] squared: its plane, scaled and turned about the middle of the picture."""
    plane = (mesh.vertices[:, 0] + 1j * mesh.vertices[:, 1]) * scale * np.exp(1j * turn)
    return np.stack([plane.real + 0.5, plane.imag + 0.5], axis=1)[mesh.faces]


def smooth_picture(size: int, seed: int = 0, channels: int = 3) -> np.ndarray:
    """Noise without waves shorter than 16 texels."""
    spectrum = np.fft.rfft2(np.random.default_rng(seed).standard_normal((channels, size, size)), axes=(1, 2))
    frequency = np.hypot(np.fft.fftfreq(size)[:, None], np.fft.rfftfreq(size)[None])
    wave = np.fft.irfft2(np.where(frequency < 1 / 16, spectrum, 0), (size, size), axes=(1, 2))
    wave = (wave - wave.min()) / np.ptp(wave)
    return np.ascontiguousarray(wave.transpose(1, 2, 0).astype(np.float32))


def psnr(error: np.ndarray) -> float:
    return float(-10 * np.log10((error**2).mean()))


def pictures(pixels: np.ndarray, uv: np.ndarray, mesh: TriangleMesh, **options: Any) -> FromPictures:
    island = island_numbers(mesh.faces, uv)
    return FromPictures.of(
        [Picture.of(pixels, **options)], [uv], np.zeros(len(uv), int), [island], pixels.shape[2]
    )  # fmt: skip


@pytest.fixture(scope="module")
def pair() -> tuple[TriangleMesh, TriangleMesh, Correspondence]:
    source, target = sheet(30)[0], sheet(23, 26)[0]
    return bent(source), bent(target), planar_correspondence(source, target)


def test_identity_gives_the_picture_back(pair: tuple[TriangleMesh, TriangleMesh, Correspondence]) -> None:
    source = pair[0]
    uv = flat_uv(source)
    pixels = np.random.default_rng(0).integers(0, 256, (200, 300, 4)).astype(np.uint8)
    carrying = Carrying(planar_correspondence(sheet(30)[0], sheet(30)[0]), source, source)
    paint = pictures(pixels, uv, source, srgb=True)
    found = resample(
        InLayout.of(carrying, uv, (200, 300)), (200, 300), [Wanted(paint, lambda x: encoded(x, srgb=True))]
    )
    assert found.known.all()
    assert found.overlaps == 0
    assert (found.pixels[0] == pixels).all()


def test_every_byte_of_srgb_comes_back() -> None:
    every = np.arange(256, dtype=np.uint8)[:, None].repeat(4, axis=1)
    for srgb in (True, False):
        assert (encoded(Picture.of(every[None], srgb=srgb).values(every), srgb=srgb) == every).all()


def test_there_and_back_through_another_triangulation_and_layout(
    pair: tuple[TriangleMesh, TriangleMesh, Correspondence],
) -> None:
    source, target, there = pair
    back = planar_correspondence(sheet(23, 26)[0], sheet(30)[0])
    uv, other_uv = flat_uv(source), flat_uv(target, 0.35, 0.7)
    pixels = smooth_picture(512)
    size = (1024, 1024)
    moved = resample(
        InLayout.of(Carrying(there, source, target), other_uv, size),
        size,
        [Wanted(pictures(pixels, uv, source), np.asarray)],
    )
    again = resample(
        InLayout.of(Carrying(back, target, source), uv, (512, 512)), (512, 512),
        [Wanted(pictures(moved.pixels[0], other_uv, target), np.asarray)],
    )  # fmt: skip
    assert again.known.all()
    # what two triangulations of a curved surface differ by is some thousandths of its size
    assert psnr(again.pixels[0] - pixels) > 40


def test_a_smaller_picture_holds_means(pair: tuple[TriangleMesh, TriangleMesh, Correspondence]) -> None:
    source = sheet(12)[0]
    uv = flat_uv(source)
    pixels = np.random.default_rng(1).random((256, 256, 1)).astype(np.float32)
    carrying = Carrying(planar_correspondence(source, source), source, source)
    found = resample(
        InLayout.of(carrying, uv, (32, 32)), (32, 32), [Wanted(pictures(pixels, uv, source), np.asarray)]
    ).pixels[0]
    blocks = pixels.reshape(32, 8, 32, 8, 1).mean(axis=(1, 3))
    assert np.abs(found - blocks).max() < 1e-5


def test_no_texel_of_another_island_is_read() -> None:
    """Two islands side by side, red and green, without a gap, on black: nothing is mixed, whatever the filter."""
    source = sheet(17)[0]
    middle = source.vertices[source.faces].mean(axis=1)[:, 0]
    left = middle < 0
    uv = flat_uv(source, 0.5)
    uv[left, :, 0] = 0.5 * uv[left, :, 0]
    uv[~left, :, 0] = 0.25 + 0.5 * (uv[~left, :, 0] - 0.5)
    uv[~left, :, 1] = 1 - uv[~left, :, 1]  # beside each other, but what lies across differs
    for size in (97, 512):
        labels = np.zeros((size, size, 3), np.float32)
        columns = (np.arange(size) + 0.5) / size
        labels[:, columns < 0.25, 0] = 1
        labels[:, (columns >= 0.25) & (columns <= 0.5), 1] = 1
        target = sheet(14)[0]
        carrying = Carrying(planar_correspondence(source, target), source, target)
        for there in (40, 1000):
            paint = pictures(labels, uv, source)
            own = flat_uv(target, 0.45, 0.3)
            found = resample(InLayout.of(carrying, own, (there, there)), (there, there), [Wanted(paint, np.asarray)])
            red, green, blue = found.pixels[0][found.known].T
            assert (blue == 0).all()
            # texels whose middle lies on the island's edge belong to one side or the other
            assert ((red == 1) ^ (green == 1)).all()


def test_what_lies_beyond_the_edge() -> None:
    """A layout twice as wide as the picture: again, mirrored, its edge, or nothing."""
    source = sheet(9)[0]
    own, wide = flat_uv(source), flat_uv(source)
    wide[:, :, 0] = 2 * wide[:, :, 0]
    pixels = smooth_picture(64, channels=1)
    carrying = Carrying(planar_correspondence(source, source), source, source)
    beyond = {
        REPEAT: pixels, MIRROR: pixels[:, ::-1], EXTEND: np.repeat(pixels[:, -1:], 64, axis=1), CLIP: 0 * pixels
    }  # fmt: skip
    for wrap, expected in beyond.items():
        paint = pictures(pixels, wide, source, wrap=wrap)
        found = resample(InLayout.of(carrying, own, (64, 128)), (64, 128), [Wanted(paint, np.asarray)]).pixels[0]
        assert np.abs(found[:, :63] - pixels[:, :63]).max() < 1e-5
        assert np.abs(found[:, 65:] - expected[:, 1:]).max() < 1e-5, wrap


def test_islands_on_top_of_each_other_read_the_same_texels() -> None:
    source = sheet(9)[0]
    uv = flat_uv(source)
    right = source.vertices[source.faces].mean(axis=1)[:, 0] > 0
    uv[right, :, 0] = 1 - uv[right, :, 0]  # both halves use the left half of the picture
    pixels = np.random.default_rng(2).random((64, 64, 2)).astype(np.float32)
    carrying = Carrying(planar_correspondence(source, source), source, source)
    whole = flat_uv(source)
    found = resample(
        InLayout.of(carrying, whole, (64, 64)), (64, 64), [Wanted(pictures(pixels, uv, source), np.asarray)]
    ).pixels[0]
    assert np.abs(found[:, :32] - pixels[:, :32]).max() < 1e-5
    assert np.abs(found[:, 32:] - pixels[:, 31::-1]).max() < 1e-5


def test_a_walk_does_not_jump_to_a_surface_nearby() -> None:
    """A sheet folded over itself, its halves 0.01 apart: a coarser target still gets the colors of its own half."""

    def folded(mesh: TriangleMesh) -> TriangleMesh:
        x, y, _ = mesh.vertices.T
        angle = np.clip(x / 0.2, -1, 1) * np.pi / 2
        straight = np.maximum(np.abs(x) - 0.2, 0)
        radius = 0.005
        return TriangleMesh(
            np.stack([-straight + radius * np.cos(angle), y, radius * np.sin(angle)], axis=1), mesh.faces
        )

    source, target = sheet(81)[0], sheet(41, 15)[0]
    carrying = Carrying(planar_correspondence(source, target), folded(source), folded(target))
    uv = flat_uv(target)
    found = resample(
        InLayout.of(carrying, uv, (128, 128)),
        (128, 128),
        [Wanted(FromCorners(source.vertices[source.faces]), np.asarray)],
    )
    u = (np.arange(128) + 0.5) / 64 - 1
    far = np.abs(u) > 0.25
    assert found.known.all()
    assert np.abs(found.pixels[0][:, far, 0] - u[far]).max() < 0.02
    assert np.abs(found.pixels[0][:, :, 1] - u[:, None]).max() < 0.02


def test_a_surface_that_its_file_cut_open_is_walked_over_as_one() -> None:
    source = sheet(9)[0]
    left = source.vertices[source.faces].mean(axis=1)[:, 0] < 0
    faces = source.faces.copy()
    shared = np.flatnonzero(source.vertices[:, 0] == 0)
    twin = np.full(len(source.vertices), -1)
    twin[shared] = len(source.vertices) + np.arange(len(shared))
    faces[~left] = np.where(twin[faces[~left]] >= 0, twin[faces[~left]], faces[~left])
    cut = TriangleMesh(np.concatenate([source.vertices, source.vertices[shared]]), faces)
    target = sheet(6)[0]  # one column of its quads lies across the cut
    whole = planar_correspondence(source, target)
    found = Correspondence(
        whole.face, whole.barycentric, whole.matched, whole.confidence, cut.faces, len(cut.vertices)
    )  # fmt: skip
    carrying = Carrying(found, cut, target)
    picture = resample(
        InLayout.of(carrying, flat_uv(target), (64, 64)), (64, 64),
        [Wanted(FromCorners(cut.vertices[cut.faces]), np.asarray)],
    )  # fmt: skip
    u = (np.arange(64) + 0.5) / 32 - 1
    assert np.abs(picture.pixels[0][:, :, 0] - u).max() < 1e-6


@given(st.integers(0, 10**6), st.sampled_from([0, 1, 2, 3]), st.booleans())
@settings(max_examples=15, deadline=None)
def test_c_and_numpy_do_the_same(seed: int, wrap: int, mirrored: bool) -> None:
    if compiled.library() is None:
        pytest.skip("the compiled kernels are not installed")
    rng = np.random.default_rng(seed)
    source, target = sheet(8)[0], sheet(7, 6)[0]
    found = planar_correspondence(source, target)
    found.face[rng.random(len(found.face)) < 0.1] = -1
    carrying = Carrying(found, bent(source), bent(target))
    turn = rng.uniform(0, 6)
    uv, own = flat_uv(source, rng.uniform(0.2, 1), turn), flat_uv(target, rng.uniform(0.3, 0.8), turn)
    own += rng.normal(scale=0.01, size=own.shape)
    if mirrored:
        own[:, :, 0] = 1 - own[:, :, 0]
    layout = in_texels(own, 61, 61)
    texels = [x.texels(carrying, layout, 5, 50, 61) for x in (reference, compiled)]
    assert texels[0][1] == texels[1][1]
    a, b = (x[0].reshape(-1) for x in texels)
    assert (a["triangle"] == b["triangle"]).all()
    # on the edge between two faces either is right
    assert (a["face"] != b["face"]).mean() < 0.01
    same = a["face"] == b["face"]
    for name in ("corner", "place", "across", "down"):
        assert np.abs(a[name][same] - b[name][same]).max() < 1e-6
    pixels = rng.integers(0, 256, (40, 30, 3)).astype(np.uint8)
    picture = Picture.of(pixels, srgb=True, wrap=wrap)
    at, island, page = in_texels(uv, 30, 40), island_numbers(source.faces, uv), np.zeros(len(uv), int)
    labels, parents = np.zeros((2, 40, 30), np.uint16), np.arange(65536).astype(np.uint16)[None].repeat(2, axis=0)
    for number, loops in enumerate((reference, compiled)):
        loops.islands(at, page, 0, island, wrap, labels[number], parents[number])
    assert (labels[0] == labels[1]).all()
    assert (parents[0] == parents[1]).all()
    out = np.zeros((2, len(b), 3), np.float32)
    seen = Picture(picture.pixels, picture.table, wrap, labels[0])
    for number, loops in enumerate((reference, compiled)):
        loops.sample(seen, b, at, page, 0, island, 16, out[number])
    assert np.abs(out[0] - out[1]).max() < 1e-5


def test_conservative_at_borders() -> None:
    """Every texel that a triangle touches has a value, and those beyond it have none."""
    mesh = TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    corners = np.array([[[0.13, 0.21], [0.87, 0.34], [0.4, 0.81]]])
    carrying = Carrying(planar_correspondence(mesh, mesh), mesh, mesh)
    size = 37
    known = resample(
        InLayout.of(carrying, corners, (size, size)), (size, size),
        [Wanted(FromCorners(mesh.vertices[mesh.faces]), np.asarray)],
    ).known  # fmt: skip
    fine = np.linspace(0, 1, 401)
    a, b = np.meshgrid(fine, fine)
    inside = a + b <= 1
    points = corners[0, 0] + a[inside][:, None] * (corners[0, 1] - corners[0, 0])
    points = points + b[inside][:, None] * (corners[0, 2] - corners[0, 0])
    hit = np.zeros_like(known)
    column, row = np.floor(points * size).astype(int).T
    hit[row, column] = True
    assert (known | ~hit).all()
    assert (known & ~hit).sum() <= 3  # touched by less than the samples tell


def test_the_margin_repeats_the_nearest_texel() -> None:
    covered = np.zeros((40, 50), bool)
    covered[10:20, 15:30] = True
    margin = Margin.of(covered, 6)
    y, x = np.divmod(margin.texel, 50)
    near_y, near_x = np.clip(y, 10, 19), np.clip(x, 15, 29)
    origin_y, origin_x = np.divmod(margin.origin, 50)
    apart, least = np.hypot(y - origin_y, x - origin_x), np.hypot(y - near_y, x - near_x)
    assert covered.reshape(-1)[margin.origin].all()
    assert (apart <= 1.1 * least + 1e-9).all()
    assert len(np.unique(margin.texel)) == len(margin.texel)
    rows, columns = np.mgrid[:40, :50]
    distance = np.hypot(rows - np.clip(rows, 10, 19), columns - np.clip(columns, 15, 29))
    assert set(np.flatnonzero((distance > 0) & (distance <= 5.5))) <= set(margin.texel)


def test_where_there_is_no_counterpart(pair: tuple[TriangleMesh, TriangleMesh, Correspondence]) -> None:
    source, target, found = pair
    lost = target.vertices[:, 0] > 0.5
    face = np.where(lost, -1, found.face)
    cut = Correspondence(face, found.barycentric, ~lost, found.confidence, found.source_triangles, found.source_size)
    carrying = Carrying(cut, source, target)
    paint = FromCorners(np.ones((len(source.faces), 3, 1)))
    uv = flat_uv(target)
    gaps = np.full((len(target.faces), 3, 1), 0.25)
    finder = InLayout.of(carrying, uv, (64, 64))
    bare, filled = (resample(finder, (64, 64), [Wanted(paint, np.asarray, x)]) for x in (None, gaps))
    assert 0.7 < bare.known.mean() < 0.8
    assert (bare.covered == bare.known).all()
    assert filled.covered.all()
    assert set(np.unique(filled.pixels[0])) == {0.25, 1.0}
    assert (filled.pixels[0][..., 0][filled.known] == 1).all()
    assert set(np.unique(bare.pixels[0])) == {0.0, 1.0}


def test_stopping_ends_it(pair: tuple[TriangleMesh, TriangleMesh, Correspondence]) -> None:
    source, target, found = pair

    def stop(share: float) -> None:
        assert 0 <= share <= 1
        raise InterruptedError

    uv = flat_uv(target)
    with pytest.raises(InterruptedError):
        resample(
            InLayout.of(Carrying(found, source, target), uv, (2048, 2048)), (2048, 2048),
            [Wanted(FromCorners(np.ones((len(source.faces), 3, 1))), np.asarray)], progress=stop,
        )  # fmt: skip


def test_tiles() -> None:
    corners = np.array(
        [[[0.1, 0.1], [0.9, 0.1], [0.1, 1.0005]], [[2.1, 1.1], [2.9, 1.1], [2.1, 1.9]], np.zeros((3, 2))]
    )
    tiles, local = place_in_tiles(corners)
    assert tiles.tolist() == [1001, 1013, 0]
    assert np.allclose(local[1], corners[1] - [2, 1])
    for wrong, words in (
        (corners + np.array([0.5, 0]), "2 faces across the border"),
        (corners - [1, 0], "1 face outside of all tiles"),
        (corners[2:], "has no area: unwrap"),
    ):
        with pytest.raises(LayoutError, match=words):
            place_in_tiles(wrong)


def test_size_by_the_density_of_the_source() -> None:
    half = np.array([[[0, 0], [1, 0], [0, 1.0]]])
    assert picture_size(0.5 * 1024**2, half) == 1024
    assert picture_size(0.5 * 1024**2, half / 2) == 2048
    assert picture_size(1e12, half) == 8192
    assert picture_size(1.0, half) == 256


def strip(colors: list[int], size: int, **options: object) -> np.ndarray:
    """Bytes read from a row of colors, at `size` places from the middle of the first to that of the last."""
    picture = Picture.of(np.array(colors, np.uint8)[None, :, None].repeat(3, axis=2), srgb=True, **options)  # type: ignore[arg-type]
    texels = np.zeros(size, reference.TEXEL)
    texels["place"][:, 0] = np.linspace(0, 1, size)
    corners = np.array([[[0.0, 0.0], [len(colors) - 1.0, 0.0], [0.0, 1.0]]])
    out = np.zeros((size, 3), np.float32)
    paint = FromPictures((Page(picture, np.zeros(0, np.float32), corners, np.ones(1, np.uint16)),), np.zeros(1, int), 3)
    paint(texels, out)
    return encoded(out, srgb=True)[:, 0]


def test_between_texels_bytes_are_interpolated_and_over_areas_light() -> None:
    """Half way from black to white lies the grey that looks half as bright; the mean of both is half the light."""
    assert np.abs(strip([0, 200], 11).astype(int) - np.linspace(0, 200, 11)).max() <= 1
    source = sheet(9)[0]
    uv = flat_uv(source)
    checker = np.full((64, 64, 3), 255, np.uint8)
    checker[::2] = 0
    carrying = Carrying(planar_correspondence(source, source), source, source)
    found = resample(
        InLayout.of(carrying, uv, (32, 32)), (32, 32),
        [Wanted(pictures(checker, uv, source, srgb=True), lambda x: encoded(x, srgb=True))],
    )  # fmt: skip
    assert (found.pixels[0] == 188).all()  # 1.055 * 0.5 ** (1 / 2.4) - 0.055


def test_what_cannot_be_seen_gives_no_color() -> None:
    """Black under an alpha of 0, beside hair, darkens none of it; where all is invisible the color is its own."""
    found = strip([0, 200], 11, opaque=np.array([[0, 255]], np.uint8))
    assert found[0] == 0
    assert (found[1:] >= 198).all()
    assert (strip([90, 90], 5, opaque=np.zeros((1, 2), np.uint8)) == 90).all()


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("loops", [reference, compiled])
def test_no_texel_goes_astray_on_a_crumpled_surface(seed: int, loops: object) -> None:
    """Where lines along normals miss the faces nearby they meet others far away; those are not what a texel shows."""
    if loops is compiled and compiled.library() is None:
        pytest.skip("the compiled kernels are not installed")
    plane = sheet(21)[0], sheet(9)[0]
    found = planar_correspondence(*plane)
    source = crumpled(plane[0], seed)
    target = TriangleMesh(places(found, source.vertices)[1], plane[1].faces)
    texels, _ = loops.texels(Carrying(found, source, target), in_texels(flat_uv(plane[1]), 128, 128), 0, 128, 128)  # type: ignore[attr-defined]
    texels = texels.reshape(-1)[texels.reshape(-1)["triangle"] >= 0]
    middle = at_corners(target.vertices[target.faces], texels["triangle"], texels["corner"])
    there = at_corners(source.vertices[source.faces], texels["face"], texels["place"])
    ends = target.vertices[target.faces[texels["triangle"]]]
    assert (np.linalg.norm(there - middle, axis=1) <= np.linalg.norm(ends - middle[:, None], axis=2).max(axis=1)).all()


def crumpled(mesh: TriangleMesh, seed: int) -> TriangleMesh:
    """A sheet thrown into folds as high as they are wide."""
    shift = np.random.default_rng(seed).normal(scale=0.06, size=mesh.vertices.shape)
    return TriangleMesh(mesh.vertices + shift, mesh.faces)


def test_a_margin_that_goes_on_is_read_and_a_background_is_not() -> None:
    """Also at corners of an island, and where it is one texel wide; black around it is no margin."""
    y, x = np.mgrid[:20, :20]
    color = (6 * x + 4 * y).astype(np.uint8)[:, :, None].repeat(3, axis=2)
    island = np.zeros((20, 20), np.uint16)
    island[5:12, 5:12] = 7
    island[12:16, 8] = 7
    around = ndimage.binary_dilation(island > 0, np.ones((3, 3)))
    label = island.copy()
    with_margin(label, color)
    assert (label[around] == 7).all()
    assert not label[~around].any()
    label = island.copy()
    with_margin(label, np.where(island[:, :, None] > 0, color + 100, 0).astype(np.uint8))
    assert (label == island).all()
