"""Meshes in and out of files, through Blender's own importers and exporters."""

from .formats import FORMATS, Format, Unreadable, format_of, split_object_name
from .opening import Opened, opened
from .publishing import Outputs, outputs, real_place, require_folder, require_place
from .reading import Imported, import_mesh, import_meshes, new_scene
from .writing import export_mesh, write_mesh

__all__ = [
    "FORMATS",
    "Format",
    "Imported",
    "Opened",
    "Outputs",
    "Unreadable",
    "export_mesh",
    "format_of",
    "import_mesh",
    "import_meshes",
    "new_scene",
    "opened",
    "outputs",
    "real_place",
    "require_folder",
    "require_place",
    "split_object_name",
    "write_mesh",
]
