"""Meshes in and out of files, through Blender's own importers and exporters."""

from .formats import FORMATS, Format, Unreadable, format_of, split_object_name
from .reading import Imported, import_mesh, import_meshes, new_scene
from .writing import Outputs, export_mesh, outputs

__all__ = [
    "FORMATS",
    "Format",
    "Imported",
    "Outputs",
    "Unreadable",
    "export_mesh",
    "format_of",
    "import_mesh",
    "import_meshes",
    "new_scene",
    "outputs",
    "split_object_name",
]
