"""Command line of the paper's experiments."""

import argparse
import os
import time
from pathlib import Path


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tests.bench.paper", description=__doc__)
    parser.add_argument("experiment", choices=["synthetic", "teeth", "faces"])
    parser.add_argument("-o", "--output", type=Path, help="folder for tables and figures (default: paper/EXPERIMENT)")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="processes; each method runs on one core")
    parser.add_argument("--sizes", type=int, nargs="+", default=[100, 50, 20], help="numbers of points")
    parser.add_argument("--trials", type=int, default=1, help="random instances of each synthetic setting")
    options = parser.parse_args()
    # one core for each process: idle threads of the linear algebra would spin on the others'
    os.environ["OPENBLAS_NUM_THREADS"] = os.environ["OMP_NUM_THREADS"] = "1"
    from . import faces, synthetic, teeth  # numpy reads the above when it is loaded

    folder = options.output or Path("paper") / options.experiment
    folder.mkdir(parents=True, exist_ok=True)
    started = time.perf_counter()
    if options.experiment == "synthetic":
        synthetic.run(folder, options.sizes, options.trials, options.jobs)
    else:
        {"teeth": teeth, "faces": faces}[options.experiment].run(folder, options.sizes, options.jobs)
    print(f"{time.perf_counter() - started:.0f} s with {options.jobs} processes; everything is in {folder}/")


if __name__ == "__main__":
    main()
