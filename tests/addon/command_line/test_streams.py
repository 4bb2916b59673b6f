"""What happens to what the program says where nobody reads it."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from commands import ROOT, program

HEARD_BY_NOBODY = 141


@pytest.mark.parametrize("arguments", [["check", *["target.obj"] * 3], ["check", *["gone.obj"] * 3], ["--help"]])
@pytest.mark.parametrize("errors_too", [False, True])
def test_a_reader_that_goes_away_is_no_error(scans: Path, arguments: list[str], errors_too: bool) -> None:
    reading, writing = os.pipe()
    os.close(reading)
    done = subprocess.run(
        [sys.executable, str(ROOT), *arguments], cwd=scans, timeout=120, check=False,
        stdout=writing, stderr=writing if errors_too else subprocess.PIPE, text=True,
    )  # fmt: skip
    os.close(writing)
    if not errors_too:
        assert "Traceback" not in done.stderr
        assert "BrokenPipe" not in done.stderr
    said = errors_too or "target.obj" in arguments
    if arguments != ["--help"]:
        assert done.returncode == (HEARD_BY_NOBODY if said else 2)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full here")
def test_output_that_cannot_be_written_is_a_sentence(scans: Path) -> None:
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(
            [sys.executable, str(ROOT), "check", "target.obj"], cwd=scans, timeout=120, check=False,
            stdout=full, stderr=subprocess.PIPE, text=True,
        )  # fmt: skip
    assert done.returncode == 1
    assert done.stderr == "mobius: the output cannot be written: No space left on device\n"


@pytest.mark.skipif(os.name != "posix", reason="closes descriptors as a shell does")
@pytest.mark.parametrize("closed", [">&-", "2>&-", "<&-", ">&- 2>&-", "<&- >&- 2>&-"])
def test_closed_streams_are_left_alone(scans: Path, closed: str) -> None:
    command = f"'{sys.executable}' '{ROOT}' flatten target.obj -o out.ply {closed}"
    done = subprocess.run(["sh", "-c", command], cwd=scans, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0
    assert [line for line in done.stderr.splitlines() if "is without" not in line] == []
    # what Blender says has not come into a file that took the number of a closed stream
    assert (scans / "out.ply").read_bytes().startswith(b"ply\n")
    assert program("check", "out.ply", cwd=scans).returncode == 0
