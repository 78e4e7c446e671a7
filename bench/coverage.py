"""Is what is called IDENTIFIED true? Random runs of ideal and spoiled worlds, 0.1 mN to 1 kN.

    python bench/coverage.py --runs 1000 --seed 1

See `stepload_verify.trials.honest`.
"""

from __future__ import annotations

import os

os.environ["OPENBLAS_NUM_THREADS"] = "1"
os.environ["OMP_NUM_THREADS"] = "1"

import sys

from stepload_verify.trials.honest.bench import main

if __name__ == "__main__":
    sys.exit(main())
