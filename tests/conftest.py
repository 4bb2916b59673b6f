"""What all tests share."""

import importlib.util
import sys
from pathlib import Path

import pytest

_status = 0


def pytest_sessionfinish(exitstatus: int) -> None:
    global _status
    _status = int(exitstatus)


@pytest.hookimpl(trylast=True)
def pytest_unconfigure() -> None:
    """Leave as `python .` does where Blender's module was loaded: its exit handlers can hang."""
    if "bpy" in sys.modules:
        main = Path(__file__).resolve().parents[1] / "__main__.py"
        spec = importlib.util.spec_from_file_location("mobius_leave", main)
        assert spec is not None
        assert spec.loader is not None
        command = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(command)
        command.leave(_status)
