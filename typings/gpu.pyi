# Blender's module brings no types, and what it holds depends on its version: everything in it is Any.
from typing import Any

def __getattr__(name: str) -> Any: ...
