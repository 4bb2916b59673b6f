"""The 3D viewport that a person looks at: what it shows, and from where."""

from .alone import (
    Away,
    forget_views,
    look_at_all_again,
    look_at_selected_alone,
    looks_at_some_alone,
    put_away,
    put_back,
)
from .colors import close_later, show_as_before, show_colors, show_materials
from .editing import edit, look_at_selected
from .which import axes_of, largest_area, space_of

__all__ = [
    "Away",
    "axes_of",
    "close_later",
    "edit",
    "forget_views",
    "largest_area",
    "look_at_all_again",
    "look_at_selected",
    "look_at_selected_alone",
    "looks_at_some_alone",
    "put_away",
    "put_back",
    "show_as_before",
    "show_colors",
    "show_materials",
    "space_of",
]
