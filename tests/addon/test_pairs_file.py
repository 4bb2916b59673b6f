"""Corrections from a file, on the command line: the finished map is bent through its pairs of points."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scenes import make_sheet, positions

bpy = pytest.importorskip("bpy", reason="Blender's module bpy is not installed")

from mobius_extension.mobius_addon import files  # noqa: E402
from mobius_extension.mobius_addon.command_line import main  # noqa: E402
from mobius_extension.mobius_addon.mesh_data import read_surface  # noqa: E402
from mobius_extension.solver import Correspondence, TriangleMesh, load_map  # noqa: E402

QUICK = ["--samples", "50", "--targets", "200", "--reflect", "never", "--refine", "none"]


@pytest.fixture
def sheets(tmp_path: Path) -> tuple[Path, Path]:
    paths = tmp_path / "source.ply", tmp_path / "target.ply"
    for path, n in zip(paths, (15, 13), strict=True):
        files.export_mesh(make_sheet(path.stem, n), path)
    return paths


def meshes_of(paths: tuple[Path, Path]) -> tuple[TriangleMesh, TriangleMesh]:
    files.new_scene()
    one, other = (read_surface(files.import_mesh(str(path)).obj, path.stem).mesh for path in paths)
    return one, other


def run(*arguments: object) -> int:
    return main([str(x) for x in arguments])


def map_of(path: Path, meshes: tuple[TriangleMesh, TriangleMesh]) -> Correspondence:
    return load_map(path, *meshes)


def shape_of(path: Path) -> np.ndarray:
    """The vertices of the object that a file holds beside the target."""
    files.new_scene()
    with bpy.data.libraries.load(str(path)) as (held, taken):
        taken.objects = [name for name in held.objects if " on " in name]
    return positions(taken.objects[0])


def test_the_map_goes_through_the_pairs(sheets: tuple[Path, Path], tmp_path: Path, capsys: Any) -> None:
    plain, bent = tmp_path / "plain.npz", tmp_path / "bent.npz"
    assert run("align", *sheets, *QUICK, "--map", plain) == 0
    meshes = meshes_of(sheets)
    before = map_of(plain, meshes).matrix() @ meshes[0].vertices
    vertex, far = (
        int(np.linalg.norm(meshes[1].vertices[:, :2] - at, axis=1).argmin()) for at in ((0.3, 0.2), (-1, -1))
    )
    # a point inside a triangle, not a vertex
    corners = meshes[0].faces[np.linalg.norm(
        meshes[0].vertices[meshes[0].faces].mean(axis=1)[:, :2] - before[vertex, :2] - (0.08, 0.04), axis=1
    ).argmin()]  # fmt: skip
    goal = meshes[0].vertices[corners].mean(axis=0)
    corrections = tmp_path / "pairs.txt"
    corrections.write_text(" ".join(f"{x:.7f}" for x in (*goal, *meshes[1].vertices[vertex])) + "\n")
    assert run("align", *sheets, *QUICK, "--pairs", corrections, "--follow-all", "--map", bent) == 0
    assert "The map goes through 1 of 1 point pairs" in capsys.readouterr().out
    now = map_of(bent, meshes).matrix() @ meshes[0].vertices
    assert np.linalg.norm(now[vertex] - goal) < 1e-3
    assert (now[far] == before[far]).all()
    # a map that is there is bent in the same way, and what is carried follows
    out = tmp_path / "out.blend"
    assert run("wrap", *sheets, "-o", out, "--use-map", plain, "--pairs", corrections, "--follow-all") == 0
    assert "The map goes through 1 of 1 point pairs" in capsys.readouterr().out
    corrected = shape_of(out)
    assert run("wrap", *sheets, "-o", out, "--use-map", bent, "--overwrite") == 0
    assert np.abs(shape_of(out) - corrected).max() < 1e-6
    assert run("wrap", *sheets, "-o", out, "--use-map", plain, "--overwrite") == 0
    assert np.abs(shape_of(out) - corrected).max() > 0.02


def test_a_pair_that_contradicts_a_sure_map_is_named_and_changes_nothing(
    sheets: tuple[Path, Path], tmp_path: Path, capsys: Any
) -> None:
    plain, bent = tmp_path / "plain.npz", tmp_path / "bent.npz"
    fine = ["--samples", "60", "--targets", "300", "--reflect", "never"]
    assert run("align", *sheets, *fine, "--map", plain) == 0
    ends = [positions(make_sheet("Sheet", n))[k] for n, k in ((15, 20), (13, 140))]
    corrections = tmp_path / "pairs.txt"
    corrections.write_text(" ".join(f"{x:.7f}" for x in np.ravel(ends)) + "\n")
    capsys.readouterr()
    assert run("align", *sheets, *fine, "--map", bent, "--pairs", corrections) == 0
    assert "outvoted, as the map is surer than that: 'pair 1'" in capsys.readouterr().err
    meshes = meshes_of(sheets)
    one, other = (map_of(path, meshes) for path in (plain, bent))
    assert (one.face == other.face).all()
    assert (one.barycentric == other.barycentric).all()


def test_corrections_are_for_one_target_and_have_to_be_there(
    sheets: tuple[Path, Path], tmp_path: Path, capsys: Any
) -> None:
    assert run("align", *sheets, *QUICK, "--pairs", tmp_path / "gone.txt") == 2
    assert "there is no file" in capsys.readouterr().err
    assert run("align", *sheets, *QUICK, "--follow-all") == 2
    assert "--follow-all is about --pairs" in capsys.readouterr().err
    (tmp_path / "out").mkdir()
    both = ["transfer", sheets[0], sheets[1], sheets[1], "-o", tmp_path / "out", "--pairs", tmp_path / "gone.txt"]
    assert run(*both) == 2
    assert "--pairs is about one target" in capsys.readouterr().err
