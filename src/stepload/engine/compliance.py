"""A cautious estimate, from below, of the tangent compliance dx/dF."""

from __future__ import annotations

import math

CONFIDENCE = 3.0
FORGET_SHARE = 0.2
"""Data are forgotten over the travel in which the force changes by this share of itself."""
POINTS_PER_MEMORY = 20.0
LEAST_MEMORY_QUANTA = 8.0


class TangentCompliance:
    """Lower confidence bound of the tangent compliance dx/dF, from force and position in motion.

    Recursive regression of force on position (the position is the quieter of the two, so noise does
    not pull the slope down), forgotten by travel. Readings are averaged until the arm has moved by
    a small share of the memory, so that time spent at rest carries no weight. `c_m_per_n` is never
    below 1/K_s: the arm cannot feel stiffer than itself.
    """

    def __init__(self, stiffness_n_per_m: float, noise_n: float, resolution_m: float) -> None:
        self._floor = 1.0 / stiffness_n_per_m
        self._noise_n = noise_n
        self._quantum_m = resolution_m
        self._least_bin_m = 0.5 * resolution_m
        self.restart()

    def restart(self) -> None:
        """Forget everything: a new contact, or a change of direction."""
        self.c_m_per_n = self._floor
        self._remember(0.0)
        self._bin_start_m = math.nan
        self._bin_f = self._bin_x = 0.0
        self._bin_n = 0
        self._w = self._mx = self._mf = self._sxx = self._sxf = self._sff = 0.0
        self._x_last = 0.0

    def add(self, position_m: float, force_n: float) -> None:
        """Take one pair in; force and position must be of the same moment."""
        self._bin_f += force_n
        self._bin_x += position_m
        self._bin_n = n = self._bin_n + 1
        moved_m = position_m - self._bin_start_m
        if moved_m != moved_m:
            self._bin_start_m = position_m
            return
        bin_m = self._memory_m / POINTS_PER_MEMORY
        if -bin_m < moved_m < bin_m or -self._least_bin_m < moved_m < self._least_bin_m:
            return
        self._push(self._bin_x / n, self._bin_f / n, n)
        self._bin_start_m = position_m
        self._bin_f = self._bin_x = 0.0
        self._bin_n = 0

    def _push(self, x: float, f: float, averaged: int) -> None:
        keep = max(0.2, 1.0 - abs(x - self._x_last) / self._memory_m) if self._w else 0.0
        self._x_last = x
        self._w = w = keep * self._w + 1.0
        dx, df = x - self._mx, f - self._mf
        self._mx += dx / w
        self._mf += df / w
        rest = 1.0 - 1.0 / w
        self._sxx = sxx = keep * self._sxx + rest * dx * dx
        self._sxf = sxf = keep * self._sxf + rest * dx * df
        self._sff = sff = keep * self._sff + rest * df * df
        if w < 2.5 or sxx <= 0.0:
            return
        slope = sxf / sxx
        scatter = max(sff - slope * sxf, 0.0) / (w - 2.0)
        noise = self._noise_n * self._noise_n / averaged
        quantum = slope * self._quantum_m
        variance = max(scatter, noise + quantum * quantum / (12.0 * averaged)) / sxx
        stiffest = max(slope, 0.0) + CONFIDENCE * math.sqrt(variance)
        self.c_m_per_n = max(self._floor, 1.0 / stiffest)
        self._remember(f)

    def _remember(self, force_n: float) -> None:
        travel_m = self.c_m_per_n * max(FORGET_SHARE * abs(force_n), 12.0 * self._noise_n)
        self._memory_m = max(travel_m, LEAST_MEMORY_QUANTA * self._quantum_m)
