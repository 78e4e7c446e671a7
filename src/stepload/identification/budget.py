"""The known errors of the deformation along a path, source by source."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from stepload.identification.conditions import Sources, linearity_errors, quantum_left
from stepload.identification.drift import Drift
from stepload.identification.elastic import Elastic
from stepload.identification.fit import FloatArray
from stepload.identification.loops import Branch, Path
from stepload.identification.run_data import RunData
from stepload.identification.smooth import few_degrees, smooth_correlation

SYSTEM = "system stiffness K_s"
ALIKE_SHARE = 0.1
"""Correlation length of the error of a quantum, in quanta."""
LEAST_SHARE = 1e-4
"""Least standard uncertainty, as a share of the deformation."""


class Component(NamedTuple):
    """One source: its name, its size in words, the covariance (B, B) in m²."""

    source: str
    size: str
    covariance: FloatArray


def middle(count: int) -> int:
    """Index of the assumed length that is used where only one can be: about one load step."""
    return min(1, count - 1)


def errors_of(
    run: RunData, first: Branch, elastic: Elastic, drift: Drift | None, length_n: float
) -> list[Component]:
    """The covariance of every source along a loading, in one order for all.

    `drift` was taken out; `length_n` is the correlation length of the smooth error.
    """
    path, told, sources = first.path, run.conditions, run.conditions.sources
    force = path.force_n
    whole = elastic.compliance(force)
    late = path.rate_n_per_s * whole * sources.lag_sigma_s
    degrees = sources.smooth_degrees
    size_m = sources.smooth_error_m * (1.0 if degrees is None else few_degrees(degrees))
    elapsed = path.time_s - path.time_s[0]
    lasting = max(float(elapsed[-1]), 1e-12)
    growth = sources.temperature_sigma_k * sources.position_m_per_k * elapsed / lasting
    drift_m_per_s = drift.sigma_m_per_s if drift is not None else 0.0
    drifted = drift_m_per_s * elapsed
    span = float(np.ptp(first.deformation_m))
    alike = smooth_correlation(force, length_n)
    bent = whole * linearity_errors(force, sources.nonlinearity)
    system_m, rows_m = told.bend_sigma(force), told.table_sigma(force)
    undetected_m = told.uncovered_sigma(force)
    return [
        Component(
            "force noise and quantum",
            f"{sources.force_noise_n:.3g} N, {sources.force_resolution_n:.3g} N",
            np.diag(whole**2 * _force_variance(path, sources)),
        ),
        Component(
            "position noise and quantum",
            f"{sources.position_noise_m * 1e6:.3g} µm, "
            f"{sources.position_resolution_m * 1e6:.3g} µm",
            np.diag(sources.position_noise_m**2 / path.count)
            + dithered(elastic, path, sources)
            + (LEAST_SHARE * span) ** 2 * np.eye(path.size),
        ),
        Component(
            "smooth deformation error",
            f"{sources.smooth_error_m * 1e6:.3g} µm over {length_n:.3g} N",
            size_m**2 * alike,
        ),
        Component(
            SYSTEM,
            _system_size(sources),
            np.outer(system_m, system_m) + alike * np.outer(rows_m, rows_m)
            + np.outer(undetected_m, undetected_m),
        ),
        Component(
            "force linearity", f"{100 * sources.nonlinearity:.3g} %", bent.T @ bent
        ),
        Component(
            "alignment lag", f"{sources.lag_sigma_s * 1e3:.3g} ms", np.outer(late, late)
        ),
        Component(
            "temperature", f"{sources.temperature_sigma_k:.3g} K", np.outer(growth, growth)
        ),
        Component(
            "drift",
            f"± {drift_m_per_s * 1e6:.2g} µm/{'s' if run.timed else 'row'}",
            np.outer(drifted, drifted),
        ),
    ]  # fmt: skip


def total(parts: Sequence[Component]) -> FloatArray:
    """The covariance (B, B) of all sources together."""
    return np.asarray(sum(part.covariance for part in parts))


def _system_size(sources: Sources) -> str:
    if sources.system_stiffness_note:
        return sources.system_stiffness_note
    stiffness = sources.system_stiffness_n_per_m
    if stiffness is None:
        return "no K_s in the chain"
    table = " and a table of its deflection" if sources.deflection_force_n else ""
    return f"{100 * sources.system_stiffness_sigma_n_per_m / stiffness:.3g} %{table}"


def _force_variance(path: Path, sources: Sources) -> FloatArray:
    """Variance (B,) of the mean force of each stretch."""
    left_n = quantum_left(sources.force_resolution_n, sources.force_noise_n)
    each_n2 = sources.force_noise_n**2 + sources.force_resolution_n**2 / 12.0
    return np.asarray(each_n2 / path.count + left_n**2)


def dithered(elastic: Elastic, path: Path, sources: Sources) -> FloatArray:
    """Covariance (B, B) in m² of the quantum's error in means of samples with noise.

    It is the same where the true travel is, and another one a fifth of a quantum away; smaller
    where a stretch crosses several quanta.
    """
    quantum_m = sources.position_resolution_m
    if quantum_m <= 0.0:
        return np.zeros((path.size, path.size))
    size = sources.quantum_left_m / np.maximum(path.span_m / quantum_m, 1.0)
    expected_m = elastic.travel(path.force_n)
    away = np.subtract.outer(expected_m, expected_m) / (ALIKE_SHARE * quantum_m)
    return np.asarray(np.exp(-0.5 * away**2) * np.outer(size, size))
