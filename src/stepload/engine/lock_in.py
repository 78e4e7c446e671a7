"""Lock-in detection: a channel's amplitude at a known frequency, cycle by cycle."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

ComplexArray = NDArray[np.complex128]
FloatArray = NDArray[np.float64]

LEAST_READINGS = 8
"""Least number of readings in a cycle to fit an amplitude besides offset and drift."""


class LockIn:
    """Collects the readings of one channel and fits the amplitudes of each cycle.

    Args:
        omega_rad_s: angular frequency of the shake.
        components: how many numbers a reading has.
    """

    def __init__(self, omega_rad_s: float, components: int) -> None:
        self._omega = omega_rad_s
        self._components = components
        self._times: list[float] = []
        self._values: list[tuple[float, ...]] = []
        self._amplitudes: list[ComplexArray] = []

    def add(self, time_s: float, values: tuple[float, ...]) -> None:
        """Add one reading; times may have any origin, the same for channels to be compared."""
        self._times.append(time_s)
        self._values.append(values)

    def end_cycle(self) -> None:
        """Fit the readings since the last call as one cycle."""
        self._amplitudes.append(self._fit())
        self.drop()

    def drop(self) -> None:
        """Forget the readings since the last cycle."""
        self._times.clear()
        self._values.clear()

    @property
    def amplitudes(self) -> ComplexArray:
        """Complex amplitudes, shape (cycles, components); NaN where there were too few readings."""
        return np.array(self._amplitudes).reshape(-1, self._components)

    def _fit(self) -> ComplexArray:
        """Least squares of offset, drift, cosine and sine."""
        if len(self._times) < LEAST_READINGS:
            return np.full(self._components, complex(np.nan, np.nan))
        times: FloatArray = np.array(self._times)
        phase = self._omega * times
        design = np.column_stack(
            (np.ones_like(times), times - times.mean(), np.cos(phase), np.sin(phase))
        )
        parts = np.linalg.lstsq(design, np.array(self._values), rcond=None)[0]
        return np.asarray(parts[2] - 1j * parts[3], dtype=np.complex128)
