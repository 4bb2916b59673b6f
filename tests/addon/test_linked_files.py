"""Objects that a .blend links from another: read where they are only read, refused by name where they are written."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from scenes import make_sheet, weights

bpy = pytest.importorskip("bpy", reason="Blender's module bpy is not installed")

from mobius_extension.mobius_addon import files  # noqa: E402
from mobius_extension.mobius_addon.command_line import main  # noqa: E402

QUICK = ["--samples", "50", "--targets", "200", "--reflect", "never", "--refine", "none"]


def linked(library: Path, what: str, name: str) -> Any:
    with bpy.data.libraries.load(str(library), link=True) as (_, wanted):
        setattr(wanted, what, [name])
    return getattr(bpy.data, what)[name]


def by_object(library: Path) -> None:
    bpy.context.scene.collection.objects.link(linked(library, "objects", "Body"))


def by_collection(library: Path) -> None:
    bpy.context.scene.collection.children.link(linked(library, "collections", "Character"))


def by_instance(library: Path) -> None:
    empty = bpy.data.objects.new("Instance", None)
    empty.instance_type, empty.instance_collection = "COLLECTION", linked(library, "collections", "Character")
    bpy.context.scene.collection.objects.link(empty)


def by_override(library: Path) -> None:
    by_object(library)
    bpy.data.objects["Body"].override_create(remap_local_usages=True)


def by_mesh(library: Path) -> None:
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Body", linked(library, "meshes", "Body")))


WAYS = [by_object, by_collection, by_instance, by_override, by_mesh]


@pytest.fixture(params=WAYS, ids=lambda way: way.__name__)
def shot(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    """A .blend with a 'Cloth' of its own that links 'Body' from a library in another folder, by a relative path."""
    (tmp_path / "library").mkdir()
    build(tmp_path / "shot.blend", tmp_path / "library" / "people.blend", request.param)
    return tmp_path / "shot.blend"


def build(shot: Path, library: Path, way: Callable[[Path], None]) -> None:
    body = make_sheet("Body", 21)
    body.vertex_groups.new(name="Arm").add(range(200), 0.5, "REPLACE")
    body.shape_key_add(name="Basis")
    body.shape_key_add(name="Up").points[5].co.z += 0.1
    body.data.materials.append(bpy.data.materials.new("Skin"))
    character = bpy.data.collections.new("Character")
    bpy.context.scene.collection.children.link(character)
    character.objects.link(body)
    bpy.context.scene.collection.objects.unlink(body)
    bpy.ops.wm.save_as_mainfile(filepath=str(library))
    files.new_scene()
    bpy.ops.wm.save_as_mainfile(filepath=str(shot))
    way(library)
    make_sheet("Cloth", 16)
    bpy.ops.file.make_paths_relative()
    bpy.ops.wm.save_as_mainfile(filepath=str(shot))
    files.new_scene()


def test_they_are_found(shot: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert [x.name for x in files.import_meshes(shot)] == ["Body", "Cloth"]
    assert len(bpy.data.scenes) == 1
    assert main(["check", str(shot)]) == 0
    assert [line.partition(",")[0] for line in capsys.readouterr().out.splitlines()] == [
        f"{shot}:Body: disc", f"{shot}:Cloth: disc",
    ]  # fmt: skip


def test_as_a_source_they_are_read(shot: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = shot.parent / "out.blend"
    before = shot.read_bytes(), (shot.parent / "library" / "people.blend").read_bytes()
    assert main(["transfer", f"{shot}:Body", f"{shot}:Cloth", "-o", str(out), *QUICK]) == 0, capsys.readouterr().err
    assert before == (shot.read_bytes(), (shot.parent / "library" / "people.blend").read_bytes())
    bpy.ops.wm.open_mainfile(filepath=str(out))
    cloth = bpy.data.objects["Cloth"]
    assert weights(cloth, "Arm").max() > 0.4
    assert cloth.data.shape_keys.key_blocks.keys() == ["Basis", "Up"]
    assert main(["transfer", "--evaluated", f"{shot}:Body", f"{shot}:Cloth", "-o", str(out), *QUICK]) == 0


def test_as_a_source_of_another_file_they_are_read_and_leave_nothing_behind(
    shot: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    make_sheet("Other", 16)
    bpy.ops.wm.save_as_mainfile(filepath=str(shot.parent / "other.blend"))
    out = shot.parent / "out.blend"
    arguments = ["transfer", f"{shot}:Body", str(shot.parent / "other.blend"), "-o", str(out), *QUICK]
    for extra in ([], ["--evaluated"]):
        assert main([*arguments, *extra]) == 0, capsys.readouterr().err
        bpy.ops.wm.open_mainfile(filepath=str(out))
        other = bpy.data.objects["Other"]
        assert weights(other, "Arm").max() > 0.4
        assert bpy.data.objects.keys() == ["Other"]
        assert bpy.data.meshes.keys() == ["Other"]
        # the material that is used stays where it is
        assert {x.name for x in bpy.data.libraries} <= {"people.blend"}


def test_without_a_name_the_files_own_mesh_is_meant(shot: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = shot.parent / "out.blend"
    assert main(["flatten", f"{shot}:Cloth", "-o", str(out)]) == 0
    if len([x for x in files.import_meshes(out) if x.obj.library is None]) == 1:
        assert main(["flatten", str(shot), "-o", str(out)]) == 0
        status = main(["transfer", str(shot), f"{shot}:Cloth", "-o", str(out), *QUICK])
        assert (status, "are one mesh: give two" in capsys.readouterr().err) == (1, True)
    else:  # an object of its own whose mesh is linked
        assert main(["flatten", str(shot), "-o", str(out)]) == 2
        assert "has 2 mesh objects ('Body', 'Cloth'): name one as" in capsys.readouterr().err


def test_as_a_target_they_are_refused_by_name(shot: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = shot.parent / "out.blend"
    for arguments in (["transfer", f"{shot}:Cloth", f"{shot}:Body"], ["flatten", f"{shot}:Body"]):
        assert main([*arguments, "-o", str(out)]) == 1
        assert (
            f"'Body' in '{shot}' is linked from 'people.blend' and cannot be changed: make it local first "
            "(Object > Relations > Make Local > All), or name people.blend:Body"
        ) in capsys.readouterr().err
        assert not out.exists()
    assert main(["flatten", f"{shot.parent}/library/people.blend:Body", "-o", str(out)]) == 0


def test_the_files_own_object_is_meant_before_a_linked_one_of_its_name(tmp_path: Path) -> None:
    def way(library: Path) -> None:
        by_object(library)
        make_sheet("Body", 5)

    build(tmp_path / "shot.blend", tmp_path / "people.blend", way)
    assert [len(x.obj.data.vertices) for x in files.import_meshes(tmp_path / "shot.blend")] == [25, 256]


def test_a_library_that_is_gone_is_named(tmp_path: Path) -> None:
    build(tmp_path / "shot.blend", tmp_path / "people.blend", by_object)
    (tmp_path / "people.blend").unlink()
    with pytest.raises(files.Unreadable, match=r"no mesh object named 'Body': it has 'Cloth'; it links 'people.blend'"):
        files.import_mesh(f"{tmp_path / 'shot.blend'}:Body")


def test_a_packed_library_that_is_gone_is_read_in_its_file_and_named_for_another(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    build(tmp_path / "shot.blend", tmp_path / "people.blend", by_object)
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "shot.blend"))
    bpy.ops.file.pack_libraries()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "shot.blend"))
    (tmp_path / "people.blend").unlink()
    source, out = f"{tmp_path}/shot.blend:Body", ["-o", str(tmp_path / "out.blend"), *QUICK]
    assert main(["transfer", source, f"{tmp_path}/shot.blend:Cloth", *out]) == 0
    files.new_scene()
    make_sheet("Other", 16)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "other.blend"))
    assert main(["transfer", source, f"{tmp_path}/other.blend", *out]) == 2
    assert "'Body' is linked from" in (said := capsys.readouterr().err)
    assert "which is not there: put it back, or make 'Body' local first" in said
