"""Many surfaces at once: every pair that a plan asks for, which maps to trust, and all on one topology.

Work is done in tasks, by any executor of `concurrent.futures`, and kept in a folder as it is done. Three-cycles of maps
show which are wrong, without any ground truth; points are carried along paths of those that are not.
"""

from .collect import Collection, collect
from .engine import processes
from .plan import Plan, Specimen, Told

__all__ = ["Collection", "Plan", "Specimen", "Told", "collect", "processes"]
