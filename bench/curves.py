"""Time to read and to prepare a curve of a million rows, beside numpy's own reader.

    python bench/curves.py

CPU times of one process, best of three; the file is written first. numpy's reader takes the same
file as it stands, without any check of its cells. Exit code 1 where reading and preparing take more
than five seconds, or reading more than four times as long as numpy.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from stepload.record.curves import read_curve
from stepload.report.conditions import Stated
from stepload.report.curve import prepare

ROWS = 1_000_000
LARGEST_S, LARGEST_RATIO = 5.0, 4.0
RIG = Stated(system_stiffness_n_per_m=3.49e6, system_stiffness_sigma_n_per_m=70e3)


def write(path: Path) -> None:
    """A loading with a hold and an unloading, noise on both channels."""
    rng = np.random.default_rng(0)
    time_s = np.arange(ROWS) / 10_000.0
    force = np.interp(time_s, [0, 5, 80, 90, 100], [0, 0, 300, 300, 0])
    travel = (force / 6.57e8) ** (2 / 3) + force / 3.49e6 + np.interp(time_s, [0, 5], [-3e-5, 0])
    noisy = travel + rng.normal(0, 2e-7, ROWS), force + rng.normal(0, 0.5, ROWS)
    header = "time_s,position_m,force_n"
    np.savetxt(path, np.column_stack([time_s, *noisy]), "%.8g", ",", header=header, comments="")


def best(work: Callable[[], object]) -> float:
    """CPU seconds of the fastest of three."""
    times = []
    for _ in range(3):
        start = time.process_time()
        work()
        times.append(time.process_time() - start)
    return min(times)


def main() -> int:
    with tempfile.TemporaryDirectory() as directory:
        path = Path(directory) / "curve.csv"
        write(path)
        plain_s = best(lambda: np.loadtxt(path, delimiter=",", skiprows=1))
        read_s = best(lambda: read_curve(path))
        curve = read_curve(path)
        prepare_s = best(lambda: prepare(curve, RIG))
    print(f"numpy.loadtxt {plain_s:.2f} s, read_curve {read_s:.2f} s ({read_s / plain_s:.1f}), "
          f"prepare {prepare_s:.2f} s")  # fmt: skip
    return int(read_s + prepare_s > LARGEST_S or read_s > LARGEST_RATIO * plain_s)


if __name__ == "__main__":
    sys.exit(main())
