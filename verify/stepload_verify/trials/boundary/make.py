"""Force over indentation of rough and smooth bodies on a half-space, by tamaas.

    pip install 'stepload-verify[boundary]'
    python -m stepload_verify.trials.boundary.make

Writes `curves.csv` beside itself in about ten minutes. Bodies are rigid, the half-space is free
(no images) and has the modulus of acetal. Where a hardness is given, no pressure exceeds it while
the body is loaded; what was pressed in beyond that stays, and the unloading is elastic.
"""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import tamaas as tm
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
FILE = Path(__file__).with_name("curves.csv")
SIDE = 128
MODULUS_PA = 2.75e9 / (1.0 - 0.3**2)
FORCES_N = np.concatenate(([0.3, 0.6, 1.0, 1.7, 3.0, 5.0, 7.5], np.arange(10.0, 351.0, 10.0)))
TOP_N = 330.0
"""A body with a hardness is unloaded from the first force above this."""
TOLERANCE = 1e-8
STEPS, SETTLED = 4000, 1e-6


@dataclass(frozen=True, slots=True)
class Roughness:
    """A self-affine surface: rms height, Hurst's exponent, longest and shortest wave in windows."""

    rms_m: float
    hurst: float
    rolloff: float
    shortest: float
    seed: int

    def heights(self, side: int) -> FloatArray:
        """Heights (side, side) in m."""
        spectrum = tm.Isopowerlaw2D()
        spectrum.q0, spectrum.q1 = 1, round(1.0 / self.rolloff)
        spectrum.q2, spectrum.hurst = round(1.0 / self.shortest), self.hurst
        generator = tm.SurfaceGeneratorRandomPhase2D([side, side])
        generator.spectrum, generator.random_seed = spectrum, self.seed
        made = np.array(generator.buildSurface())
        return np.asarray(self.rms_m * (made - made.mean()) / made.std())


@dataclass(frozen=True, slots=True)
class Body:
    """What is pressed: depth below its tip in m over x, y in m; edge of the window; surface."""

    name: str
    depth: Callable[[FloatArray, FloatArray], FloatArray]
    window_m: float
    roughness: Roughness | None = None
    hardness_pa: float | None = None


def sphere(radius_m: float = 28.7e-3, ratio: float = 1.0) -> Callable[..., FloatArray]:
    """A sphere, or an ellipsoid whose radii have this ratio."""
    return lambda x, y: (ratio * x**2 + y**2 / ratio) / (2.0 * radius_m)


def cone(slope: float, radius_m: float) -> Callable[..., FloatArray]:
    """A cone with a rounded tip: a hyperboloid."""
    blunt = slope * radius_m
    return lambda x, y: slope * (np.sqrt(x**2 + y**2 + blunt**2) - blunt)


def pyramid(slope: float, radius_m: float) -> Callable[..., FloatArray]:
    """A pyramid of four sides, whose edges and tip are rounded."""
    blunt = slope * radius_m

    def depth(x: FloatArray, y: FloatArray) -> FloatArray:
        u, v = (np.sqrt(each**2 + blunt**2) for each in (x + y, x - y))
        return np.asarray(slope * (u + v - 2.0 * blunt) / 2.0)

    return depth


def punch(flat_m: float, edge_m: float) -> Callable[..., FloatArray]:
    """A flat punch whose edge is a radius."""
    return lambda x, y: np.maximum(np.hypot(x, y) - flat_m, 0.0) ** 2 / (2.0 * edge_m)


def feet(lower_m: float, apart_m: float, radius_m: float) -> Callable[..., FloatArray]:
    """Three balls in a row on a triangle, each lower than the last."""
    turns = 2.0 * np.pi * np.arange(3) / 3.0

    def depth(x: FloatArray, y: FloatArray) -> FloatArray:
        each = [
            ((x - apart_m * np.cos(t)) ** 2 + (y - apart_m * np.sin(t)) ** 2) / (2.0 * radius_m)
            + i * lower_m
            for i, t in enumerate(turns)
        ]
        return np.asarray(np.minimum.reduce(each))

    return depth


BODIES = (
    Body("sphere", sphere(), 4e-3),
    Body("ellipsoid", sphere(ratio=3.0), 6e-3),
    Body("sphere, rough 2 µm", sphere(), 4.5e-3, Roughness(2e-6, 0.8, 1 / 4, 1 / 24, 1)),
    Body("sphere, rough 7.5 µm, long waves", sphere(), 5e-3, Roughness(7.5e-6, 0.8, 1, 1 / 24, 2)),
    Body("sphere, rough 5 µm, short waves", sphere(), 5e-3, Roughness(5e-6, 0.5, 1 / 8, 1 / 32, 3)),
    Body("sphere, rough 7.5 µm, 0.2 GPa", sphere(), 5e-3,
         Roughness(7.5e-6, 0.8, 1 / 4, 1 / 32, 4), 2.0e8),
    Body("sphere, rough 15 µm, 0.3 GPa", sphere(), 6e-3,
         Roughness(15e-6, 0.7, 1 / 6, 1 / 24, 5), 3.0e8),
    Body("rounded cone", cone(0.08, 10e-3), 4e-3),
    Body("rounded cone, rough 3 µm", cone(0.08, 10e-3), 4e-3,
         Roughness(3e-6, 0.9, 1 / 4, 1 / 24, 6)),
    Body("rounded pyramid", pyramid(0.06, 6e-3), 5e-3),
    Body("rounded punch", punch(0.4e-3, 5e-3), 3e-3),
    Body("rounded punch, rough 3 µm", punch(0.5e-3, 4e-3), 3e-3,
         Roughness(3e-6, 0.8, 1 / 3, 1 / 24, 7)),
    Body("three feet", feet(4e-6, 1.2e-3, 20e-3), 5.5e-3),
)  # fmt: skip


class HalfSpace:
    """The free half-space under a square window."""

    def __init__(self, window_m: float) -> None:
        self.window_m = window_m
        kind = tm.model_type.basic_2d
        self.model = tm.ModelFactory.createModel(kind, [window_m] * 2, [SIDE] * 2)
        self.model.E, self.model.nu = MODULUS_PA, 0.0
        tm.ModelFactory.registerNonPeriodic(self.model, "free")

    def sinks(self, pressure_pa: FloatArray) -> FloatArray:
        """Displacement (SIDE, SIDE) in m under a pressure."""
        moved = np.zeros_like(pressure_pa)
        self.model.operators["free"](pressure_pa, moved)
        return moved

    def force(self, pressure_pa: FloatArray) -> float:
        """Of a pressure, in N."""
        return float(pressure_pa.mean() * self.window_m**2)

    def approach(self, heights_m: FloatArray, force_n: float) -> float:
        """How deep an elastic body is at a force, in m."""
        solver = tm.PolonskyKeerRey(self.model, heights_m, TOLERANCE)
        solver.setIntegralOperator("free")
        solver.solve(force_n / self.window_m**2)
        pressure_pa = np.array(self.model.traction)
        touching = pressure_pa > 1e-3 * pressure_pa.max()
        if touching[[0, -1]].any() or touching[:, [0, -1]].any():
            raise SystemExit("the contact reaches the edge of its window")
        return float((self.sinks(pressure_pa) - heights_m)[touching].mean())

    def capped(
        self, heights_m: FloatArray, deep_m: float, most_pa: float, start: FloatArray
    ) -> FloatArray:
        """Pressure of a body pressed to a depth where none exceeds its hardness.

        min ½ p·Sp − p·(h + d) with 0 ≤ p ≤ H, by projected gradients (Barzilai and Borwein).
        """
        pressure = start
        slope = self.sinks(pressure) - heights_m - deep_m
        step = MODULUS_PA * SIDE / self.window_m
        for _ in range(STEPS):
            new = np.clip(pressure - step * slope, 0.0, most_pa)
            moved = new - pressure
            if np.abs(moved).max() < SETTLED * most_pa:
                return new
            turned = self.sinks(moved)
            step = float((moved * moved).sum() / (moved * turned).sum())
            pressure, slope = new, slope + turned
        raise SystemExit(f"no equilibrium at {deep_m} m")


def elastic(space: HalfSpace, heights_m: FloatArray) -> Iterator[tuple[str, float, float]]:
    """Branch, force and indentation of a body that stays elastic."""
    for force_n in FORCES_N:
        yield "loading", float(force_n), space.approach(heights_m, float(force_n))


def hard(
    space: HalfSpace, heights_m: FloatArray, most_pa: float
) -> Iterator[tuple[str, float, float]]:
    """The same where the pressure has a limit: loaded, then unloaded."""
    pressure = np.zeros_like(heights_m)
    force_n = 0.0
    guess_m = space.approach(heights_m, TOP_N)
    shares = np.concatenate((np.geomspace(0.05, 0.3, 8), np.linspace(0.35, 1.6, 32)))
    for deep_m in shares * guess_m:
        pressure = space.capped(heights_m, float(deep_m), most_pa, pressure)
        force_n = space.force(pressure)
        yield "loading", force_n, float(deep_m)
        if force_n > TOP_N:
            break
    sunk_m = space.sinks(pressure) - deep_m
    pressed = np.where(pressure > (1.0 - 1e-6) * most_pa, sunk_m, heights_m)
    for each in [*FORCES_N[force_n > FORCES_N], force_n]:
        yield "unloading", float(each), space.approach(pressed, float(each))


def curve(body: Body) -> Iterator[tuple[str, float, float]]:
    """Branch, force in N and indentation in m from the first touch."""
    across = (np.arange(SIDE) - SIDE / 2) * body.window_m / SIDE
    heights_m = -body.depth(*np.meshgrid(across, across, indexing="ij"))
    if body.roughness:
        heights_m = heights_m + body.roughness.heights(SIDE)
    heights_m = heights_m - heights_m.max()
    space = HalfSpace(body.window_m)
    if body.hardness_pa is None:
        return elastic(space, heights_m)
    return hard(space, heights_m, body.hardness_pa)


def main() -> None:
    """Write all curves."""
    tm.set_log_level(tm.LogLevel.error)
    with FILE.open("w", newline="") as file:
        written = csv.writer(file, lineterminator="\n")
        written.writerow(["body", "branch", "force_n", "deformation_m"])
        for body in BODIES:
            for branch, force_n, deep_m in curve(body):
                written.writerow([body.name, branch, f"{force_n:.6g}", f"{deep_m:.6g}"])
            file.flush()
            print(body.name)


if __name__ == "__main__":
    main()
