"""Install the extension's zip for Blender's Python module, as the window does: `python docs/headless/install.py ZIP`.

It goes into the folder that the environment variable BLENDER_USER_RESOURCES names, or else into the person's own.
"""

from pathlib import Path
import sys

import bpy

path = str(Path(sys.argv[1]).resolve())
bpy.ops.extensions.package_install_files(filepath=path, repo="user_default", enable_on_install=False)
