"""Meshes in and out of files, through Blender's own importers and exporters."""

from .formats import FORMATS, READ_ONLY, Format, format_of, split_object_name
from .landmark_file import read_landmarks, read_point_pairs
from .opening import Opened, opened
from .publishing import Outputs, outputs, real_place, require_folder, require_place
from .reading import Imported, chosen, import_mesh, import_meshes, new_scene, require_places
from .together import together
from .unreadable import Unreadable
from .writing import export_mesh, require_room, write_mesh

__all__ = [
    "FORMATS",
    "READ_ONLY",
    "Format",
    "Imported",
    "Opened",
    "Outputs",
    "Unreadable",
    "chosen",
    "export_mesh",
    "format_of",
    "import_mesh",
    "import_meshes",
    "new_scene",
    "opened",
    "outputs",
    "read_landmarks",
    "read_point_pairs",
    "real_place",
    "require_folder",
    "require_place",
    "require_places",
    "require_room",
    "split_object_name",
    "together",
    "write_mesh",
]
