"""The methods that Le, Chin and Suter (2016) compare with their search, each from its own paper.

All take what `solver.search` takes and return a `SearchResult`. None proves anything: `certified` is False and
`upper_bound` the number that no transformation can exceed, each source point at its largest weight.
"""

from .brute_force import brute_force
from .gradient_descent import gradient_descent
from .graph_matching import graph_matching
from .icp import icp
from .voting import voting

__all__ = ["brute_force", "gradient_descent", "graph_matching", "icp", "voting"]
