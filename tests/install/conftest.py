"""The zip of this platform, made as a person makes it."""

from pathlib import Path

import pytest
from zips import build


@pytest.fixture(scope="session")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The zip for this platform."""
    from solver.search.kernels.build_wheel import this_platform

    (path,) = build(tmp_path_factory.mktemp("dist"), this_platform())
    return path
