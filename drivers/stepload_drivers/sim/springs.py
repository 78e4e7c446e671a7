"""What holds the tip of a rig with six axes: its equation of motion, and how a step solves it.

In the frame of the plate (axis 3 its normal), with mass matrix M, stiffness S = C⁻¹, damping β S
and the load f of the contact:

    M ẍ = S (d − x) + β S (ḋ − ẋ) − f

Vectors and matrices are plain floats: they are computed a thousand times a second.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stepload.errors import DomainError
from stepload.rig.mount import Matrix3, Mount, Vector3
from stepload.rig.world import WorldSpec
from stepload_drivers.sim.friction import Follow

FloatArray = NDArray[np.float64]
Swing = tuple[Vector3, Vector3, Vector3]
"""How far the drive is ahead of the tip, speed of the tip, load of the contact."""
_SAME = 1e-6
_STEEPEST_RAD = math.radians(45.0)


def skew(vector: FloatArray | Vector3) -> FloatArray:
    """[v]×, so that [v]× w = v × w."""
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def turning(rotation_rad: Vector3) -> FloatArray:
    """The matrix of a rotation vector (Rodrigues)."""
    angle = math.hypot(*rotation_rad)
    if angle == 0.0:
        return np.eye(3)
    x, y, z = (part / angle for part in rotation_rad)
    axis = skew((x, y, z))
    turned: FloatArray = np.eye(3) + math.sin(angle) * axis + (1.0 - math.cos(angle)) * axis @ axis
    return turned


def rows(matrix: FloatArray) -> Matrix3:
    """A 3 × 3 array as rows of plain floats."""
    (a, b, c), (d, e, f), (g, h, i) = matrix.tolist()
    return (a, b, c), (d, e, f), (g, h, i)


def times(matrix: Matrix3, vector: Vector3) -> Vector3:
    (a, b, c), (d, e, f), (g, h, i) = matrix
    x, y, z = vector
    return a * x + b * y + c * z, d * x + e * y + f * z, g * x + h * y + i * z


def solved(matrix: Matrix3, vector: Vector3) -> Vector3:
    """x of A x = b, A any matrix that has an inverse (Cramer)."""
    (a11, a12, a13), (a21, a22, a23), (a31, a32, a33) = matrix
    x, y, z = vector
    c11, c21, c31 = a22 * a33 - a23 * a32, a23 * a31 - a21 * a33, a21 * a32 - a22 * a31
    scale = 1.0 / (a11 * c11 + a12 * c21 + a13 * c31)
    return (
        scale * (c11 * x + (a13 * a32 - a12 * a33) * y + (a12 * a23 - a13 * a22) * z),
        scale * (c21 * x + (a11 * a33 - a13 * a31) * y + (a13 * a21 - a11 * a23) * z),
        scale * (c31 * x + (a12 * a31 - a11 * a32) * y + (a11 * a22 - a12 * a21) * z),
    )


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


class Springs:
    """What holds the tip; without state."""

    def __init__(self, held: TipConstraint) -> None:
        self._mass, self._stiffness, self._damping_s = held.mass, held.stiffness, held.damping_s

    def unbalanced_n(self, tip: Swing) -> float:
        """Force that is left on the tip of a standing drive, without damping."""
        (s11, s12, s13), (_, s22, s23), (_, _, s33) = self._stiffness
        (y1, y2, y3), _, (l1, l2, l3) = tip
        r1 = s11 * y1 + s12 * y2 + s13 * y3 - l1
        r2 = s12 * y1 + s22 * y2 + s23 * y3 - l2
        r3 = s13 * y1 + s23 * y2 + s33 * y3 - l3
        return math.sqrt(r1 * r1 + r2 * r2 + r3 * r3)

    def swinging(
        self, tip: Swing, moving: Vector3, nearer: float, follow: Follow
    ) -> tuple[float, float, float]:
        """How far the tip is from going quietly where springs and payload lead it.

        Unbalanced force, speed beside the quiet one, and what of the contact force swings with it.
        """
        (s11, s12, s13), (_, s22, s23), (_, _, s33) = self._stiffness
        k11, k12, k22, k13, k23, kn = follow
        a11, a12, a13 = s11 + k11, s12 + k12, s13 + k13
        a21, a22, a23 = s12 + k12, s22 + k22, s23 + k23
        a31, a32, a33 = s13, s23, s33 + kn
        c11, c21, c31 = a22 * a33 - a23 * a32, a23 * a31 - a21 * a33, a21 * a32 - a22 * a31
        c12, c22, c32 = a13 * a32 - a12 * a33, a11 * a33 - a13 * a31, a12 * a31 - a11 * a32
        c13, c23, c33 = a12 * a23 - a13 * a22, a13 * a21 - a11 * a23, a11 * a22 - a12 * a21
        scale = 1.0 / (a11 * c11 + a12 * c21 + a13 * c31)
        (y1, y2, y3), (v1, v2, v3), (l1, l2, l3) = tip
        g1, g2, g3 = moving
        w1, w2, w3 = v1, v2, v3
        if g1 or g2 or g3 or nearer:
            f1 = s11 * g1 + s12 * g2 + s13 * g3 - k13 * nearer
            f2 = s12 * g1 + s22 * g2 + s23 * g3 - k23 * nearer
            f3 = s13 * g1 + s23 * g2 + s33 * g3 - kn * nearer
            w1 = v1 - scale * (c11 * f1 + c12 * f2 + c13 * f3)
            w2 = v2 - scale * (c21 * f1 + c22 * f2 + c23 * f3)
            w3 = v3 - scale * (c31 * f1 + c32 * f2 + c33 * f3)
        beta = self._damping_s
        h1 = y1 + beta * (g1 - v1 + w1)
        h2 = y2 + beta * (g2 - v2 + w2)
        h3 = y3 + beta * (g3 - v3 + w3)
        r1 = s11 * h1 + s12 * h2 + s13 * h3 - l1
        r2 = s12 * h1 + s22 * h2 + s23 * h3 - l2
        r3 = s13 * h1 + s23 * h2 + s33 * h3 - l3
        u1 = scale * (c11 * r1 + c12 * r2 + c13 * r3)
        u2 = scale * (c21 * r1 + c22 * r2 + c23 * r3)
        u3 = scale * (c31 * r1 + c32 * r2 + c33 * r3)
        b1, b2, b3 = k11 * u1 + k12 * u2 + k13 * u3, k12 * u1 + k22 * u2 + k23 * u3, kn * u3
        z1, z2, z3 = k11 * w1 + k12 * w2 + k13 * w3, k12 * w1 + k22 * w2 + k23 * w3, kn * w3
        slow2 = self._mass[2][2] / (s33 + kn)
        return (
            math.sqrt(r1 * r1 + r2 * r2 + r3 * r3),
            math.sqrt(w1 * w1 + w2 * w2 + w3 * w3),
            math.sqrt(b1 * b1 + b2 * b2 + b3 * b3 + (z1 * z1 + z2 * z2 + z3 * z3) * slow2),
        )

    def moved(
        self,
        tip: Swing,
        moving: Vector3,
        come: float,
        follow: Follow,
        dt: float,
        quiet: bool,
    ) -> tuple[Vector3, Vector3]:
        """Move over a sub-step and speed at its end; the plate has come nearer by `come`."""
        (s11, s12, s13), (_, s22, s23), (_, _, s33) = self._stiffness
        (m11, m12, m13), (_, m22, m23), (_, _, m33) = self._mass
        k11, k12, k22, k13, k23, kn = follow
        (y1, y2, y3), (v1, v2, v3), (l1, l2, l3) = tip
        g1, g2, g3 = moving
        weight = 1.0 if quiet else 2.0  # backward Euler, or the trapezoidal rule
        per = weight / dt
        lead = dt + weight * self._damping_s
        inertia, spring, push = per * per, 1.0 + self._damping_s * per, weight * per
        h1, h2, h3 = (
            weight * y1 + g1 * lead,
            weight * y2 + g2 * lead,
            weight * y3 + g3 * lead,
        )
        f1 = push * (m11 * v1 + m12 * v2 + m13 * v3) + s11 * h1 + s12 * h2 + s13 * h3
        f2 = push * (m12 * v1 + m22 * v2 + m23 * v3) + s12 * h1 + s22 * h2 + s23 * h3
        f3 = push * (m13 * v1 + m23 * v2 + m33 * v3) + s13 * h1 + s23 * h2 + s33 * h3
        a12, a13, a23 = (
            inertia * m12 + spring * s12,
            inertia * m13 + spring * s13,
            inertia * m23 + spring * s23,
        )
        t1, t2, t3 = move = solved(
            (
                (inertia * m11 + spring * s11 + k11, a12 + k12, a13 + k13),
                (a12 + k12, inertia * m22 + spring * s22 + k22, a23 + k23),
                (a13, a23, inertia * m33 + spring * s33 + kn),
            ),
            (
                f1 - weight * l1 - k13 * come,
                f2 - weight * l2 - k23 * come,
                f3 - weight * l3 - kn * come,
            ),
        )
        if quiet:
            return move, (t1 * per, t2 * per, t3 * per)
        return move, (t1 * per - v1, t2 * per - v2, t3 * per - v3)
