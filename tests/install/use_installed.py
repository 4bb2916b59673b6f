"""Run by a Blender without scipy, with an empty user folder: `python use_installed.py ZIP`.

Installs the zip as the window does, aligns and transfers, switches the extension off and on, removes it, and looks for
what is left. Ends with status 0 if all of that went well.
"""

import gc
import os
import sys
import threading
import traceback
from pathlib import Path

import bpy  # isort: skip  (first: it makes Blender's own modules importable)
import addon_utils

MODULE = "bl_ext.user_default.mobius"


def traces() -> set[str]:
    """Everything of ours that is in this process that bears our name."""
    found = {name for name in dir(bpy.types) if "mobius" in name.lower()} | {f"ops.{x}" for x in dir(bpy.ops.mobius)}
    for cls in (bpy.types.Scene, bpy.types.Object, bpy.types.Mesh, bpy.types.WindowManager):
        found |= {f"{cls.__name__}.{name}" for name in dir(cls) if name.startswith("mobius")}
    for name in dir(bpy.app.handlers):
        handlers = getattr(bpy.app.handlers, name)
        for handler in handlers if isinstance(handlers, list) else ():
            if "mobius" in handler.__module__:
                found.add(f"{name}: {handler.__module__}")
    for cls in (
        *bpy.types.Menu.__subclasses__(),
        *bpy.types.Panel.__subclasses__(),
        *bpy.types.Header.__subclasses__(),
    ):
        for function in getattr(getattr(cls, "draw", None), "_draw_funcs", ()):
            if function.__module__.startswith(MODULE):
                found.add(f"{cls.__name__}: {function.__name__}")
    for keymap in bpy.context.window_manager.keyconfigs.addon.keymaps:
        found |= {f"key: {item.idname}" for item in keymap.keymap_items if item.idname.startswith("mobius.")}
    for kept in gc.get_objects():
        if callable(kept) and str(getattr(kept, "__module__", "")).startswith(MODULE) and is_timer(kept):
            found.add(f"timer: {kept}")
    return found | {f"thread: {thread.name}" for thread in threading.enumerate() if "mobius" in thread.name}


def is_timer(kept: object) -> bool:
    try:
        return bpy.app.timers.is_registered(kept)
    except (TypeError, ValueError):
        return False


def sheet(name: str, n: int) -> bpy.types.Object:
    """A hilly square of n by n vertices, the same surface for every n."""
    import numpy as np

    x, y = (a.ravel() for a in np.meshgrid(np.linspace(-1, 1, n), np.linspace(-0.8, 0.8, n)))
    z = 0.5 * np.exp(-8 * ((x - 0.4) ** 2 + (y - 0.3) ** 2)) - 0.3 * np.exp(-6 * ((x + 0.5) ** 2 + y**2))
    corner = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(np.stack([x, y, z], axis=1).tolist(), [], [(a, a + 1, a + n + 1, a + n) for a in corner.tolist()])
    obj = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(obj)
    return obj


def require(true: object, what: str) -> None:
    if not true:
        raise AssertionError(what)


def align_and_transfer() -> None:
    import numpy as np

    source, target = sheet("Source", 31), sheet("Target", 24)
    group = source.vertex_groups.new(name="Right")
    for vertex in source.data.vertices:
        group.add((vertex.index,), (vertex.co.x + 1) / 2, "REPLACE")
    bpy.context.scene.mobius.source, bpy.context.scene.mobius.target = source, target
    require(bpy.ops.mobius.align() == {"FINISHED"}, "aligned")
    require(target.data.mobius_alignment.certified, "with a certificate")
    require(bpy.ops.mobius.transfer() == {"FINISHED"}, "transferred")
    right = target.vertex_groups["Right"].index
    carried = [sum(g.weight for g in v.groups if g.group == right) for v in target.data.vertices]
    error = [abs(weight - (v.co.x + 1) / 2) for weight, v in zip(carried, target.data.vertices, strict=True)]
    require(np.median(error) < 0.02, f"the weights are where they belong: {np.median(error):.3f} off")


def installed_module(name: str) -> object:
    return sys.modules[f"{MODULE}.{name}"]


def main(path: str) -> None:
    user = Path(os.environ["BLENDER_USER_RESOURCES"]).resolve()
    before, search_path = traces(), set(sys.path)
    require(not before, f"nothing to begin with: {before}")
    require(
        bpy.ops.extensions.package_install_files(filepath=path, repo="user_default", enable_on_install=True)
        == {"FINISHED"},
        "installed",
    )
    require(addon_utils.check(MODULE) == (True, True), "enabled")
    enabled = traces()
    require({"MOBIUS_PT_main", "Scene.mobius"} <= enabled, f"the panel is there: {enabled}")
    align_and_transfer()
    scipy = Path(sys.modules["scipy"].__file__ or "").resolve()
    require(user in scipy.parents, f"scipy is the one in the zip, not {scipy}")
    kernels = installed_module("solver.search.kernels.compiled").library()  # type: ignore[attr-defined]
    require(kernels is not None and user in Path(kernels._name).resolve().parents, f"compiled kernels: {kernels}")

    for _ in range(2):
        bpy.ops.preferences.addon_disable(module=MODULE)
        require(not traces(), f"nothing stays when it is switched off: {traces()}")
        bpy.ops.preferences.addon_enable(module=MODULE)
        require(traces() == enabled, "all of it comes back")
    align_and_transfer()

    written = {str(p) for p in (user / "extensions/user_default/mobius").rglob("*") if "__pycache__" not in p.parts}
    index = [repo.module for repo in bpy.context.preferences.extensions.repos].index("user_default")
    require(bpy.ops.extensions.package_uninstall(repo_index=index, pkg_id="mobius") == {"FINISHED"}, "removed")
    require(not traces(), f"nothing stays in Blender: {traces()}")
    left = [p for p in user.rglob("*") if "mobius" in p.name.lower() or "scipy" in p.name.lower()]
    require(not left, f"nothing stays on disk: {left}")
    require(MODULE not in bpy.context.preferences.addons, "nor in the preferences")
    require(written, "it was there")
    # Blender itself adds the folder where it unpacks the wheels of all extensions
    ours = {entry for entry in set(sys.path) - search_path if ".local" not in Path(entry).parts}
    require(not ours, f"nothing stays on Python's search path: {ours}")


try:
    main(*sys.argv[1:])
except BaseException:
    traceback.print_exc()
    status = 1
else:
    status = 0
    sys.stdout.write("INSTALLED, USED AND REMOVED\n")
sys.stdout.flush()
sys.stderr.flush()
os._exit(status)  # Blender's exit handlers can hang
