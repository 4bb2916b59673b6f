"""What is in the zips: the extension, the wheels of one platform, and nothing else."""

import ast
import hashlib
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest
from zips import ROOT, build_module, run_build

MANIFEST = tomllib.loads((ROOT / "blender_manifest.toml").read_text(encoding="utf-8"))
PLATFORMS = MANIFEST["platforms"]
GUIDE = {"docs/guide.html", "docs/panel.png", "docs/guide-pairs.png"}


def wheels_in(path: Path) -> set[str]:
    with zipfile.ZipFile(path) as archive:
        return {name for name in archive.namelist() if name.endswith(".whl")}


def sources() -> set[str]:
    """The files that belong to the extension: what git knows of both packages, without the paper's comparisons."""
    listed = subprocess.run(["git", "-C", ROOT, "ls-files"], capture_output=True, text=True, check=False)
    if listed.returncode:
        pytest.skip("not a git checkout")
    names = {name for name in listed.stdout.split() if name.startswith(("solver/", "mobius_addon/"))}
    others = {f"solver/search/kernels/{name}" for name in ("build_wheel.py", "pyproject.toml")}
    return {name for name in names if not name.startswith("solver/search/baselines/")} - others


def test_the_zip_holds_the_extension_and_nothing_else(built: Path) -> None:
    with zipfile.ZipFile(built) as archive:
        names = [name for name in archive.namelist() if not name.endswith(".whl")]
    assert sorted(names) == sorted(sources() | {"__init__.py", "LICENSE", "blender_manifest.toml"} | GUIDE)
    assert {Path(name).suffix for name in names} == {".py", ".c", ".toml", ".html", ".png", ""}


def test_what_the_zip_imports_is_in_it(built: Path) -> None:
    """Every relative import, wherever in a module it stands, leads to a file in the zip."""
    with zipfile.ZipFile(built) as archive:
        modules = {name.removesuffix(".py"): archive.read(name) for name in archive.namelist() if name.endswith(".py")}
    known = {name.removesuffix("/__init__") for name in modules} | {"__init__"}
    imports = 0
    for name, code in modules.items():
        for node in ast.walk(ast.parse(code)):
            if isinstance(node, ast.ImportFrom) and node.level:
                parts = name.split("/")[: -node.level] + (node.module.split(".") if node.module else [])
                imports += 1
                if node.module:
                    assert "/".join(parts) in known, f"{name}.py, line {node.lineno}"
                elif parts != []:
                    missing = [x.name for x in node.names if "/".join([*parts, x.name]) not in known]
                    defined = modules.get("/".join([*parts, "__init__"]), b"").decode()
                    assert all(x in defined for x in missing), f"{name}.py, line {node.lineno}"
    assert imports > 100


def test_the_zip_holds_scipy_for_both_pythons_and_the_kernels(built: Path) -> None:
    named = {wheel.removeprefix("./") for wheel in MANIFEST["wheels"]}
    wheels = wheels_in(built)
    assert wheels <= named
    kinds = {(Path(wheel).name.split("-")[0], wheel.split("-")[2]) for wheel in wheels}
    assert {project for project, _ in kinds} == {"mobius_kernels", "scipy", "threadpoolctl"}
    assert {"cp311", "cp313", "py3"} == {python for _, python in kinds} - {"cp314"}
    assert len(wheels) == len(kinds)


def test_the_scipy_in_the_zip_is_the_pinned_one(built: Path) -> None:
    pinned = dict(reversed(x.split()) for x in (ROOT / "release/wheels.sha256").read_text().splitlines())
    with zipfile.ZipFile(built) as archive:
        found = {Path(x).name: hashlib.sha256(archive.read(x)).hexdigest() for x in wheels_in(built) if "/scipy-" in x}
    assert len(found) >= 2
    assert found == {name: pinned[name] for name in found}


def test_every_wheel_of_the_manifest_is_pinned_or_ours_and_none_is_numpy() -> None:
    pinned = {line.split()[1] for line in (ROOT / "release/wheels.sha256").read_text().splitlines()}
    named = {Path(wheel).name for wheel in MANIFEST["wheels"]}
    assert {name for name in named if not name.startswith("mobius_kernels-")} == pinned
    assert {name.split("-")[0] for name in named} == {"mobius_kernels", "scipy", "threadpoolctl"}


@pytest.mark.parametrize("platform", PLATFORMS)
def test_every_platform_has_its_kernels_and_scipy(platform: str) -> None:
    names = [Path(wheel).name for wheel in MANIFEST["wheels"]]
    mine = [name for name in names if build_module().runs_on(name, platform)]
    kinds = {(name.split("-")[0], name.split("-")[2]) for name in mine}
    # Blender for Intel Macs ended with Python 3.11; Linux distributions build theirs for 3.14
    pythons = {"macos-x64": ["cp311"], "linux-x64": ["cp311", "cp313", "cp314"]}.get(platform, ["cp311", "cp313"])
    assert kinds == {("mobius_kernels", "py3"), ("threadpoolctl", "py3")} | {("scipy", python) for python in pythons}
    assert len(mine) == len(kinds)


def git(folder: Path, *arguments: str) -> None:
    subprocess.run(["git", "-C", folder, *arguments], check=True, capture_output=True)


@pytest.mark.parametrize("known_to_git", [True, False])
def test_what_lies_about_is_not_packed(known_to_git: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    project, staged = tmp_path / "project", tmp_path / "staged"
    kept = ["__init__.py", "solver/surface/mesh.py"]
    strays = ["wheels/stray-1.0-py3-none-any.whl", "solver/surface/__pycache__/mesh.cpython-311.pyc", ".venv/x.py"]
    unknown = ["demo/scene.blend", "solver/notes.txt"]
    for name in [*kept, *strays, *unknown]:
        (project / name).parent.mkdir(parents=True, exist_ok=True)
        (project / name).write_text(name)
    if known_to_git:
        git(project, "init")
        git(project, "add", *kept)
    monkeypatch.setattr(build_module(), "ROOT", project)
    build_module().copy_project(staged)
    found = sorted(path.relative_to(staged).as_posix() for path in staged.rglob("*") if path.is_file())
    assert found == sorted(kept if known_to_git else [*kept, *unknown])


# refusals


def test_an_unknown_platform_is_wrong_usage(tmp_path: Path) -> None:
    done = run_build("amiga", "-o", tmp_path / "dist")
    assert done.returncode == 2
    assert f"unknown platform amiga: take {', '.join(PLATFORMS)}" in done.stderr
    assert not (tmp_path / "dist").exists()


def test_the_help_names_the_build() -> None:
    done = subprocess.run([sys.executable, str(ROOT), "--help"], capture_output=True, text=True, check=False)
    assert "'python . build' makes the extension's zips" in done.stdout
    assert "--output" in run_build("--help").stdout


def test_a_wheel_that_is_not_pinned_is_refused() -> None:
    build = build_module()
    with pytest.raises(build.BuildError, match=r"release/wheels.sha256 has no hash for it"):
        build.pinned("scipy-9.9.9-cp311-cp311-win_amd64.whl")


def test_a_wheel_with_another_hash_is_not_taken(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    build = build_module()
    name = "scipy-1.15.3-cp311-cp311-win_amd64.whl"
    monkeypatch.setattr(build, "WHEELS", tmp_path / "wheels")
    monkeypatch.setattr(build, "HASHES", tmp_path / "hashes")
    build.WHEELS.mkdir()
    build.HASHES.write_text(f"{'0' * 64}  {name}\n")
    (build.WHEELS / name).write_bytes(b"not scipy")
    # pip has a folder with a wheel of that name and nothing else, so that no network is needed
    (tmp_path / "offered").mkdir()
    (tmp_path / "offered" / name).write_bytes(b"not scipy either")
    monkeypatch.setenv("PIP_NO_INDEX", "1")
    monkeypatch.setenv("PIP_FIND_LINKS", str(tmp_path / "offered"))
    with pytest.raises(build.BuildError, match=r"HASH"):
        build.get_wheels([name], "windows-x64")


def test_what_blenders_builder_says_reaches_the_person(tmp_path: Path) -> None:
    build = build_module()
    with pytest.raises(build.BuildError, match=r"blender_manifest.toml"):
        build.run(*build.blenders_builder(), "validate", tmp_path)
