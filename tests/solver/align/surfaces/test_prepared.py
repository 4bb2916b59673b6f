from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scans import bumps, percent, places, posed, remeshed

from solver import (
    AlignSettings,
    Cancelled,
    MeshError,
    TriangleMesh,
    align,
    correspond,
    flatten,
    load_surface,
    prepare,
    save_surface,
)
from solver.align.surfaces import prepared

SMALL = AlignSettings(samples=40, targets=200, reflect="never", refine="mobius")


@pytest.fixture(scope="module")
def pair() -> tuple[TriangleMesh, TriangleMesh]:
    source = bumps(700, seed=2)
    return source, remeshed(posed(source, 1), 0.6, 2)[0]


def same(first, second) -> bool:
    here, there = correspond(first), correspond(second)
    return (
        first.mobius == second.mobius
        and first.warnings == second.warnings
        and (here.face == there.face).all()
        and (here.barycentric == there.barycentric).all()
        and (here.confidence == there.confidence).all()
    )


@pytest.mark.parametrize("refine", ["mobius", "dense"])
def test_prepared_surfaces_give_the_same_map_to_the_last_bit(pair, refine: str) -> None:
    chosen = replace(SMALL, refine=refine)
    assert same(align(*pair, chosen), align(prepare(pair[0], chosen), prepare(pair[1], chosen), chosen))
    assert same(align(*pair, chosen), align(prepare(pair[0], chosen), pair[1], chosen))


def test_nothing_of_a_surface_is_computed_twice(pair, monkeypatch: pytest.MonkeyPatch) -> None:
    calls: list[str] = []

    def counted(name: str):
        real = getattr(prepared, name)

        def call(*arguments, **named):
            calls.append(name)
            return real(*arguments, **named)

        monkeypatch.setattr(prepared, name, call)

    for name in ("flatten", "diffused_curvatures", "source_points", "farthest_points", "cleaned"):
        counted(name)
    source, target = prepare(pair[0], SMALL), prepare(pair[1], SMALL)
    assert sorted(calls) == sorted(
        2 * ["flatten", "diffused_curvatures", "source_points", "farthest_points", "cleaned"]
    )
    calls.clear()
    align(source, target, SMALL)
    align(target, source, SMALL)
    align(source, target, replace(SMALL, reflect="auto"))
    assert calls == []


def test_it_is_put_in_order_and_told_in_the_triangles_it_came_with(pair) -> None:
    source, target = pair
    turned = source.faces.copy()
    turned[::7] = turned[::7][:, [0, 2, 1]]
    untidy = TriangleMesh(source.vertices, np.concatenate([turned, turned[:1]]), "untidy")
    found = align(untidy, target, SMALL)
    assert len(found.warnings) >= 1
    assert "turned over" in found.warnings[0]
    assert "for the computation only" in found.warnings[0]
    carried = correspond(found)
    assert (carried.source_triangles == untidy.faces).all()
    clean = align(source, target, SMALL)
    assert percent(places(carried, untidy), places(correspond(clean), source), source).max() < 1e-6


def test_a_mesh_that_is_no_disc_is_refused_by_name() -> None:
    angle = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    ring = np.concatenate([np.stack([np.cos(angle), np.sin(angle), 0 * angle + z], axis=1) for z in (0, 1)])
    i, j = np.arange(12), np.roll(np.arange(12), -1)
    band = TriangleMesh(ring, np.concatenate([np.stack([i, j, i + 12], 1), np.stack([j, j + 12, i + 12], 1)]), "Band")
    with pytest.raises(MeshError, match="'Band'"):
        prepare(band, AlignSettings(fill_holes=False))


def test_another_outer_boundary_than_it_was_prepared_with_is_refused(pair) -> None:
    inside = int(np.flatnonzero(~np.isin(np.arange(len(pair[0].vertices)), flatten(pair[0]).boundary))[0])
    with pytest.raises(ValueError, match="another outer boundary"):
        align(prepare(pair[0], SMALL), pair[1], replace(SMALL, source_outer=inside))


def test_progress_grows_and_may_end_it(pair) -> None:
    seen: list[float] = []
    prepare(pair[0], SMALL, progress=lambda state: seen.append(state.fraction))
    assert seen == sorted(seen)
    assert seen[0] >= 0
    assert seen[-1] <= 1
    with pytest.raises(Cancelled):
        prepare(pair[0], SMALL, progress=lambda state: state.fraction < 0.5)


def pierced(mesh: TriangleMesh) -> TriangleMesh:
    """The mesh with two openings, and a vertex in no face."""
    centre = mesh.vertices[mesh.faces].mean(axis=1)
    middle = np.median(mesh.vertices, axis=0)
    width = np.ptp(mesh.vertices, axis=0)
    away = [np.linalg.norm((centre - middle)[:, :2] - sign * 0.2 * width[:2], axis=1) for sign in (-1, 1)]
    keep = (away[0] > 0.08 * width.max()) & (away[1] > 0.08 * width.max())
    return TriangleMesh(np.concatenate([mesh.vertices, [[9.0, 9, 9]]]), mesh.faces[keep], "pierced")


@pytest.mark.parametrize("kind", ["plain", "pierced", "untidy"])
def test_a_surface_comes_back_from_disk_as_it_was(pair, kind: str, tmp_path: Path) -> None:
    source, target = pair
    chosen = SMALL
    if kind == "pierced":
        source, chosen = pierced(source), replace(SMALL, fill_holes=True)
    if kind == "untidy":
        source = TriangleMesh(source.vertices, np.concatenate([source.faces, source.faces[:2, [0, 2, 1]]]), "untidy")
    surface = prepare(source, chosen)
    save_surface(tmp_path / "source.npz", surface)
    again = load_surface(tmp_path / "source.npz")
    assert again.original.fingerprint == surface.original.fingerprint
    assert again.notes == surface.notes
    assert (again.descriptors() == surface.descriptors()).all()
    assert all((x == y).all() for x, y in zip(again.flattening.holes, surface.flattening.holes, strict=True))
    assert same(align(again, target, chosen), align(surface, target, chosen))
    assert same(align(again, target, chosen), align(source, target, chosen))


@pytest.fixture(scope="module")
def stored(pair, tmp_path_factory) -> bytes:
    path = tmp_path_factory.mktemp("surface") / "surface.npz"
    save_surface(path, prepare(bumps(60, seed=1), SMALL))
    return path.read_bytes()


@settings(max_examples=60, deadline=None)
@given(data=st.data())
def test_any_damage_to_the_file_is_a_sentence(stored: bytes, data: st.DataObject, tmp_path_factory) -> None:
    path = tmp_path_factory.mktemp("damaged") / "surface.npz"
    damaged = bytearray(stored)
    for _ in range(data.draw(st.integers(1, 4))):
        damaged[data.draw(st.integers(0, len(damaged) - 1))] ^= data.draw(st.integers(1, 255))
    damaged = damaged[: data.draw(st.one_of(st.just(len(damaged)), st.integers(0, len(damaged))))]
    path.write_bytes(damaged)
    try:
        found = load_surface(path)
    except ValueError as error:
        assert "damaged" in str(error)  # noqa: PT017
    else:  # what it holds is as it was: a date in the archive has changed
        assert found.original.fingerprint == prepare(bumps(60, seed=1), SMALL).original.fingerprint


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("kind", "something else"),
        ("disc", np.full(3, 2 + 0j)),
        ("boundary", np.array([0, 10**6])),
        ("boundary", np.array([0.5])),
        ("holes", np.array([1, 2, 3])),
        ("descriptors", np.full((3, 2), np.nan)),
        ("faces", np.array([[0, 1, 2]])),
        ("vertices", np.zeros((3, 3))),
        ("computed", np.zeros((2, 3))),
        ("source_40", np.array([-3])),
    ],
)
def test_arrays_that_do_not_fit_are_refused(stored: bytes, name: str, value: np.ndarray, tmp_path: Path) -> None:
    path = tmp_path / "surface.npz"
    path.write_bytes(stored)
    with np.load(path) as file:
        arrays = {key: file[key] for key in file.files} | {name: value}
    np.savez(path, **arrays)
    with pytest.raises(ValueError, match="damaged"):
        load_surface(path)
