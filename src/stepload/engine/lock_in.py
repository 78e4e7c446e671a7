"""How far a channel swings with a known frequency, cycle by cycle, whatever else it does."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

ComplexArray = NDArray[np.complex128]
FloatArray = NDArray[np.float64]

LEAST_READINGS = 8
"""Of one cycle; fewer tell no amplitude beside offset and drift."""


class LockIn:
    """Takes the readings of one channel in and tells the amplitudes of each cycle.

    Args:
        omega_rad_s: of the swing.
        components: how many numbers a reading has.
    """

    __slots__ = ("_amplitudes", "_components", "_omega", "_times", "_values")

    def __init__(self, omega_rad_s: float, components: int) -> None:
        self._omega = omega_rad_s
        self._components = components
        self._times: list[float] = []
        self._values: list[tuple[float, ...]] = []
        self._amplitudes: list[ComplexArray] = []

    def add(self, time_s: float, values: tuple[float, ...]) -> None:
        """Take one reading in; times may be of any origin, the same for channels to compare."""
        self._times.append(time_s)
        self._values.append(values)

    def end_cycle(self) -> None:
        """The readings since the last call are one cycle."""
        self._amplitudes.append(self._fit())
        self._times.clear()
        self._values.clear()

    def drop(self) -> None:
        """Forget the readings since the last cycle."""
        self._times.clear()
        self._values.clear()

    @property
    def amplitudes(self) -> ComplexArray:
        """Complex amplitudes, shape (cycles, components); NaN where there was too little to see."""
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
