"""Run by a Blender without scipy: `python install_without_scipy.py ZIP`, a zip that does not bring scipy either."""

import os
import sys
import traceback

import bpy

try:
    done = bpy.ops.extensions.package_install_files(filepath=sys.argv[1], repo="user_default", enable_on_install=True)
    assert done == {"FINISHED"}, done
    ours = [name for name in dir(bpy.types) if name.startswith("MOBIUS")]
    assert ours == ["MOBIUS_PT_absent"], ours
    bpy.ops.preferences.addon_disable(module="bl_ext.user_default.mobius")
    assert not hasattr(bpy.types, "MOBIUS_PT_absent")
    sys.stdout.write("SAID SO\n")
except BaseException:
    traceback.print_exc()
sys.stdout.flush()
sys.stderr.flush()
os._exit(0)
