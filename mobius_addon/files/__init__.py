"""Meshes in and out of files, through Blender's own importers and exporters."""

from .formats import FORMATS, READ_ONLY, Format, format_of, split_object_name
from .landmark_file import read_landmarks
from .reading import Imported, chosen, import_mesh, import_meshes, new_scene, require_places
from .unreadable import Unreadable
from .writing import Outputs, export_mesh, outputs

__all__ = [
    "FORMATS",
    "READ_ONLY",
    "Format",
    "Imported",
    "Outputs",
    "Unreadable",
    "chosen",
    "export_mesh",
    "format_of",
    "import_mesh",
    "import_meshes",
    "new_scene",
    "outputs",
    "read_landmarks",
    "require_places",
    "split_object_name",
]
