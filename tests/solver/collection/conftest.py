"""Collections of small surfaces."""

from collections.abc import Callable

import pytest
from families import grown, specimen

from solver.collection import Specimen


@pytest.fixture(scope="session")
def family() -> Callable[[int], list[Specimen]]:
    """Return the first so many of a family of sheets, every third of them mirrored."""
    return lambda count: [specimen(f"sheet-{k}", grown(k)) for k in range(count)]
