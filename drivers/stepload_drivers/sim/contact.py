"""From the truth of a payload and its load path to the law that the mechanics press."""

from __future__ import annotations

import math
from typing import NamedTuple

from stepload.errors import DomainError
from stepload.rig.world import PayloadTruth, WorldSpec
from stepload_drivers.sim.laws import (
    ContactLaw,
    Elastic,
    HardStop,
    Hysteresis,
    Plastic,
    elastic_plastic_curve,
    power_curve,
    rough_curve,
    rough_layer,
)
from stepload_drivers.sim.layers import (
    Creep,
    Dmt,
    Give,
    Jkr,
    RoughLayer,
    Seating,
    Series,
    pad_give,
    soft_path_give,
)

_LAWS = ("smooth", "rough", "elastic_plastic", "rough_elastic_plastic")


class Contact(NamedTuple):
    """The law between the drive's spring and the plate, and its time-dependent part."""

    law: ContactLaw
    creep: Creep | None


def contact_of(spec: WorldSpec) -> Contact:
    """The contact of a rig, with what is soft in its load path.

    Raises:
        DomainError: numbers that no payload has, or an unknown law.
    """
    contact = _contact(spec.payload)
    give = path_give(spec)
    return contact if give is None else contact._replace(law=Series(contact.law, give))


def path_give(spec: WorldSpec) -> Give | None:
    """What the load path gives way beyond F/K_s; None where K_s is constant.

    Raises:
        DomainError: a softness that no load path has.
    """
    if spec.softness == 0.0:
        return None
    if not (0.0 < spec.softness < math.inf and 0.0 < spec.softness_force_n < math.inf):
        raise DomainError(f"softness {spec.softness:g} over {spec.softness_force_n:g} N")
    return soft_path_give(spec.system_stiffness_n_per_m, spec.softness, spec.softness_force_n)


def _contact(payload: PayloadTruth) -> Contact:
    if not (0.0 < payload.k < math.inf and 1.0 <= payload.n <= 10.0):
        raise DomainError(f"payload law K = {payload.k:g} N/m^n, n = {payload.n:g} is impossible")
    law = _body(payload)
    if payload.hysteresis:
        law = Hysteresis(law, payload.hysteresis, payload.n)
    if payload.adhesion_n:
        law = _sticking(law, payload)
    if payload.hard_stop_m < math.inf:
        if not 0.0 < payload.stop_stiffness_n_per_m < math.inf:
            raise DomainError(f"a stop of {payload.stop_stiffness_n_per_m:g} N/m is impossible")
        law = HardStop(law, payload.hard_stop_m, payload.stop_stiffness_n_per_m)
    if payload.pad_depth_m:
        if not (payload.pad_depth_m > 0.0 and 0.0 < payload.pad_stiffness_n_per_m < math.inf):
            raise DomainError("a pad needs a depth and a stiffness above 0")
        law = Series(law, pad_give(payload.pad_stiffness_n_per_m, payload.pad_depth_m))
    if payload.seating_m:
        if not (payload.seating_m > 0.0 and payload.seating_depth_m > 0.0):
            raise DomainError("seating needs a travel and a depth above 0")
        law = Seating(law, payload.seating_m, payload.seating_depth_m)
    if payload.creep:
        if not (0.0 < payload.creep < math.inf and 0.0 < payload.creep_time_s < math.inf):
            raise DomainError("creep needs a share and a time constant above 0")
        law = Creep(law, payload.creep, payload.creep_time_s, payload.creep_decades)
        return Contact(law, law)
    return Contact(law, None)


def _body(payload: PayloadTruth) -> ContactLaw:
    """The payload itself, pressed slowly for the first time and released."""
    if payload.law not in _LAWS:
        raise DomainError(f"unknown law {payload.law!r}; one of {', '.join(_LAWS)}")
    rough = payload.law.startswith("rough")
    if rough and not (payload.roughness_m > 0.0 and payload.kappa > 0.0):
        raise DomainError(f"law {payload.law!r} needs a positive roughness and kappa")
    if payload.law == "smooth":
        return Elastic(power_curve(payload.k, payload.n))
    if payload.law == "rough":
        return Elastic(rough_curve(payload.k, payload.n, payload.roughness_m, payload.kappa))
    limit_n = payload.elastic_limit_n
    if payload.n != 1.5 or not 0.0 < limit_n < math.inf:
        raise DomainError(f"law {payload.law!r} needs n = 1.5 and a finite elastic limit")
    body = Plastic(elastic_plastic_curve(payload.k, limit_n), payload.k, limit_n)
    return RoughLayer(body, rough_layer(payload.roughness_m, payload.kappa)) if rough else body


def _sticking(law: ContactLaw, payload: PayloadTruth) -> ContactLaw:
    if not 0.0 < payload.adhesion_n < math.inf:
        raise DomainError(f"a pull-off force of {payload.adhesion_n:g} N is impossible")
    if payload.adhesion_law == "dmt":
        return Dmt(law, payload.adhesion_n)
    if payload.adhesion_law != "jkr":
        raise DomainError(f"unknown law of adhesion {payload.adhesion_law!r}; dmt or jkr")
    if payload.n != 1.5 or payload.law.startswith("rough"):
        raise DomainError("jkr adhesion needs a smooth contact with n = 1.5")
    return Jkr(law, payload.k, payload.adhesion_n)
