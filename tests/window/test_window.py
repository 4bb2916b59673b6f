"""The installed extension in a real Blender with its window, used by real clicks.

Needs the script that sets up a Blender of its own and drives its window: `MOBIUS_GUI` names it, or it is
`../shared/tools/gui_shot.sh`. `MOBIUS_SHOTS` names a folder that keeps the pictures.
"""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from solver.search.kernels.build_wheel import this_platform

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
GUI = Path(os.environ.get("MOBIUS_GUI", ROOT.parent / "shared/tools/gui_shot.sh"))
ROOTS = Path(os.environ.get("BLENDER_ROOTS", "/opt"))

PICTURES = {
    "clicks": (
        *("chosen", "searching", "aligned", "transferred", "matches", "heat-map-confidence", "heat-map-dilatation"),
        *("heat-map-factor", "side-by-side", "discs", "german"),
        *("redo-transfer", "redo-conformal-transfer", "waiting", "written-after-waiting", "deleted-meanwhile"),
        *("shown", "cleared", "reopened", "reopened-redo"),
    ),
    "textures_clicks": ("textures-preview", "textures-at-15", "textures-at-50", "textures-transferred"),
    "pairing": ("point-pairs",),
    "fitting": ("fitted", "redo-fitted"),
    "following": ("empties-missing", "empties", "live", "swapped", "discs-opened", "discs-closed"),
    "surroundings": (
        *("example", "search", "light", "large-scale", "large-scale-german", "narrow-german", "narrow"),
        *("weight-paint", "sculpt", "two-windows", "in-the-way", "mended", "linked", "linked-source"),
    ),
    "large": ("large", "large-searching", "large-side-by-side", "large-transferred"),
    "expressions": ("expressions-aligned", "expressions-0", "expressions-1", "expressions-ended"),
    "language": ("language-empty", "language", "language-unfolded", "language-preferences"),
}
"""What each script leaves."""

OF_DATA = {"expressions"}
"""Scripts that need real scans, where Blender's own root shows them too."""


@pytest.fixture(scope="session")
def extension(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The zip for this platform, as people install it."""
    folder = tmp_path_factory.mktemp("dist")
    command = [sys.executable, str(ROOT), "build", this_platform(), "-o", str(folder)]
    subprocess.run(command, check=True, timeout=550)
    (path,) = folder.iterdir()
    return path


@pytest.mark.timeout(1800)
@pytest.mark.parametrize("suite", ["sid", "trixie"])
@pytest.mark.parametrize("script", list(PICTURES))
def test_a_person_uses_the_extension(suite: str, script: str, request: pytest.FixtureRequest, tmp_path: Path) -> None:
    if os.environ.get("MOBIUS_WINDOW") != "1":
        pytest.skip("takes minutes of a machine's time: MOBIUS_WINDOW=1 asks for it")
    if not GUI.is_file():
        pytest.skip(f"'{GUI}' is not there (MOBIUS_GUI names the script that drives Blender's window)")
    if not (ROOTS / suite / "usr/bin/blender").exists():
        pytest.skip(f"no Blender is set up in '{ROOTS / suite}'")
    if script in OF_DATA and "MOBIUS_DATA" not in os.environ:
        pytest.skip("MOBIUS_DATA does not name the folder of real scans")
    extension = request.getfixturevalue("extension")
    shots = Path(os.environ.get("MOBIUS_SHOTS", tmp_path)) / suite
    shots.mkdir(parents=True, exist_ok=True)
    settings = {
        "SUITE": suite,
        "GUI_TAB": "Möbius",
        "GUI_SIZE": "1600x1300",
        "GUI_TIMEOUT": "1500",
        "MOBIUS_SHOTS": str(shots),
    }
    done = subprocess.run(
        [GUI, extension, HERE / f"{script}.py", shots / f"{script}-end.png"],
        env=os.environ | settings | {"MOBIUS_SHOTS": str(shots)}, capture_output=True, text=True, check=False,
    )  # fmt: skip
    sys.stdout.write("".join(f"{line}\n" for line in done.stdout.splitlines() if line.startswith("[clicks]")))
    assert done.returncode == 0, done.stdout + done.stderr
    assert "[clicks] done" in done.stdout
    assert "Traceback" not in done.stdout, done.stdout
    for name in PICTURES[script]:
        assert (shots / f"{name}.png").is_file(), name
