"""The panel: what it says of each mesh and of a result, that all it shows exists, presets, and other languages."""

import json
import math
import string
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import texts
from scenes import QUICK, make_object, make_sheet, positions

bpy = pytest.importorskip("bpy", reason="Blender's module bpy is not installed")

from mobius_extension.mobius_addon import (  # noqa: E402
    job,
    jobs,
    panel,
    preset_menus,
    stored_alignment,
    topology_cache,
    verdict,
)
from mobius_extension.mobius_addon.computation import Repair  # noqa: E402
from mobius_extension.mobius_addon.german import GERMAN  # noqa: E402
from mobius_extension.solver import Progress  # noqa: E402
from mobius_extension.solver.align.judgement import judged  # noqa: E402
from mobius_extension.solver.align.surfaces.remark import Remark  # noqa: E402


class Layout:
    """Notes what is drawn, and fails where Blender would: at what does not exist."""

    def __init__(self, notes: list[str] | None = None) -> None:
        self.__dict__["notes"] = [] if notes is None else notes

    def __setattr__(self, name: str, value: Any) -> None:
        assert name in bpy.types.UILayout.bl_rna.properties, name

    def _part(self, *_: Any, **options: Any) -> "Layout":
        self.notes.append(options.get("heading", ""))
        return Layout(self.notes)

    row = column = box = split = _part

    def label(self, *, text: str, icon: str = "NONE", translate: bool = True) -> None:
        assert icon in bpy.types.UILayout.bl_rna.functions["label"].parameters["icon"].enum_items
        self.notes.append(text)

    def prop(self, owner: Any, name: str, *, text: str = "", **_: Any) -> None:
        assert name in owner.bl_rna.properties, name
        self.notes.append(text if name.startswith("carry_") and text else name)

    def prop_enum(self, owner: Any, name: str, value: str, **_: Any) -> None:
        assert value in owner.bl_rna.properties[name].enum_items
        self.notes.append(value)

    def operator(self, name: str, **options: Any) -> Any:
        rna = getattr(bpy.ops.mobius, name.removeprefix("mobius.")).get_rna_type()
        assert rna.properties is not None, name
        self.notes.append(options.get("text") or rna.name)

        class Properties:
            def __setattr__(self, name: str, value: Any) -> None:
                assert name in rna.properties, name

        return Properties()

    def progress(self, *, factor: float, text: str) -> None:
        assert 0 <= factor <= 1
        self.notes.append(text)

    def popover(self, **_: Any) -> None:
        pass

    def separator(self, **_: Any) -> None:
        pass


def drawn(cls: Any) -> list[str]:
    layout = Layout()
    cls.draw(SimpleNamespace(layout=layout), bpy.context)
    return layout.notes


def aligned_report(target: Any) -> dict[str, Any]:
    return json.loads(target.data.mobius_alignment.report)


# under each picker


def lines(obj: Any, **repair: bool) -> tuple[str, ...]:
    return topology_cache.line_of(obj, Repair(**repair)).rows


def test_the_line_under_a_picker() -> None:
    assert lines(make_sheet("Sheet", 9)) == ("disc, 81 vertices",)
    holes = make_sheet("Holes", 9, keep=lambda i, j: (i, j) not in ((2, 2), (2, 5), (5, 5)))
    assert lines(holes, fill_holes=True) == ("4 boundary loops:", "3 will be filled")
    assert lines(holes, fill_holes=False) == ("3 openings:", "turn on Fill Holes")
    corners = [(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)]
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    cube = make_object("Cube", corners, quads)
    assert lines(cube, fill_holes=True) == ("closed, 8 vertices",)
    parts = make_sheet("Parts", 7, keep=lambda i, j: j != 2)
    assert lines(parts, largest_part=False) == ("2 separate parts:", "keep one, or turn on Largest Part")
    assert lines(parts) == ("disc, 28 vertices", "1 smaller part beside it")


def test_what_a_disc_holds_badly_stands_there_before_it_is_aligned() -> None:
    bands = {}
    for length in (12, 20):
        columns = 6 * length + 1
        corners = [(i / 6, j / 6, 0.1 * math.sin(i / 3)) for j in range(7) for i in range(columns)]
        starts = [j * columns + i for j in range(6) for i in range(columns - 1)]
        quads = [(a, a + 1, a + columns + 1, a + columns) for a in starts]
        bands[length] = make_object(f"Band {length}", corners, quads)
    assert lines(bands[12]) == ("disc, 511 vertices", "long and narrow: less exact")
    what, remedy = lines(bands[20])
    assert what.startswith("is too long and narrow to be aligned in a disc")
    assert remedy.startswith("cut it into pieces")
    for band in bands.values():
        assert bpy.ops.mobius.check(object_name=band.name, select=False) == {"FINISHED"}


def test_an_edit_changes_the_line() -> None:
    obj = make_sheet("Sheet", 6)
    assert lines(obj) == ("disc, 36 vertices",)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.subdivide()
    bpy.ops.object.mode_set(mode="OBJECT")
    bpy.context.view_layer.update()
    assert lines(obj) == ("disc, 121 vertices",)


# drawing


def test_everything_that_the_panels_show_exists(pair: tuple[Any, Any]) -> None:
    panels = [getattr(panel, name) for name in dir(panel) if name.startswith("MOBIUS_PT_") and "presets" not in name]
    assert len(panels) == 15
    for settings in ({"source": None}, {"source": pair[0]}):
        for name, value in settings.items():
            setattr(bpy.context.scene.mobius, name, value)
        for cls in (panel.MOBIUS_PT_main, panel.MOBIUS_PT_transfer, panel.MOBIUS_PT_scans, panel.MOBIUS_PT_alignment):
            assert drawn(cls)
    bpy.ops.mobius.align(**QUICK)
    settings = bpy.context.scene.mobius
    settings.layers = settings.source_mask = settings.target_mask = "named"
    bpy.context.window_manager.mobius_view.matches = True
    for cls in panels:
        assert drawn(cls) or cls in (panel.MOBIUS_PT_last_transfer, panel.MOBIUS_PT_notes)
    bpy.context.window_manager.mobius_view.matches = False


def test_the_result_begins_with_a_verdict_and_ends_with_a_proof(pair: tuple[Any, Any]) -> None:
    assert not panel.MOBIUS_PT_result.poll(bpy.context)
    bpy.ops.mobius.align(**QUICK | {"reflect": "auto", "refine": "mobius"})
    assert panel.MOBIUS_PT_result.poll(bpy.context)
    found = aligned_report(pair[1])
    assert found["verdict"] == "good"
    said = [text for text in drawn(panel.MOBIUS_PT_result) if text]
    size = np.linalg.norm(np.ptp(positions(pair[0]), axis=0))
    assert said[0] == f"Good: {found['coverage']:.0%} matched"
    assert said[1].startswith(f"Mean error about {100 * size * found['expected_error']:.2g} cm (")
    assert said[2:] == ["not mirrored", "Side by Side"]
    parts = {"source_share": 0.9, "target_share": 0.75, "value": 7.0, "upper_bound": 7.5}
    pair[1].data.mobius_alignment.report = json.dumps(found | {"overlap": parts})
    assert {"certificate", "matches", "bound", "shared_target"} <= set(drawn(panel.MOBIUS_PT_proof))
    proof = bpy.context.scene.mobius.proof
    assert (proof.certificate, proof.value) == ("none matches more", f"{found['value']:.2f}")
    assert proof.matches == f"{found['matches']} of {QUICK['samples']}"
    assert (proof.shared_source, proof.shared_target, proof.value_there) == ("90%", "75%", "7.00 of 7.50")
    with pytest.raises(AttributeError):
        proof.value = "100"
    pair[1].data.mobius_alignment.report = "{"
    assert drawn(panel.MOBIUS_PT_result) == ["Damaged: press Align again"]
    assert not panel.MOBIUS_PT_proof.poll(bpy.context)
    assert proof.value == ""


TIE = Remark("orientation", "ambiguous orientation: mirrored and not mirrored differ by 1.0 % of the samples")
RIVAL = Remark("rival", "ambiguous: a map that sends everything elsewhere scores within 3.0 % of the samples")
OPEN = Remark("unproved", "not proved optimal: a value up to 3.0 % larger was not excluded in the time given")
DEEP = Remark("deep", "'A' is deep, 30% of it has hardly any room in a disc: cut out what is to be matched")
WAY = Remark("one way", "only one orientation was searched: try mirrored too", "doubtful, perhaps because ")
DOUBT = Remark("doubtful", "doubtful: more likely than not the map errs by more than 2 % of the source's diagonal")
OPENING = Remark("done", "'A': 2 openings (4, 5 edges) closed, for the computation only")


@pytest.mark.parametrize(
    ("remarks", "first", "offered"),
    [
        ([TIE], "Check", ["Take Mirrored"]),
        ([RIVAL], "Check", ["Take the Rival"]),
        ([replace(RIVAL, before="in the overlap: "), TIE], "Check", ["Take the Rival", "Take Mirrored"]),
        ([OPEN], "Check", ["Search Without Time Limit"]),
        ([DOUBT], "Doubtful", ["landmarks"]),
        ([DOUBT, WAY], "Doubtful", ["landmarks", "Search Both Ways"]),
        ([DOUBT, DEEP], "Doubtful", ["landmarks", "source_cut", "target_cut"]),
        ([OPENING], "Good", []),
        ([Remark("other", "something new")], "Check", []),
    ],
)
def test_every_remark_stands_in_the_panel_with_its_remedy(
    pair: tuple[Any, Any], remarks: list[Remark], first: str, offered: list[str]
) -> None:
    bpy.ops.mobius.align(**QUICK | {"reflect": "auto", "refine": "mobius"})
    whole = aligned_report(pair[1])
    found = judged(whole["mean_confidence"], whole["coverage"], remarks)
    concerns = [{"kind": one.kind, "text": one.text} for one in found.concerns]
    now = {"verdict": found.level, "concerns": concerns, "notes": found.notes}
    pair[1].data.mobius_alignment.report = json.dumps(whole | now)
    said = [text for text in drawn(panel.MOBIUS_PT_result) if text]
    assert said[0].startswith(first)
    rest = said[said.index("Side by Side") + 1 :]
    buttons = ("Take", "Search", "landmarks", "source_cut", "target_cut")
    assert [text for text in rest if text.startswith(buttons)] == offered
    labels = {"Landmarks", "Cut Source To", "Cut Target To"}
    words = " ".join(text for text in rest if text not in {*offered, *labels})
    assert words == " ".join(one.text for one in found.concerns)
    assert panel.MOBIUS_PT_notes.poll(bpy.context) == bool(found.notes)


def test_what_a_report_of_an_earlier_version_says_is_to_be_checked(pair: tuple[Any, Any]) -> None:
    bpy.ops.mobius.align(**QUICK)
    whole = aligned_report(pair[1])
    earlier = {name: value for name, value in whole.items() if name not in ("verdict", "concerns", "notes")}
    for warnings, first in (([], "Good"), ([TIE.sentence], "Check")):
        pair[1].data.mobius_alignment.report = json.dumps(earlier | {"warnings": warnings})
        said = [text for text in drawn(panel.MOBIUS_PT_result) if text]
        assert said[0].startswith(first)
        assert all(text in " ".join(said) for text in warnings)


def test_where_the_map_is_unsure_the_panel_shows_it(pair: tuple[Any, Any]) -> None:
    bpy.ops.mobius.align(**QUICK)
    for changes, offered in (
        ({"coverage": 0.4, "verdict": "check", "concerns": []}, "Select Unmatched"),
        ({"coverage": 0.9, "verdict": "check", "concerns": []}, "See Where"),
    ):
        pair[1].data.mobius_alignment.report = json.dumps(aligned_report(pair[1]) | changes)
        assert offered in drawn(panel.MOBIUS_PT_result)


def test_a_stale_alignment_says_so_at_once(pair: tuple[Any, Any]) -> None:
    bpy.ops.mobius.align(**QUICK)
    assert "Align Again" not in drawn(panel.MOBIUS_PT_result)
    pair[0].data.vertices[5].co.z += 0.5
    pair[0].data.update()
    bpy.context.view_layer.update()
    said = " ".join(drawn(panel.MOBIUS_PT_result))
    assert "'Source' has been edited since it was aligned: press Align again Align Again" in said
    bpy.ops.mobius.align(**QUICK)
    assert "Align Again" not in drawn(panel.MOBIUS_PT_result)
    bpy.ops.object.select_all(action="DESELECT")
    bpy.context.view_layer.objects.active = pair[1]
    bpy.ops.object.mode_set(mode="EDIT")
    assert "Align Again" not in drawn(panel.MOBIUS_PT_result)
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.transform.resize(value=(1, 1, 1.5))
    bpy.ops.object.mode_set(mode="OBJECT")
    bpy.context.view_layer.update()
    assert "Align Again" in drawn(panel.MOBIUS_PT_result)


def test_the_rival_can_be_taken(pair: tuple[Any, Any]) -> None:
    bpy.ops.mobius.align(**QUICK)
    best = aligned_report(pair[1])
    bpy.ops.mobius.align(**QUICK, take_rival=True)
    rival = aligned_report(pair[1])
    assert rival["settings"]["take_rival"] is True
    assert rival["mobius"] == best["rival"]["mobius"] != best["mobius"]
    assert best["certified"]
    assert not best["rival_taken"]
    assert rival["rival_taken"]
    assert not rival["certified"]
    assert rival["value"] == best["rival"]["value"] < rival["upper_bound"]
    assert bpy.context.scene.mobius.proof.certificate == f"not the best, gap {rival['gap']:.2f}"


def test_work_under_way_takes_the_place_of_the_button(pair: tuple[Any, Any], monkeypatch: pytest.MonkeyPatch) -> None:
    said = drawn(panel.MOBIUS_PT_main)
    assert "Align" in said
    under_way = SimpleNamespace(
        title="Align", progress=Progress("Searching", 0.5, 30.0, 40.0, 7), waits=None, seconds_left=None
    )
    monkeypatch.setattr(jobs.Job, "current", under_way)
    said = drawn(panel.MOBIUS_PT_main)
    assert "Align" not in said
    assert {"Searching", "30.0 of at most 40.0, gap 10.0", "Stop", "ESC stops"} <= set(said)
    for seconds, text in ((7.6, "about 8 s left"), (0.2, "about 1 s left"), (200.0, "about 3 min left")):
        under_way.seconds_left = seconds
        assert text in drawn(panel.MOBIUS_PT_main)
    under_way.waits = "'Target' has to be in Object Mode"
    assert {"Waiting", "'Target' has to be in Object Mode", "Stop"} <= set(drawn(panel.MOBIUS_PT_main))
    for operator in (bpy.ops.mobius.align, bpy.ops.mobius.transfer):
        assert not operator.poll()
    with pytest.raises(RuntimeError, match="Align is under way: press ESC to stop it"):
        bpy.ops.mobius.align()


def test_the_panel_keeps_saying_why_work_came_to_nothing(
    pair: tuple[Any, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    uids = tuple(obj.session_uid for obj in pair)
    why = "'Target' was edited during the alignment: align again"
    monkeypatch.setattr(jobs.Job, "refused", job.Refused("Align", why, uids))
    assert "'Target' was edited during the alignment align again" in " ".join(drawn(panel.MOBIUS_PT_main))
    assert "align again" not in drawn(panel.MOBIUS_PT_transfer)
    bpy.context.scene.mobius.target = None  # as it is once the target is deleted
    assert "align again" in drawn(panel.MOBIUS_PT_main)
    bpy.context.scene.mobius.target = pair[1]
    monkeypatch.setattr(jobs.Job, "refused", job.Refused("Transfer", "'Source' has nothing: add some", uids[1:]))
    assert "add some" in drawn(panel.MOBIUS_PT_transfer)
    assert "add some" not in drawn(panel.MOBIUS_PT_main)
    monkeypatch.setattr(jobs.Job, "refused", job.Refused("Align", why, uids))
    bpy.context.scene.mobius.target = make_sheet("Another", 5)
    assert "align again" not in drawn(panel.MOBIUS_PT_main)
    bpy.ops.ed.undo_push(message="one")
    bpy.ops.ed.undo_push(message="two")
    bpy.ops.ed.undo()
    assert jobs.Job.refused is None


# swap


def test_swap_exchanges_and_one_undo_takes_it_back(pair: tuple[Any, Any]) -> None:
    bpy.ops.ed.undo_push(message="before")
    assert bpy.ops.mobius.swap("EXEC_DEFAULT", True) == {"FINISHED"}
    settings = bpy.context.scene.mobius
    assert (settings.source.name, settings.target.name) == ("Target", "Source")
    bpy.ops.ed.undo()
    settings = bpy.context.scene.mobius
    assert (settings.source.name, settings.target.name) == ("Source", "Target")
    settings.source = settings.target = None
    with pytest.raises(RuntimeError, match="Choose a source or target mesh first"):
        bpy.ops.mobius.swap()


# presets


@pytest.fixture(autouse=True)
def preset_labels(monkeypatch: pytest.MonkeyPatch) -> None:
    """Blender writes the name of the last preset into the menu's label."""
    for menu in (preset_menus.MOBIUS_PT_align_presets, preset_menus.MOBIUS_PT_transfer_presets):
        monkeypatch.setattr(menu, "bl_label", menu.bl_label)


@pytest.mark.parametrize("name", ["standard", "draft", "thorough", "mirror_image"])
def test_presets_that_come_along(name: str) -> None:
    path = bpy.utils.preset_find(name, "mobius/align")
    assert path is not None
    settings = bpy.context.scene.mobius
    settings.samples = 77
    bpy.ops.script.execute_preset(filepath=path, menu_idname="MOBIUS_PT_align_presets")
    written = {
        line.split(" = ")[0]
        for line in Path(path).read_text(encoding="utf-8").splitlines()
        if line.startswith("settings.")
    }
    assert written == set(preset_menus.MOBIUS_OT_align_preset_add.preset_values)
    assert settings.samples == {"standard": 100, "draft": 60, "thorough": 200, "mirror_image": 100}[name]


@pytest.mark.parametrize("kind", ["align", "transfer"])
def test_presets_are_kept_in_blenders_folder(kind: str, tmp_path: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / "presets" / "mobius" / kind
    folder.mkdir(parents=True)
    monkeypatch.setattr(bpy.utils, "user_resource", lambda *_, **__: str(folder))
    bpy.context.scene.mobius.samples = 55
    bpy.context.scene.mobius.mix = "add"
    add = getattr(bpy.ops.mobius, f"{kind}_preset_add")
    assert add(name="Mine") == {"FINISHED"}
    text = (folder / "Mine.py").read_text()
    assert ("settings.samples = 55" in text) == (kind == "align")
    assert ("settings.mix = 'add'" in text) == (kind == "transfer")
    settings = bpy.context.scene.mobius
    settings.samples, settings.mix = 100, "replace"
    exec(compile(text, "Mine.py", "exec"), {})
    assert (settings.samples, settings.mix) == ((55, "replace") if kind == "align" else (100, "add"))


# languages


def fields(text: str) -> list[tuple[str | None, str | None]]:
    return [(name, spec) for _, name, spec, _ in string.Formatter().parse(text) if name is not None]


def test_german_covers_the_interface() -> None:
    # the Python module is built without languages: the window's test shows the panel in German
    blenders_own = {"Add Alignment Preset", "Add Transfer Preset", "Make Instances Real"}
    missing = (texts.of_classes() | texts.of_code()) - set(GERMAN) - blenders_own
    assert sorted(text for text in missing if not text.startswith("Keep the")) == []
    for english, german in GERMAN.items():
        assert fields(english) == fields(german), english
        assert english.endswith(":") == german.endswith(":"), english


# kinds of data


def test_kinds_are_checkboxes_with_counts(pair: tuple[Any, Any]) -> None:
    settings = bpy.context.scene.mobius
    settings.carry_none = True
    assert settings.kinds == set()
    assert settings.carry_none
    assert not settings.carry_all
    settings.carry_vertex_groups = True
    settings.carry_uv = True
    assert settings.kinds == {"VERTEX_GROUPS", "UV"}
    settings.carry_uv = False
    assert settings.kinds == {"VERTEX_GROUPS"}
    said = drawn(panel.MOBIUS_PT_transfer)
    assert {"carry_all", "carry_none", "Vertex Groups 1", "UV Maps 1", "Shape Keys 0", "Materials"} <= set(said)
    bpy.ops.mobius.align(**QUICK)
    bpy.ops.mobius.transfer(kinds=settings.kinds)
    assert not pair[1].data.uv_layers.get("UVMap")
    settings.carry_all = True
    assert len(settings.kinds) == len(settings.bl_rna.properties["kinds"].enum_items)


def test_the_selection_is_used_from_active_to_selected(pair: tuple[Any, Any]) -> None:
    source, target = pair
    settings = bpy.context.scene.mobius
    settings.source = settings.target = None
    for obj in pair:
        obj.select_set(True)
    bpy.context.view_layer.objects.active = source
    assert bpy.ops.mobius.use_selected() == {"FINISHED"}
    assert (settings.source, settings.target) == (source, target)
    other = make_sheet("Another", 3)
    for obj in (*pair, other):  # adding one may have selected it alone
        obj.select_set(True)
    bpy.context.view_layer.objects.active = source
    assert bpy.ops.mobius.use_selected() == {"FINISHED"}
    assert (settings.source, settings.target) == (source, min(other, target, key=lambda obj: obj.name))
    for obj in (other, target):
        obj.select_set(False)
    with pytest.raises(RuntimeError, match="Select the target, or several, and the source last"):
        bpy.ops.mobius.use_selected()


# after a transfer


def test_the_last_transfer_stands_in_the_panel_layer_by_layer(pair: tuple[Any, Any]) -> None:
    source, target = pair
    for number in range(10):
        source.vertex_groups.new(name=f"Group {number}").add((number,), 0.5, "REPLACE")
    target.vertex_groups.new(name="Right").add((1, 2), 0.25, "REPLACE")
    target.vertex_groups.new(name="Group 0").lock_weight = True
    bpy.ops.mobius.align(**QUICK)
    assert not panel.MOBIUS_PT_last_transfer.poll(bpy.context)
    bpy.ops.ed.undo_push(message="aligned")
    bpy.ops.mobius.transfer("EXEC_DEFAULT", True, kinds={"VERTEX_GROUPS", "UV"})
    assert panel.MOBIUS_PT_last_transfer.poll(bpy.context)
    said = drawn(panel.MOBIUS_PT_last_transfer)
    for text in ("From 'Source'", "Vertex Groups: 10", "UV Maps: 1", "UVMap", "Right → Right.001", "and 2 more"):
        assert text in said
    assert "Group 0" not in said
    together = " ".join(said)
    assert "'Group 0' is locked on 'Target' and left as it is" in together
    assert "'Target' keeps its own vertex group ('Right')" in together
    bpy.ops.ed.undo()
    assert not panel.MOBIUS_PT_last_transfer.poll(bpy.context)
    bpy.context.scene.mobius.target.data.mobius_transferred = '{"layers": 3}'
    assert not panel.MOBIUS_PT_last_transfer.poll(bpy.context)


# before a transfer


def test_what_is_kept_and_replaced_is_said_above_the_button(pair: tuple[Any, Any]) -> None:
    source, target = pair
    assert not [line for line in drawn(panel.MOBIUS_PT_transfer) if "on the target" in line]
    for obj in pair:
        obj.data.materials.append(bpy.data.materials.new("Skin"))
        for name in ("Head", "Jaw", "Eye", "Nose", "Chin"):
            obj.vertex_groups.new(name=name).add((1, 2), 0.5, "REPLACE")
    target.data.uv_layers.new(name="UVMap")
    lines = drawn(panel.MOBIUS_PT_transfer)
    assert "Stays on the target: Head, Jaw, Eye, Nose, ..." in lines
    assert "Replaced on the target: Materials" in lines
    assert lines.index("Replaced on the target: Materials") < lines.index("Transfer")
    bpy.context.scene.mobius.collisions = "replace"
    bpy.context.scene.mobius.kinds = {"UV", "MATERIALS"}
    lines = drawn(panel.MOBIUS_PT_transfer)
    assert "Replaced on the target: UVMap, Materials" in lines
    assert not [line for line in lines if line.startswith("Stays")]
    bpy.context.scene.mobius.carry_to = "selected"  # none of which is aligned
    assert not [line for line in drawn(panel.MOBIUS_PT_transfer) if "on the target" in line]
    bpy.context.scene.mobius.target = source
    bpy.context.scene.mobius.carry_to = "target"
    assert not [line for line in drawn(panel.MOBIUS_PT_transfer) if "on the target" in line]


def test_what_align_reports_is_what_the_panel_says(pair: tuple[Any, Any], capfd: pytest.CaptureFixture[str]) -> None:
    """In the same words and figures, so in the interface's language."""
    source, target = pair
    assert bpy.ops.mobius.align(**QUICK) == {"FINISHED"}
    found = stored_alignment.figures(target)
    assert found is not None
    rows = verdict.verdict_lines(bpy.context.scene, source, found, verdict.judgement_of(found).level)
    assert len(rows) == 3
    said = next(line for line in capfd.readouterr().out.splitlines() if "'Source' → 'Target'" in line)
    assert said == f"Info: 'Source' → 'Target': {'; '.join(rows)}"
