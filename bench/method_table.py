"""How far each estimator is from the truth, by simulation of the step-load protocol.

    python bench/method_table.py [RUNS]

Root mean square over RUNS (200) simulated runs, the worst 2 % left out, of the force error over the
true law in N: K̂ δ^n̂ against F for F = 1 … 300 N, δ the true deformation. Rig "STVF":
K_s = 3.49e6 N/m, position quantum 2 µm (0.5 µm noise before it), force quantum 1.5 N (0.5 N noise
before it), 1000 Hz, steps of 50 N to 300 N with 1 s ramps and 3 s holds, about 2000 samples uniform
in force.

Scenario A: the zero is known. B: the zero is the position at the first sample above 3 N.
C: B with an error of K_s of 2 % (standard deviation) and a smooth position error of 0.54 µm,
correlated over 50 N. The starting position is random within the position quantum.

In brackets: what an earlier simulation of the same protocol gave. Its noise before quantisation,
its starting phase, the exact rule of its contact threshold and its number of samples are not known;
those used here were chosen among a few because they come close to its columns A and B, so the
agreement there checks the estimators against each other more than the absolute figures. The
worst 2 % are left out because of single runs of aluminium in C. Fits in logarithms with a
known zero ("log_ls", "log_tls", A) hang on the few samples nearest to zero and differ most; in
column C aluminium is beyond K_max, where the figure hangs on the worst runs.
"""

from __future__ import annotations

import math
import os
import sys
from collections.abc import Callable

os.environ["OPENBLAS_NUM_THREADS"] = "1"

import numpy as np

from stepload.errors import DomainError
from stepload.identification.fit import Fit, FloatArray
from stepload.identification.inverse_law import inverse_ls, joint
from stepload.identification.ls import log_ls, log_tls, mixed_ls_tls, rs_btls
from stepload.identification.samples import uniform_in_force
from stepload.identification.weighted import ew_tls, odr

SYSTEM_STIFFNESS_N_PER_M = 3.49e6
PAYLOADS = {"plastic": 6.57e8, "pyramid": 1.32e8, "alu": 8.87e9}
POSITION_QUANTUM_M, POSITION_NOISE_M = 2e-6, 0.5e-6
FORCE_QUANTUM_N, FORCE_NOISE_N = 1.5, 0.5
SIGMA_N = FORCE_QUANTUM_N / math.sqrt(12.0)
SIGMA_M = math.hypot(POSITION_QUANTUM_M / math.sqrt(12.0), SIGMA_N / SYSTEM_STIFFNESS_N_PER_M)
CONTACT_THRESHOLD_N = 3.0
ESTIMATORS: dict[str, Callable[[FloatArray, FloatArray], Fit]] = {
    "log_ls": log_ls,
    "log_tls": log_tls,
    "rs_btls": rs_btls,
    "mixed_ls_tls": mixed_ls_tls,
    "ew_tls": lambda x, y: ew_tls(x, y, sigma_m=SIGMA_M, sigma_n=SIGMA_N),
    "odr": lambda x, y: odr(x, y, sigma_m=SIGMA_M, sigma_n=SIGMA_N),
    "inverse_ls": inverse_ls,
    "joint": joint,
}

EXPECTED = {
    "A plastic": {
        "log_ls": 4.31,
        "log_tls": 3.10,
        "rs_btls": 0.24,
        "ew_tls": 0.25,
        "odr": 0.16,
        "joint": 0.93,
    },
    "A alu": {
        "log_ls": 17.6,
        "log_tls": 5.3,
        "rs_btls": 5.15,
        "ew_tls": 6.1,
        "odr": 0.87,
        "joint": 4.4,
    },
    "B plastic": {
        "log_ls": 20.6,
        "log_tls": 20.3,
        "rs_btls": 23.5,
        "ew_tls": 23.5,
        "odr": 23.6,
        "joint": 0.89,
    },
    "B alu": {
        "log_ls": 41.0,
        "log_tls": 46.0,
        "rs_btls": 50.0,
        "ew_tls": 52.0,
        "odr": 54.0,
        "joint": 4.9,
    },
    "C plastic": {
        "log_ls": 22.3,
        "log_tls": 21.8,
        "rs_btls": 24.9,
        "ew_tls": 24.9,
        "odr": 25.1,
        "joint": 11.7,
    },
    "C pyramid": {
        "log_ls": 15.9,
        "log_tls": 14.9,
        "rs_btls": 15.0,
        "ew_tls": 15.0,
        "odr": 15.0,
        "joint": 3.5,
    },
    "C alu": {
        "log_ls": 51.0,
        "log_tls": 70.0,
        "rs_btls": 83.0,
        "ew_tls": 98.0,
        "odr": 89.0,
        "joint": 73.0,
    },
}


def protocol() -> FloatArray:
    """True force at 1000 Hz: six ramps of 50 N in 1 s, each held for 3 s."""
    parts = []
    for level in range(0, 300, 50):
        parts.append(np.linspace(level, level + 50.0, 1000, endpoint=False))
        parts.append(np.full(3000, level + 50.0))
    return np.concatenate(parts)


def smooth_error(
    force_n: FloatArray, sd: float, length_n: float, rng: np.random.Generator
) -> FloatArray:
    """A Gaussian process in force with squared-exponential correlation, as a Fourier series."""
    terms = 60
    waves = rng.normal(0.0, 1.0 / length_n, terms)
    phases = rng.uniform(0.0, 2.0 * np.pi, terms)
    force, where = np.unique(force_n, return_inverse=True)
    wave = np.cos(force[:, None] * waves + phases).sum(axis=1)
    error: FloatArray = sd * math.sqrt(2.0 / terms) * wave[where]
    return error


def simulate(k: float, scenario: str, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """(deformation in m, force in N) of one run, compensated (27) and uniform in force."""
    true_n = protocol()
    position = (true_n / k) ** (1.0 / 1.5) + true_n / SYSTEM_STIFFNESS_N_PER_M
    expected = SYSTEM_STIFFNESS_N_PER_M
    if scenario == "C":
        expected *= 1.0 + 0.02 * rng.normal()
        position = position + smooth_error(true_n, 0.54e-6, 50.0, rng)
    phase = rng.uniform(-0.5, 0.5) * POSITION_QUANTUM_M
    noisy = position + phase + rng.normal(0.0, POSITION_NOISE_M, position.size)
    measured = np.round(noisy / POSITION_QUANTUM_M) * POSITION_QUANTUM_M - phase
    force = true_n + rng.normal(0.0, FORCE_NOISE_N, true_n.size)
    force = np.round(force / FORCE_QUANTUM_N) * FORCE_QUANTUM_N
    if scenario != "A":
        touch = int(np.argmax(force > CONTACT_THRESHOLD_N))
        measured, force = measured[touch:] - measured[touch], force[touch:]
    loaded = force > 0.0
    deformation, force = (measured - force / expected)[loaded], force[loaded]
    chosen = uniform_in_force(force, 2000)
    return deformation[chosen], force[chosen]


def force_error(fit: Fit, k: float) -> float:
    """rms of K̂ δ^n̂ - F in N over F = 1 … 300 N, at the true deformations."""
    force = np.arange(1.0, 301.0)
    error = fit.k * (force / k) ** (fit.n / 1.5) - force
    return float(np.sqrt(np.mean(error**2)))


def cell(k: float, scenario: str, runs: int, seed: int = 1) -> dict[str, float]:
    """rms over `runs` of the force error in N, by estimator.

    Left out are runs that an estimator refuses, and the worst 2 %.
    """
    rng = np.random.default_rng(seed)
    errors: dict[str, list[float]] = {name: [] for name in ESTIMATORS}
    for _ in range(runs):
        points = simulate(k, scenario, rng)
        for name, estimator in ESTIMATORS.items():
            try:
                errors[name].append(force_error(estimator(*points), k))
            except DomainError:
                continue
    kept = {name: sorted(e)[: math.ceil(0.98 * len(e))] for name, e in errors.items() if e}
    return {name: float(np.sqrt(np.mean(np.square(e)))) for name, e in kept.items()}


def main() -> None:
    """Print the table."""
    runs = int(sys.argv[1]) if len(sys.argv) > 1 else 200
    print(f"rms force error over the true law [N], {runs} runs a cell (expected)")
    print(f"{'':14s}" + "".join(f"{title:>16s}" for title in EXPECTED))
    columns = {title: cell(PAYLOADS[title[2:]], title[0], runs) for title in EXPECTED}
    for name in ESTIMATORS:
        print(f"{name:14s}", end="")
        for title, column in columns.items():
            expected = EXPECTED[title].get(name)
            beside = f"({expected:g})" if expected else ""
            print(f"{column.get(name, math.nan):8.3g} {beside:7s}", end="")
        print()


if __name__ == "__main__":
    main()
