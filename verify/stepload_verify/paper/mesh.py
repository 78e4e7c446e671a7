"""The paper's payloads by finite elements. The curves are kept beside this module.

The command `python -m stepload_verify.paper.mesh` writes them anew; it needs `stepload[fem]`.
"""

from __future__ import annotations

import csv
from functools import cache
from pathlib import Path

import numpy as np

from stepload_verify.paper.printed import FORCE_GRID_N
from stepload_verify.paper.step_load import FloatArray

FILE = Path(__file__).with_name("finite_elements.csv")
FORCES_N = (3.0, 10.0, *FORCE_GRID_N)


@cache
def kept() -> dict[str, tuple[FloatArray, FloatArray]]:
    """Force in N and deformation in m (N,) of each payload on the aluminium plate."""
    found: dict[str, list[tuple[float, float]]] = {}
    with FILE.open(encoding="utf-8") as file:
        for row in csv.DictReader(file):
            pair = float(row["force_n"]), float(row["deformation_m"])
            found.setdefault(row["payload"], []).append(pair)
    return {name: (np.array(pairs)[:, 0], np.array(pairs)[:, 1]) for name, pairs in found.items()}
