"""The experiments of Le, Chin and Suter (2016): ``python -m tests.bench.paper synthetic|teeth|faces [-o DIR]``."""
