"""Pictures carried from surface to surface, texel by texel: no rays, no cage, no common pose.

Each texel of the target's UV layout lies in one of its triangles; the correspondence takes the triangle's corners to
the source, the point between them is looked for on the source's surface next to these, and the source's picture is
read there, at the source's own UV.
"""

from .carrying import Carrying
from .exr import exr_bytes
from .layout import LayoutError, island_numbers, picture_size, place_in_tiles
from .normal_maps import FLAT, KeptTurns, TangentFrames, TurnedNormals, Turns
from .paints import FromCorners, FromPictures, OnTarget, Paint, Stacked, Together
from .picture import CLIP, EXTEND, MIRROR, REPEAT, Picture, encoded
from .png import png_bytes
from .resample import Finder, InLayout, Resampled, Wanted, at_vertices, resample
from .transfer_map import MapPaint, TransferMap

__all__ = [
    "CLIP",
    "EXTEND",
    "FLAT",
    "MIRROR",
    "REPEAT",
    "Carrying",
    "Finder",
    "FromCorners",
    "FromPictures",
    "InLayout",
    "KeptTurns",
    "LayoutError",
    "MapPaint",
    "OnTarget",
    "Paint",
    "Picture",
    "Resampled",
    "Stacked",
    "TangentFrames",
    "Together",
    "TransferMap",
    "TurnedNormals",
    "Turns",
    "Wanted",
    "at_vertices",
    "encoded",
    "exr_bytes",
    "island_numbers",
    "picture_size",
    "place_in_tiles",
    "png_bytes",
    "resample",
]
