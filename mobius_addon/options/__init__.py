"""Options that operators and the scene's settings share, each defined once."""

from .align import ALIGN_OPTIONS, OF_SCENE, AlignOptions, align_settings
from .scan import SCAN_OPTIONS, ScanOptions, outer_vertex, repair
from .transfer import (
    SOURCE_MASK_OPTIONS,
    TRANSFER_OPTIONS,
    SourceMaskOptions,
    TransferOptions,
    enum_identifier,
    source_mask,
    transfer_settings,
)
from .transfer_layout import draw_transfer

__all__ = [
    "ALIGN_OPTIONS",
    "OF_SCENE",
    "SCAN_OPTIONS",
    "SOURCE_MASK_OPTIONS",
    "TRANSFER_OPTIONS",
    "AlignOptions",
    "ScanOptions",
    "SourceMaskOptions",
    "TransferOptions",
    "align_settings",
    "draw_transfer",
    "enum_identifier",
    "outer_vertex",
    "repair",
    "source_mask",
    "transfer_settings",
]
