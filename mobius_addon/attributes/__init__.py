"""Everything that can be carried from one mesh to another: how each kind of data is read, carried and written."""

from .access import (
    DISC_LAYOUT,
    MATCHED_GROUP,
    MAX_UV_MAPS,
    OWN_NAMES,
    SHARED_COLOR,
    SHARED_LAYOUT,
    AttributeAccess,
    Layer,
    numbered,
)
from .carrier import Carrier
from .plan import Carried, Transfer, plan_transfer
from .table import KINDS, ROWS, Kind, Row
from .vertex_groups import VertexGroupAccess

__all__ = [
    "DISC_LAYOUT",
    "KINDS",
    "MATCHED_GROUP",
    "MAX_UV_MAPS",
    "OWN_NAMES",
    "ROWS",
    "SHARED_COLOR",
    "SHARED_LAYOUT",
    "AttributeAccess",
    "Carried",
    "Carrier",
    "Kind",
    "Layer",
    "Row",
    "Transfer",
    "VertexGroupAccess",
    "numbered",
    "plan_transfer",
]
