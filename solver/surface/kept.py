"""A property that is computed when it is first asked for, and kept: without the lock that Python 3.11 has around it.

There `functools.cached_property` holds one lock for all objects of a class, so that threads that work on one object
each wait for each other. From 3.12 on it has none. Two threads may compute a value of one object twice: the same.
"""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    kept = cached_property
else:

    class kept(cached_property):  # noqa: N801  (like the one that it stands for)
        """`functools.cached_property` as it is from Python 3.12 on."""

        def __get__(self, instance: Any, owner: Any = None) -> Any:
            """Return the value, which stands in the object's own dictionary from then on."""
            if instance is None:
                return self
            value = instance.__dict__[self.attrname] = self.func(instance)
            return value
