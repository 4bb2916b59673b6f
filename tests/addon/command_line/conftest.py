"""Files for the commands."""

from pathlib import Path

import pytest
from scenes import bumps, make_sheet


@pytest.fixture
def scans(tmp_path: Path) -> Path:
    """A folder with two sheets as .blend (the source carries data) and .obj, and bad ones."""
    import bpy
    from mobius_extension.mobius_addon import files

    source = make_sheet("Source", 21)
    group = source.vertex_groups.new(name="Right")
    for vertex in source.data.vertices:
        group.add((vertex.index,), (vertex.co.x + 1) / 2, "REPLACE")
    source.data.uv_layers.new(name="UVMap")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "source.blend"))
    files.export_mesh(source, tmp_path / "source.obj")
    for name, n, keep in (
        ("target", 16, None),
        ("hole", 6, lambda i, j: (i, j) != (2, 2)),
        ("parts", 7, lambda i, j: j != 2),
    ):
        files.new_scene()
        files.export_mesh(make_sheet(name.title(), n, bumps, keep), tmp_path / f"{name}.obj")
    files.new_scene()
    (tmp_path / "source.mtl").unlink(missing_ok=True)
    return tmp_path
