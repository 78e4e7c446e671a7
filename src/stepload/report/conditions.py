"""Conditions of an identification: from a plan, from a record, and as the caller states them."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from numbers import Real
from pathlib import Path
from typing import Any

from stepload.errors import BadInputError
from stepload.feasibility.conditions import conditions_of
from stepload.feasibility.preflight import Preflight
from stepload.feasibility.theory import theory_of
from stepload.identification.conditions import BRANCHES, Conditions, Sources
from stepload.identification.deflection import ASSUMED_RELATIVE, table_problem
from stepload.identification.lateral_coupling import Across
from stepload.plan.load import load_payload
from stepload.report.press_data import PressData
from stepload.units import percent

FILE = "conditions.json"


def planned(preflight: Preflight) -> Conditions:
    """The conditions of a plan, with the rig's figures; see `measured`."""
    return conditions_of(preflight.plan, preflight.theory)


def measured(conditions: Conditions, data: PressData) -> Conditions:
    """The same with noise and lag as measured in the run."""
    sources = conditions.sources
    lag_sigma_s = data.lag.sigma_s
    if data.lag_corrected_s == 0.0:
        lag_sigma_s = min(lag_sigma_s, sources.lag_sigma_s)
    return replace(
        conditions,
        sources=replace(
            sources,
            force_noise_n=max(data.noise_n, sources.force_noise_n),
            position_noise_m=math.hypot(
                sources.position_noise_m, conditions.across.noise_m(data.lateral_noise_n)
            ),
            lag_sigma_s=lag_sigma_s,
        ),
    )


def to_bytes(conditions: Conditions) -> bytes:
    """As a file of the record."""
    return json.dumps(asdict(conditions)).encode()


def from_attachments(attachments: Mapping[str, bytes]) -> Conditions:
    """Read a record's conditions; the content of the record is not trusted.

    Raises:
        BadInputError: they are missing, invalid, or of another version.
    """
    from pydantic import TypeAdapter, ValidationError

    raw = attachments.get(FILE)
    if raw is None:
        raise BadInputError(f"the record has no {FILE}", hint="it was not made by stepload run")
    try:
        found = TypeAdapter(Conditions).validate_json(raw, strict=True)
        _check(found)
        # No default is safe: a key that another version did not write shows here.
        if json.loads(json.dumps(asdict(found), allow_nan=False)) != json.loads(raw):
            raise ValueError("another version has written it")
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        name = ".".join(map(str, first["loc"]))
        raise BadInputError(f"{FILE} in the record is damaged: {name}: {first['msg']}") from None
    except (ValueError, RecursionError) as error:
        raise BadInputError(f"{FILE} in the record is damaged: {error}") from None
    return found


_POSITIVE = {
    "secant_force_n", "p", "s", "t", "system_stiffness_n_per_m", "elastic_limit_n",
    "position_resolution_m", "smooth_length_n", "theory_k", "theory_n", "modulus_pa",
    "plate_pa", "rough_length_sigma",
}  # fmt: skip


def _check(found: Conditions) -> None:
    """Refuse values that no run can have."""
    if found.branch not in BRANCHES:
        raise ValueError(f"branch {found.branch!r}")
    if found.kind not in ("payload", "system"):
        raise ValueError(f"kind {found.kind!r}")
    across = found.across
    if min(*across.sigma_m_per_n, across.reach, 1.0 - abs(across.correlation)) < 0.0:
        raise ValueError("an uncertainty of the lateral force is impossible")
    for sources in filter(None, (found.sources, found.arm_sources)):
        rows = sources.deflection_force_n, sources.deflection_m, sources.deflection_sigma_m
        if any(rows) and (problem := table_problem(*rows)):
            raise ValueError(problem)
        for name, value in {**asdict(found), **asdict(sources)}.items():
            least = math.ulp(0.0) if name in _POSITIVE else 0.0
            least = -math.inf if name == "temperature_c" else least
            if isinstance(value, float) and not least <= value < math.inf:
                raise ValueError(f"{name} is {value!r}")


_SOURCES = (
    "system_stiffness_n_per_m",
    "system_stiffness_sigma_n_per_m",
    "smooth_error_m",
    "smooth_length_n",
    "force_noise_n",
    "position_noise_m",
    "travel_drift_m_per_s",
    "nonlinearity",
)
_CONDITIONS = ("secant_force_n", "elastic_limit_n", "theory_k", "theory_n", "branch")


@dataclass(frozen=True, slots=True)
class Stated:
    """Statements of the caller in addition to the file; None: that of the file, or a default.

    Attributes:
        system_stiffness_n_per_m, system_stiffness_sigma_n_per_m: K_s and its uncertainty.
        smooth_error_m, smooth_length_n: size of the smooth deformation error, and the force over
            which it changes.
        force_noise_n, position_noise_m: standard deviation of the noise of a sample.
        travel_drift_m_per_s: standard uncertainty of the drift of the travel.
        nonlinearity: largest departure of the force reading from a line, a share of the peak.
        secant_force_n: where the secant is taken.
        elastic_limit_n: F_c.
        theory_k, theory_n: the payload's law (3).
        tared: the force is zero in free air, though the file does not show it.
        branch: whose chord is the result: loading, unloading or reloading.

    Raises:
        BadInputError: a value is no number, not finite or negative, or zero where that makes no
            sense.
    """

    system_stiffness_n_per_m: float | None = None
    system_stiffness_sigma_n_per_m: float | None = None
    smooth_error_m: float | None = None
    smooth_length_n: float | None = None
    force_noise_n: float | None = None
    position_noise_m: float | None = None
    travel_drift_m_per_s: float | None = None
    nonlinearity: float | None = None
    secant_force_n: float | None = None
    elastic_limit_n: float | None = None
    theory_k: float | None = None
    theory_n: float | None = None
    tared: bool = False
    branch: str | None = None

    def __post_init__(self) -> None:
        if self.branch is not None and self.branch not in BRANCHES:
            raise BadInputError(f"branch {self.branch!r}", hint=f"one of {', '.join(BRANCHES)}")
        for name in (*_SOURCES, *_CONDITIONS[:-1]):
            value = getattr(self, name)
            if value is None:
                continue
            if isinstance(value, bool) or not isinstance(value, Real):
                raise BadInputError(f"{name} is {value!r}, not a number")
            if not math.isfinite(value) or value < 0.0 or (value == 0.0 and name in _CONDITIONS):
                least = "greater than 0" if name in _CONDITIONS else "0 or more"
                raise BadInputError(
                    f"{name} is {value}; it must be finite and {least}",
                    hint="leave out what is not known",
                )

    @property
    def an_error(self) -> bool:
        """Whether the accuracy of the channels is stated."""
        stated = (self.smooth_error_m, self.force_noise_n, self.position_noise_m)
        return any(value is not None for value in stated)

    def applied(self, conditions: Conditions) -> Conditions:
        """The conditions, with the statements of the caller in place of those of the file.

        A stated K_s replaces the table; without a stated uncertainty one is assumed.
        """
        given = {name: value for name, value in asdict(self).items() if value is not None}
        changed = replace(
            conditions.sources, **{name: given[name] for name in _SOURCES if name in given}
        )
        others: dict[str, Any] = {name: given[name] for name in _CONDITIONS if name in given}
        if given.keys() & set(_SOURCES[:2]):
            others["across"] = Across(at_share=(0.0, 0.0), stated=True)
            changed = _without_table(changed)
        return replace(conditions, sources=changed, **others)


def with_payload(path: Path, stated: Stated) -> Stated:
    """The stated with the law of a payload, and with its F_c unless one is stated.

    Raises:
        BadInputError: the file is no payload.
        RefusedError: it has no elastic limit.
    """
    theory = theory_of(load_payload(path))
    limit_n = stated.elastic_limit_n or theory.elastic_limit_n
    if theory.is_range:
        return replace(stated, elastic_limit_n=limit_n)
    return replace(stated, theory_k=theory.law.k, theory_n=theory.law.n, elastic_limit_n=limit_n)


def _without_table(sources: Sources) -> Sources:
    """A K_s stated by hand replaces the table; without a stated uncertainty one is assumed."""
    stiffness, sigma = sources.system_stiffness_n_per_m, sources.system_stiffness_sigma_n_per_m
    if stiffness is None:
        return sources
    note = ""
    if not sigma > 0.0:
        sigma, note = (
            ASSUMED_RELATIVE * stiffness,
            f"no σ of K_s stated: {percent(ASSUMED_RELATIVE, 2)}",
        )
    return replace(
        sources, system_stiffness_sigma_n_per_m=sigma, system_stiffness_note=note,
        deflection_force_n=(), deflection_m=(), deflection_sigma_m=(),
    )  # fmt: skip
