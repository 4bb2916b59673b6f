"""Everything that can be carried from one mesh to another: how each kind of data is read, carried and written."""

from .access import (
    DISC_LAYOUT,
    LIVE_CONFIDENCE,
    LIVE_CORNERS,
    LIVE_FACE,
    LIVE_MATCHED,
    LIVE_NAMES,
    LIVE_WEIGHTS,
    MATCHED_GROUP,
    MAX_UV_MAPS,
    OWN_NAMES,
    PATTERN_COLOR,
    SHARED_COLOR,
    SHARED_LAYOUT,
    AttributeAccess,
    Layer,
    numbered,
)
from .active import ActiveLayers, note, persons_own
from .carrier import Carrier
from .masks import mask_names, mask_weights, piece_of
from .plan import Carried, Transfer, restored_on_failure, write_transfers
from .prepared import Reading
from .preview import Preview, preview
from .reading import plan_transfer, read_transfer
from .record import forget_written
from .rig import armature_of
from .settings import Mask, TransferSettings, split_names
from .table import KINDS, ROWS, Kind, Row
from .unmatched import Unmatched, carrier_between, unmatched_vertices
from .vertex_groups import VertexGroupAccess

__all__ = [
    "DISC_LAYOUT",
    "KINDS",
    "LIVE_CONFIDENCE",
    "LIVE_CORNERS",
    "LIVE_FACE",
    "LIVE_MATCHED",
    "LIVE_NAMES",
    "LIVE_WEIGHTS",
    "MATCHED_GROUP",
    "MAX_UV_MAPS",
    "OWN_NAMES",
    "PATTERN_COLOR",
    "ROWS",
    "SHARED_COLOR",
    "SHARED_LAYOUT",
    "ActiveLayers",
    "AttributeAccess",
    "Carried",
    "Carrier",
    "Kind",
    "Layer",
    "Mask",
    "Preview",
    "Reading",
    "Row",
    "Transfer",
    "TransferSettings",
    "Unmatched",
    "VertexGroupAccess",
    "armature_of",
    "carrier_between",
    "forget_written",
    "mask_names",
    "mask_weights",
    "note",
    "numbered",
    "persons_own",
    "piece_of",
    "plan_transfer",
    "preview",
    "read_transfer",
    "restored_on_failure",
    "split_names",
    "unmatched_vertices",
    "write_transfers",
]
