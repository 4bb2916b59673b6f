"""Build the wheel `mobius_kernels`: kernels.c and texels.c as shared libraries, for this platform or for all.

A build backend (PEP 517), so that installing this folder compiles it, and a command::

    uv run python solver/kernels/build_wheel.py [-o DIR] [PLATFORM ...]

which writes one wheel per platform (default: all five). The compiler is zig from PyPI (`ziglang`).
"""

from __future__ import annotations

import argparse
import base64
import hashlib
import platform
import subprocess
import sys
import tempfile
import tomllib
import zipfile
from dataclasses import dataclass
from pathlib import Path

HERE = Path(__file__).resolve().parent
PACKAGE = "mobius_kernels"
SOURCES = ("kernels.c", "sphere.c", "boxes.c", "texels.c")
# without contraction and reassociation every machine computes the same numbers; errno and traps are not looked at
FLAGS = ["-std=c11", "-O3", "-shared", "-Wall", "-Wextra", "-Werror"]
FLAGS += ["-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math", "-s"]

INIT = '''"""Compiled kernels of the Möbius search: shared libraries for ctypes, the plainest first."""

from pathlib import Path

LIBRARIES = [Path(__file__).parent / name for name in {names!r}]
'''


@dataclass(frozen=True)
class Platform:
    """Where a wheel runs: the tag in its name, zig's name for it, and the ending of a library there."""

    tag: str
    target: str
    ending: str
    processors: tuple[str, ...]


X64 = ("x86_64", "x86_64_v3")
PLATFORMS = {
    "linux-x64": Platform("manylinux_2_17_x86_64", "x86_64-linux-gnu.2.17", "so", X64),
    "windows-x64": Platform("win_amd64", "x86_64-windows-gnu", "dll", X64),
    "windows-arm64": Platform("win_arm64", "aarch64-windows-gnu", "dll", ("generic",)),
    "macos-x64": Platform("macosx_11_0_x86_64", "x86_64-macos.11.0", "dylib", X64),
    "macos-arm64": Platform("macosx_11_0_arm64", "aarch64-macos.11.0", "dylib", ("apple_m1",)),
    "linux-arm64": Platform("manylinux_2_17_aarch64", "aarch64-linux-gnu.2.17", "so", ("generic",)),
}
BLENDER_PLATFORMS = [name for name in PLATFORMS if name != "linux-arm64"]


def this_platform() -> str:
    """Return the name of the platform that Python runs on."""
    system = {"Linux": "linux", "Windows": "windows", "Darwin": "macos"}.get(platform.system(), platform.system())
    machine = {"x86_64": "x64", "amd64": "x64", "arm64": "arm64", "aarch64": "arm64"}.get(platform.machine().lower())
    name = f"{system}-{machine}"
    if name not in PLATFORMS:
        raise SystemExit(f"no kernels for {platform.system()} on {platform.machine()}: the numpy reference will run")
    return name


def compile_library(target: Platform, processor: str, output: Path) -> None:
    """Compile kernels.c for one processor family, or exit with the compiler's own words."""
    command = [sys.executable, "-m", "ziglang", "cc", *FLAGS, "-target", target.target, f"-mcpu={processor}"]
    if target.ending != "dll":
        command.append("-fPIC")
    if target.ending == "dylib":
        command.append(f"-Wl,-install_name,@rpath/{output.name}")  # else the folder it was compiled in
    done = subprocess.run(
        [*command, *(str(HERE / source) for source in SOURCES), "-lm", "-o", str(output)],
        capture_output=True,
        text=True,
    )
    if done.returncode:
        raise SystemExit(f"compiling the kernels for {target.tag} failed:\n{done.stderr}")


def wheel(name: str, directory: Path) -> Path:
    """Build the wheel of one platform into `directory` and return its path."""
    target = PLATFORMS[name]
    project = tomllib.loads((HERE / "pyproject.toml").read_text())["project"]
    info = f"{PACKAGE}-{project['version']}.dist-info"
    tag = f"py3-none-{target.tag}"
    libraries = {f"{PACKAGE}_{processor}.{target.ending}": processor for processor in target.processors}
    contents: dict[str, bytes] = {f"{PACKAGE}/__init__.py": INIT.format(names=list(libraries)).encode()}
    with tempfile.TemporaryDirectory() as folder:
        for library, processor in libraries.items():
            compile_library(target, processor, Path(folder, library))
            contents[f"{PACKAGE}/{library}"] = Path(folder, library).read_bytes()
    contents[f"{info}/METADATA"] = (
        f"Metadata-Version: 2.1\nName: {project['name']}\nVersion: {project['version']}\n"
        f"Summary: {project['description']}\nLicense: {project['license']['text']}\n"
        f"Requires-Python: {project['requires-python']}\n"
    ).encode()
    contents[f"{info}/WHEEL"] = (
        f"Wheel-Version: 1.0\nGenerator: build_wheel.py\nRoot-Is-Purelib: false\nTag: {tag}\n".encode()
    )
    record = "".join(f"{path},sha256={_digest(data)},{len(data)}\n" for path, data in contents.items())
    contents[f"{info}/RECORD"] = f"{record}{info}/RECORD,,\n".encode()
    directory.mkdir(parents=True, exist_ok=True)
    path = directory / f"{PACKAGE}-{project['version']}-{tag}.whl"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for entry, data in contents.items():
            # a fixed date, so that the same source gives the same wheel
            archive.writestr(zipfile.ZipInfo(entry, (2020, 1, 1, 0, 0, 0)), data, zipfile.ZIP_DEFLATED)
    return path


def _digest(data: bytes) -> str:
    return base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()


def build_wheel(
    wheel_directory: str, config_settings: dict[str, str] | None = None, metadata_directory: str | None = None
) -> str:
    """Build the wheel of this platform (PEP 517)."""
    del config_settings, metadata_directory
    return wheel(this_platform(), Path(wheel_directory)).name


def build_sdist(sdist_directory: str, config_settings: dict[str, str] | None = None) -> str:
    """Refuse: the sources live in the repository (PEP 517 wants the name)."""
    raise SystemExit("there is no source distribution of the kernels: build a wheel")


def main() -> None:
    """Build the wheels that the command line names."""
    parser = argparse.ArgumentParser(description="Build the wheels of the compiled kernels.")
    parser.add_argument(
        "platforms", nargs="*", metavar="PLATFORM", help=f"of {', '.join(PLATFORMS)} (default: Blender's)"
    )
    parser.add_argument("-o", "--output", type=Path, default=Path("wheels"), help="directory for the wheels")
    arguments = parser.parse_args()
    if unknown := set(arguments.platforms) - set(PLATFORMS):
        parser.error(f"unknown platform {', '.join(sorted(unknown))}: choose from {', '.join(PLATFORMS)}")
    for name in arguments.platforms or BLENDER_PLATFORMS:
        sys.stdout.write(f"{wheel(name, arguments.output)}\n")


if __name__ == "__main__":
    main()
