"""Creep: a contact that goes on yielding under a constant force, and comes back when unloaded."""

from __future__ import annotations

import math

from stepload_drivers.sim.laws import ContactLaw


class Creep:
    """`inner` in series with Kelvin elements, driven by its own elastic deformation.

    Under constant force the elastic deformation δ of `inner` grows to
    δ (1 + Σ c_i (1 − e^(−t/τ_i))) (linear viscoelasticity); the elements share the creep evenly,
    one a decade of time.
    """

    def __init__(self, inner: ContactLaw, share: float, time_s: float, decades: int) -> None:
        self._inner = inner
        self._times_s = [time_s * 10.0**i for i in range(decades + 1)]
        self._share = share / len(self._times_s)
        self._crept_m = [0.0] * len(self._times_s)
        self._elastic_m = self._sum_m = 0.0
        self._dt_s = 0.0
        self._parts: list[float] = []

    @property
    def residual_m(self) -> float:
        return self._inner.residual_m + self._sum_m

    def evaluate(self, deformation_m: float) -> tuple[float, float]:
        return self._inner.evaluate(deformation_m - self._sum_m)

    def remember(self, deformation_m: float) -> None:
        inside_m = deformation_m - self._sum_m
        self._inner.remember(inside_m)
        self._elastic_m = max(0.0, inside_m - self._inner.residual_m)

    def flow(self, dt_s: float) -> None:
        """Let `dt_s` pass at the deformation that is remembered."""
        if dt_s != self._dt_s:
            self._dt_s = dt_s
            self._parts = [-math.expm1(-dt_s / time_s) for time_s in self._times_s]
        goal_m = self._share * self._elastic_m
        crept = self._crept_m
        for i, part in enumerate(self._parts):
            crept[i] += (goal_m - crept[i]) * part
        self._sum_m = sum(crept)
