"""What commands are given: bad input is status 1 or 2, one line on stderr, nothing written."""

from pathlib import Path

import pytest
from commands import QUICK, listing, run

bpy = pytest.importorskip("bpy", reason="Blender's module bpy is not installed")

from mobius_extension.mobius_addon import files  # noqa: E402
from mobius_extension.mobius_addon.mesh_data import read_surface  # noqa: E402


@pytest.mark.parametrize(
    ("status", "arguments", "reason"),
    [
        (1, ["align", "hole.obj", "target.obj", "--keep-holes"], "'hole.obj' has 2 boundary loops (20 and 4 edges)"),
        (1, ["align", "target.obj", "parts.obj", "--keep-parts"], "'parts.obj' has 2 separate parts"),
        (1, ["align", "target.obj", "./target.obj"], "is both source and target: give two meshes"),
        (1, ["flatten", "hole.obj", "-o", "out.obj", "--keep-holes"], "'hole.obj' has 2 boundary loops"),
        (1, ["transfer", "hole.obj", "target.obj", "-o", "o.obj", "--keep-holes"], "'hole.obj' has 2 boundary loops"),
        (2, ["align", "hole.obj", "target.obj", "--keep-holes", "--fill-holes"], "not allowed with argument"),
        (1, ["transfer", "target.obj", "source.obj", "-o", "o.blend", "--only", "colors", *QUICK], "has no color attr"),
        (2, ["align", "gone.obj", "target.obj"], "there is no file 'gone.obj'"),
        (2, ["align", "target.obj", "notes.txt"], "'notes.txt' has an ending that is not known"),
        (2, ["align", "target.obj", "words.ply"], "'words.ply' could not be read"),
        (2, ["align", "source.blend:Nobody", "target.obj"], "has no mesh object named 'Nobody': it has 'Source'"),
        (2, ["align", "source.obj", "target.obj", "--report", "no/r.json"], "there is no folder 'no'"),
        (2, ["align", "source.obj", "target.obj", "--samples", "1"], "must be at least 3"),
        (2, ["align", "source.obj", "target.obj", "--time-limit=-1"], "time_limit must be a number of seconds, not -1"),
        (2, ["align", "source.obj", "target.obj", "--time-limit=nan"], "time_limit must be a number of seconds"),
        (2, ["align", "source.obj", "target.obj", "--map", "x", "--report", "x"], "two outputs have the same name"),
        (2, ["flatten", "target.obj", "-o", "out.xyz"], "'out.xyz' has an ending that is not known"),
        (2, ["flatten", "target.obj", "-o", "folder"], "'folder' has an ending that is not known"),
        (2, ["transfer", "source.obj", "target.obj", "-o", "o.obj", "--only", "hats"], "--only does not know 'hats'"),
        (2, ["transfer", "source.obj", "target.obj", "-o", "o.obj", "--mix-factor", "2"], "the mix factor lies from 0"),
        (2, ["transfer", "source.obj", "target.obj", "-o", "o.obj", "--limit", "-1"], "the limit of groups per vertex"),
        (
            2,
            ["transfer", "source.obj", "target.obj", "-o", "o.obj", "--invert-source-mask"],
            "--invert-source-mask inverts --source-mask: give both",
        ),
        (
            1,
            ["transfer", "source.blend", "target.obj", "-o", "o.blend", "--source-mask", "Hat", *QUICK],
            "has no vertex group and no attribute of single numbers named 'Hat' for its mask",
        ),
        (
            2,
            ["transfer", "source.obj", "target.obj", "-o", "o.obj", "--use-map", "no.npz"],
            "there is no file 'no.npz'",
        ),
        (2, ["transfer", "source.obj", "target.obj", "-o", "o.obj", "--use-map", "notes.txt"], "is not a map that"),
        (2, ["align", "source.obj"], "the following arguments are required: TARGET"),
        (2, ["dance"], "invalid choice: 'dance'"),
        (2, [], "the following arguments are required: COMMAND"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else None,
)
def test_bad_input_is_a_sentence_and_writes_nothing(
    status: int,
    arguments: list[str],
    reason: str,
    scans: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(scans)
    (scans / "notes.txt").write_text("a note")
    (scans / "words.ply").write_text("only words")
    (scans / "folder").mkdir()
    before = listing(scans)
    found, out, err = run(capsys, *arguments)
    assert found == status
    assert reason in err
    assert len(err.splitlines()) == 1 or err.startswith("usage:")
    assert "Traceback" not in err
    assert listing(scans) == before
    assert "certified" not in out or status == 1


def test_what_the_commands_read_is_what_the_window_reads(scans: Path) -> None:
    found = read_surface(files.import_mesh(str(scans / "source.obj")).obj).mesh
    stored = read_surface(files.import_mesh(str(scans / "source.blend")).obj).mesh
    assert (found.faces == stored.faces).all()
