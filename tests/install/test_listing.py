"""What is in the zips: the extension, the wheels of one platform, and nothing else."""

import hashlib
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest
from conftest import ROOT

MANIFEST = tomllib.loads((ROOT / "blender_manifest.toml").read_text(encoding="utf-8"))
PLATFORMS = MANIFEST["platforms"]


def wheels_in(path: Path) -> set[str]:
    with zipfile.ZipFile(path) as archive:
        return {name for name in archive.namelist() if name.endswith(".whl")}


def sources() -> set[str]:
    """The files that belong to the extension: what git knows of both packages, without the paper's comparisons."""
    listed = subprocess.run(["git", "-C", ROOT, "ls-files"], capture_output=True, text=True, check=False)
    if listed.returncode:
        pytest.skip("not a git checkout")
    names = {name for name in listed.stdout.split() if name.startswith(("solver/", "mobius_addon/"))}
    others = {f"solver/kernels/{name}" for name in ("build_wheel.py", "pyproject.toml")}
    return {name for name in names if not name.startswith("solver/baselines/")} - others


def test_the_zip_holds_the_extension_and_nothing_else(built: Path) -> None:
    with zipfile.ZipFile(built) as archive:
        names = [name for name in archive.namelist() if not name.endswith(".whl")]
    assert sorted(names) == sorted(sources() | {"__init__.py", "LICENSE", "blender_manifest.toml"})
    assert {Path(name).suffix for name in names} == {".py", ".c", ".toml", ""}


def test_the_zip_holds_scipy_for_both_pythons_and_the_kernels(built: Path) -> None:
    named = {wheel.removeprefix("./") for wheel in MANIFEST["wheels"]}
    wheels = wheels_in(built)
    assert wheels <= named
    assert sorted(Path(wheel).name.split("-")[0] for wheel in wheels) == ["mobius_kernels", "scipy", "scipy"]
    assert {wheel.split("-")[2] for wheel in wheels} == {"cp311", "cp313", "py3"}


def test_the_scipy_in_the_zip_is_the_pinned_one(built: Path) -> None:
    pinned = dict(reversed(x.split()) for x in (ROOT / "release/wheels.sha256").read_text().splitlines())
    with zipfile.ZipFile(built) as archive:
        found = {Path(x).name: hashlib.sha256(archive.read(x)).hexdigest() for x in wheels_in(built) if "/scipy-" in x}
    assert len(found) == 2
    assert found == {name: pinned[name] for name in found}


def test_every_wheel_of_the_manifest_is_pinned_or_ours_and_none_is_numpy() -> None:
    pinned = {line.split()[1] for line in (ROOT / "release/wheels.sha256").read_text().splitlines()}
    named = {Path(wheel).name for wheel in MANIFEST["wheels"]}
    assert {name for name in named if not name.startswith("mobius_kernels-")} == pinned
    assert {name.split("-")[0] for name in named} == {"mobius_kernels", "scipy"}


@pytest.mark.parametrize("platform", PLATFORMS)
def test_every_platform_has_its_kernels_and_scipy(platform: str) -> None:
    from mobius_extension.release.build import runs_on

    mine = [Path(wheel).name for wheel in MANIFEST["wheels"] if runs_on(Path(wheel).name, platform)]
    kinds = {(name.split("-")[0], name.split("-")[2]) for name in mine}
    # Blender for Intel Macs ended with Python 3.11
    pythons = ["cp311"] if platform == "macos-x64" else ["cp311", "cp313"]
    assert kinds == {("mobius_kernels", "py3")} | {("scipy", python) for python in pythons}
    assert len(mine) == len(kinds)


def test_what_lies_about_is_not_packed(built: Path, tmp_path: Path) -> None:
    """A wheel, a cache and notes in the project's folder stay out of the zip."""
    strays = [ROOT / "wheels/stray-1.0-py3-none-any.whl", ROOT / "stray.npz", ROOT / "solver/stray.txt"]
    before = names_in(built)
    try:
        for stray in strays:
            stray.write_text("stray")
        (again,) = build_again(tmp_path)
    finally:
        for stray in strays:
            stray.unlink()
    assert names_in(again) == before


def names_in(path: Path) -> list[str]:
    with zipfile.ZipFile(path) as archive:
        return sorted(archive.namelist())


def build_again(folder: Path) -> list[Path]:
    from conftest import build

    from solver.kernels.build_wheel import this_platform

    return build(folder, this_platform())


# refusals


def run_build(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, str(ROOT), "build", *arguments], capture_output=True, text=True, check=False
    )


def test_an_unknown_platform_is_wrong_usage(tmp_path: Path) -> None:
    done = run_build("amiga", "-o", str(tmp_path / "dist"))
    assert done.returncode == 2
    assert f"unknown platform amiga: take {', '.join(PLATFORMS)}" in done.stderr
    assert not (tmp_path / "dist").exists()
