"""The constraint of the tip, in the frame of the plate: what the mechanics of six axes use."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from stepload.errors import DomainError
from stepload.rig.mount import Matrix3, Mount
from stepload.rig.world import WorldSpec
from stepload_drivers.sim.frames import FloatArray, rows, turning

_SAME = 1e-6
_STEEPEST_RAD = math.radians(45.0)


@dataclass(frozen=True, slots=True)
class TipConstraint:
    """Axes 1 and 2 of the plate's frame lie in the plate, 3 points into it.

    Attributes:
        to_press: from the plate's frame to the pressing frame; its rows are the axes of the
            pressing frame, seen from the plate.
        stiffness, mass: of the tip, N/m and kg.
        damping_s: damping over stiffness; every spring is damped by the same time.
        stiffest: largest eigenvalue of the stiffness; lightest, heaviest: of the mass.
        apart: the tip's offset u and speed w against the drive after a step in free air, as
            (u, w) → (A u + B w, C u + D w).
    """

    to_press: Matrix3
    stiffness: Matrix3
    mass: Matrix3
    damping_s: float
    stiffest: float
    lightest: float
    heaviest: float
    apart: tuple[Matrix3, Matrix3, Matrix3, Matrix3]


def tip_constraint(spec: WorldSpec, mount: Mount, step_s: float) -> TipConstraint:
    """`mount` in the frame of the plate.

    Raises:
        DomainError: numbers that no rig has.
    """
    tilt_x, tilt_y = mount.plate_tilt_rad
    if not math.hypot(tilt_x, tilt_y) < _STEEPEST_RAD:
        raise DomainError("mount: a plate tilted by 45 degrees or more cannot be pressed")
    if not 0.0 <= mount.friction_kinetic <= mount.friction_static < 10.0:
        raise DomainError("mount: needs 0 <= kinetic friction <= static friction < 10")
    if not 0.0 < mount.tangential_ratio <= 2.0:
        raise DomainError("mount: tangential_ratio is above 0 and at most 2")
    if spec.lateral or spec.cross_talk:
        raise DomainError("mount: lateral forces and cross-talk follow from it; leave them at 0")
    compliance = _definite("compliance_m_per_n", mount.compliance_m_per_n)
    if not math.isclose(compliance[2, 2] * spec.system_stiffness_n_per_m, 1.0, rel_tol=_SAME):
        raise DomainError(
            f"mount: 1/C_33 = {1.0 / compliance[2, 2]:.6g} N/m is not the system stiffness of "
            f"{spec.system_stiffness_n_per_m:.6g} N/m"
        )
    mass = np.eye(3) * spec.effective_mass_kg
    if mount.mass_kg is not None:
        mass = _definite("mass_kg", mount.mass_kg)
    to_press = turning((tilt_x, tilt_y, 0.0))
    stiffness = to_press.T @ np.linalg.inv(compliance) @ to_press
    mass = to_press.T @ mass @ to_press
    damping_s = spec.system_damping_n_s_per_m / spec.system_stiffness_n_per_m
    masses = np.linalg.eigvalsh(mass)
    return TipConstraint(
        to_press=rows(to_press),
        stiffness=rows(stiffness),
        mass=rows(mass),
        damping_s=damping_s,
        stiffest=float(np.linalg.eigvalsh(stiffness)[-1]),
        lightest=float(masses[0]),
        heaviest=float(masses[-1]),
        apart=_apart(stiffness, mass, damping_s, step_s),
    )


def _definite(name: str, given: Matrix3) -> FloatArray:
    raw = np.array(given, dtype=float)
    if raw.shape != (3, 3) or not np.all(np.isfinite(raw)):
        raise DomainError(f"mount: {name} is no 3 x 3 matrix of finite numbers")
    if not np.allclose(raw, raw.T, rtol=_SAME, atol=_SAME * float(np.max(np.abs(raw)))):
        raise DomainError(f"mount: {name} is not symmetric")
    matrix: FloatArray = 0.5 * (raw + raw.T)
    if np.linalg.eigvalsh(matrix)[0] <= 0.0:
        raise DomainError(f"mount: {name} is not positive definite: it would give energy away")
    return matrix


def _apart(
    stiffness: FloatArray, mass: FloatArray, damping_s: float, step_s: float
) -> tuple[Matrix3, Matrix3, Matrix3, Matrix3]:
    """The exact step in free air: damping in proportion to stiffness leaves three lone modes."""
    root = np.linalg.cholesky(mass)
    inverse = np.linalg.inv(root)
    squares, vectors = np.linalg.eigh(inverse @ stiffness @ inverse.T)
    modes = inverse.T @ vectors
    back = vectors.T @ root.T
    parts = np.array([_mode(square, damping_s * square, step_s) for square in squares])
    a, b, c, d = (rows(modes @ np.diag(part) @ back) for part in parts.T)
    return a, b, c, d


def _mode(omega2: float, twice_gamma: float, dt: float) -> tuple[float, float, float, float]:
    """ü + 2 γ u̇ + ω² u = 0 over `dt`: (u, w) → (p11 u + p12 w, p21 u + p22 w)."""
    gamma = 0.5 * twice_gamma
    root = complex(omega2 - gamma * gamma) ** 0.5
    fast, slow = np.exp((-gamma + 1j * root) * dt), np.exp((-gamma - 1j * root) * dt)
    c = float((0.5 * (fast + slow)).real)
    s = float(((fast - slow) / (2j * root)).real) if root else math.exp(-gamma * dt) * dt
    return c + gamma * s, s, -omega2 * s, c - gamma * s
