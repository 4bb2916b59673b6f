"""The extension's zips, one per platform: our files, scipy's wheels and the compiled kernels as a wheel of our own.

`blender_manifest.toml` names the wheels; `wheels.sha256` says what each that is not ours has to be. pip fetches those,
`solver/search/kernels/build_wheel.py` compiles ours, and the builder of Blender's own extension system, from the Python
module `bpy`, packs and validates: no Blender has to run.
"""

from __future__ import annotations

import argparse
import hashlib
import importlib.util
import re
import shutil
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from ..solver.search.kernels import build_wheel

ROOT = Path(__file__).resolve().parents[1]
MANIFEST = "blender_manifest.toml"
WHEELS = ROOT / "wheels"
HASHES = Path(__file__).with_name("wheels.sha256")
BUILT, NOT_BUILT, WRONG_USAGE = 0, 1, 2


class BuildError(Exception):
    """The zips could not be made; the message says why."""


def main(arguments: list[str]) -> int:
    """Make the zips that the command line asks for and return the exit status: 0 made, 1 not, 2 wrong usage."""
    manifest = tomllib.loads((ROOT / MANIFEST).read_text(encoding="utf-8"))
    parser = argparse.ArgumentParser(prog="python . build", description="Make the extension's zips, one per platform.")
    parser.add_argument(
        "platforms", nargs="*", metavar="PLATFORM", help=f"of {', '.join(manifest['platforms'])}; default: all"
    )
    parser.add_argument("-o", "--output", metavar="DIR", type=Path, default=Path("dist"), help="default: %(default)s")
    options = parser.parse_args(arguments)
    if unknown := set(options.platforms) - set(manifest["platforms"]):
        parser.error(f"unknown platform {', '.join(sorted(unknown))}: take {', '.join(manifest['platforms'])}")
    try:
        for path in build(manifest, options.platforms or manifest["platforms"], options.output):
            sys.stdout.write(f"{path}: {path.stat().st_size / 1e6:.1f} MB\n")
    except BuildError as error:
        sys.stderr.write(f"mobius: {error}\n")
        return NOT_BUILT
    return BUILT


def build(manifest: dict[str, Any], platforms: Sequence[str], output: Path) -> list[Path]:
    """Make and validate the zips of some platforms and return their paths.

    Raises
    ------
    BuildError
        A wheel could not be had or is not the pinned one, or Blender's builder refuses.
    """
    builder = blenders_builder()
    wheels = [Path(name).name for name in manifest["wheels"]]
    for platform in platforms:
        get_wheels(wheels, platform)
    with tempfile.TemporaryDirectory() as folder:
        staged = Path(folder)
        stage(staged, platforms, wheels)
        output.mkdir(parents=True, exist_ok=True)
        run(*builder, "build", "--source-dir", staged, "--output-dir", output, "--split-platforms", *tags(builder))
    zips = [output / f"{manifest['id']}-{manifest['version']}-{x.replace('-', '_')}.zip" for x in platforms]
    for path in zips:
        run(*builder, "validate", path, *tags(builder))
    return zips


def blenders_builder() -> tuple[str, Path]:
    """Return the command of Blender's extension builder; it is plain Python and does not load Blender."""
    spec = importlib.util.find_spec("bpy")
    if spec is None or spec.origin is None:
        raise BuildError("the Python package 'bpy' is missing: 'uv run python . build' installs it")
    found = sorted(Path(spec.origin).parent.glob("*/scripts/addons_core/bl_pkg/cli/blender_ext.py"))
    if not found:
        raise BuildError(f"no extension builder (bl_pkg/cli/blender_ext.py) beside '{spec.origin}'")
    return sys.executable, found[-1]


def tags(builder: tuple[str, Path]) -> tuple[str, Path | str]:
    """Return the builder's option that names the tags Blender knows."""
    scripts = builder[1].parents[3]
    return "--valid-tags", next(scripts.rglob("extensions/tags.py"), "")


def get_wheels(wheels: Iterable[str], platform: str) -> None:
    """Make sure that the folder `WHEELS` holds the wheels of one platform, current and as pinned."""
    WHEELS.mkdir(exist_ok=True)
    for name in wheels:
        if not runs_on(name, platform):
            continue
        if name.startswith(build_wheel.PACKAGE):
            sources = [
                build_wheel.HERE / source for source in (*build_wheel.SOURCES, "build_wheel.py", "pyproject.toml")
            ]
            if not is_newer(WHEELS / name, sources) and build_wheel.wheel(platform, WHEELS).name != name:
                raise BuildError(f"{MANIFEST} names '{name}', which is not what solver/search/kernels builds")
        elif not has_hash(WHEELS / name, pinned(name)):
            fetch(name)


def runs_on(wheel: str, platform: str) -> bool:
    """Return whether a wheel is for one of Blender's platforms, by the tags in its name.

    >>> runs_on("scipy-1.15.3-cp311-cp311-macosx_12_0_arm64.whl", "macos-arm64")
    True
    >>> runs_on("scipy-1.15.3-cp311-cp311-win_amd64.whl", "windows-arm64")
    False
    """
    system, processor = platform.split("-")
    start = {"windows": "win_", "macos": "macosx_", "linux": "manylinux"}[system]
    ends = {"x64": ("x86_64", "amd64"), "arm64": ("arm64", "aarch64")}[processor]
    return any(tag == "any" or (tag.startswith(start) and tag.endswith(ends)) for tag in platform_tags(wheel))


def platform_tags(wheel: str) -> list[str]:
    """Return the platforms in a wheel's name."""
    return wheel.removesuffix(".whl").split("-")[-1].split(".")


def pinned(wheel: str) -> str:
    """Return the SHA-256 that a wheel must have."""
    for line in HASHES.read_text(encoding="utf-8").splitlines():
        digest, _, name = line.partition("  ")
        if name == wheel:
            return digest
    raise BuildError(f"{MANIFEST} names '{wheel}', but release/{HASHES.name} has no hash for it")


def has_hash(path: Path, digest: str) -> bool:
    """Return whether a file is there and has a SHA-256."""
    return path.is_file() and hashlib.sha256(path.read_bytes()).hexdigest() == digest


def is_newer(path: Path, sources: Iterable[Path]) -> bool:
    """Return whether a file was made after the last change of its sources."""
    return path.is_file() and all(path.stat().st_mtime > source.stat().st_mtime for source in sources)


def fetch(wheel: str) -> None:
    """Let pip fetch one wheel, from wherever it is set up to look, and accept it only with the pinned hash."""
    project, version, python, abi, _ = wheel.split("-")
    with tempfile.TemporaryDirectory() as folder:
        requirement = Path(folder, "requirement.txt")
        requirement.write_text(f"{project}=={version} --hash=sha256:{pinned(wheel)}\n", encoding="utf-8")
        options: list[str] = []
        if platform_tags(wheel) != ["any"]:
            options += ["--python-version", f"{python[2]}.{python[3:]}", "--implementation", python[:2], "--abi", abi]
            for tag in platform_tags(wheel):
                options += ["--platform", tag]
        run(
            sys.executable, "-m", "pip", "download", "--quiet", "--disable-pip-version-check", "--no-deps",
            "--only-binary=:all:", "--require-hashes", *options, "--dest", folder, "-r", requirement,
        )  # fmt: skip
        shutil.move(Path(folder, wheel), WHEELS / wheel)


def stage(folder: Path, platforms: Sequence[str], wheels: Iterable[str]) -> None:
    """Copy the project, without what only lies about in its folder, the manifest for some platforms, and their wheels.

    Which files of the project belong to the extension, the manifest's own patterns say.
    """
    copy_project(folder)
    text, count = re.subn(
        r"^platforms = .*$",
        "platforms = [" + ", ".join(f'"{platform}"' for platform in platforms) + "]",
        (ROOT / MANIFEST).read_text(encoding="utf-8"),
        flags=re.MULTILINE,
    )
    if count != 1:
        raise BuildError(f"{MANIFEST} has to name the platforms in one line, 'platforms = [...]'")
    (folder / MANIFEST).write_text(text, encoding="utf-8")
    (folder / WHEELS.name).mkdir()
    for name in wheels:
        if any(runs_on(name, platform) for platform in platforms):
            shutil.copy2(WHEELS / name, folder / WHEELS.name)


def copy_project(folder: Path) -> None:
    """Copy the files that git knows; without git, all but hidden ones and what is made here."""
    listed = subprocess.run(["git", "-C", ROOT, "ls-files", "-z"], capture_output=True, text=True, check=False)
    if listed.returncode:
        ignored = shutil.ignore_patterns(".*", "__pycache__", WHEELS.name, "dist")
        shutil.copytree(ROOT, folder, ignore=ignored, dirs_exist_ok=True)
        return
    for name in filter(None, listed.stdout.split("\0")):
        if (ROOT / name).is_file():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, folder / name)


def run(*command: str | Path) -> None:
    """Run a program and raise `BuildError` with its own words if it fails."""
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True, check=False)
    if done.returncode:
        said = (done.stdout + done.stderr).strip() or f"exit status {done.returncode}"
        raise BuildError(
            f"'{Path(command[0]).name} {' '.join(str(part) for part in command[1:4])} ...' failed:\n{said}"
        )
