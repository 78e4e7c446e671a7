"""What contact theory and the plan together say of a payload: its law and its elastic limit."""

from __future__ import annotations

from dataclasses import dataclass, replace

from stepload.contact.elastic import law_for
from stepload.contact.limit import ElasticLimit, elastic_limit, no_limit_reason
from stepload.contact.limit_uncertainty import (
    DoubtedLimit,
    Source,
    doubted_limits,
    limit_in,
    probability_below,
)
from stepload.contact.material_range import is_range, softest, stiffest
from stepload.contact.materials import Material, Sphere
from stepload.contact.power_law import ContactLaw
from stepload.errors import RefusedError
from stepload.feasibility.predicted import MESHED, meshed_law, meshed_onset
from stepload.plan.model import Payload

DECLARED = "declared in the plan"
ENDS = (softest, stiffest)


@dataclass(frozen=True, slots=True)
class CountedLimit:
    """The lower end of F_c that may be counted on: the start of the ladder of forces.

    `lower_n` lies `coverage` standard uncertainties u(ln F_c) = `sigma_ln` below `value_n`;
    `probability` is that of the true limit being lower still, `sources` what the uncertainty comes
    from. A limit that a person declared without an uncertainty is taken as it stands.
    """

    value_n: float
    equation: str
    sigma_ln: float
    coverage: float
    lower_n: float
    probability: float
    sources: tuple[Source, ...]


@dataclass(frozen=True, slots=True)
class Theory:
    """The smooth law of a payload and the force that a run must stay below.

    `law` is the believed one. Where a material is known as a range only, it may be anything between
    `softest` and `stiffest`, and bounds hold for both; elsewhere the three are one.

    `yield_onset` is theory's elastic limit (13), None where theory has none; `elastic_limit_n` is
    the F_c that counts, `limit_equation` says where it comes from. `counted` is the lowest force
    that remains when uncertainties are subtracted.
    """

    law: ContactLaw
    yield_onset: ElasticLimit | None
    elastic_limit_n: float
    limit_equation: str
    counted: CountedLimit
    softest: ContactLaw
    stiffest: ContactLaw

    @property
    def is_range(self) -> bool:
        """Whether only the ends of the law are known."""
        return self.softest != self.stiffest


def theory_of(payload: Payload, to_n: float | None = None) -> Theory:
    """Law and elastic limit of a payload; a declared limit counts where it is lower than theory's.

    The law of a shape that has no power law is fitted up to `to_n`, or to the limit where that is
    lower. A curve that finite elements have computed for these forces (`stepload predict`) rules;
    the force at which von Mises reaches Y in any of them counts where it is lowest.

    The two are compared twice: as they stand, and less their uncertainties. Where a body is known
    as a range only a limit must be declared; that of the other body counts too, where it is known.

    Raises:
        RefusedError: neither theory nor the plan gives a limit.
        DomainError: a number outside the domain of contact theory.
    """
    geometry, material, plate = bodies = (payload.geometry, payload.material, payload.plate)
    onset = elastic_limit(*bodies)
    declared_n = payload.declared_force_limit_n
    known: list[tuple[float, CountedLimit]] = []
    if onset is not None:
        known.append((onset.force_n, _of_theory(payload, onset.equation)))
    if declared_n is not None:
        known.append((declared_n, _declared(payload, declared_n)))
        if is_range(material) or is_range(plate):
            found = (_of_body(payload, *pair) for pair in ((material, plate), (plate, material)))
            known += [(limit.value_n, limit) for limit in found if limit is not None]
    if not known:
        raise RefusedError(
            no_limit_reason(*bodies), hint="declare the payload's force_limit in the plan"
        )
    if (meshed_n := meshed_onset(payload)) is not None:
        known.append((meshed_n, _of_mesh(payload, meshed_n)))
    limit_n, limit = min(known, key=lambda each: each[0])
    counted = min((counted for _, counted in known), key=lambda counted: counted.lower_n)
    to_n = limit_n if to_n is None else min(to_n, limit_n)
    if (meshed := meshed_law(payload, to_n)) is not None:
        laws = [meshed] * 3
    else:
        ends = [(end(material), end(plate)) for end in ENDS]
        laws = [law_for(geometry, *pair, to_n) for pair in [(material, plate), *ends]]
    return Theory(laws[0], onset, limit_n, limit.equation, counted, *laws[1:])


def _of_body(payload: Payload, body: Material, other: Material) -> CountedLimit | None:
    """The limit of a body that is known, against the stiffest that the other one may be.

    F_c goes with 1/E_eq², so at every other stiffness it is higher.
    """
    if is_range(body) or (found := limit_in(body, stiffest(other), payload.geometry)) is None:
        return None
    told = f"(13) of {body.name}, pressed by the stiffest that {other.name} may be"
    return _counted(found, told, payload.limit_coverage)


def _of_theory(payload: Payload, equation: str) -> CountedLimit:
    """Of the bodies that may yield first, the one with the lowest end rules."""
    limits = doubted_limits(payload.geometry, payload.material, payload.plate)
    coverage = payload.limit_coverage
    ruling = min(limits, key=lambda limit: limit.lower_end(coverage))
    counted = _counted(ruling, f"{equation} elastic-plastic sphere", coverage)
    return replace(counted, probability=probability_below(limits, counted.lower_n))


def _of_mesh(payload: Payload, meshed_n: float) -> CountedLimit:
    """As uncertain as (13), of a sphere where the shape has no tip radius."""
    bodies = payload.material, payload.plate
    like = limit_in(*bodies, payload.geometry) or limit_in(*bodies, Sphere(1.0))
    sources = like.sources if like else ()
    return _counted(DoubtedLimit(meshed_n, sources), MESHED, payload.limit_coverage)


def _declared(payload: Payload, declared_n: float) -> CountedLimit:
    sigma_n = payload.declared_force_limit_sigma_n or 0.0
    relative = sigma_n / declared_n if sigma_n else 0.0
    stated = (Source("declared force_limit", relative, relative, assumed=False),) if sigma_n else ()
    return _counted(DoubtedLimit(declared_n, stated), DECLARED, payload.limit_coverage)


def _counted(limit: DoubtedLimit, equation: str, coverage: float) -> CountedLimit:
    lower_n = limit.lower_end(coverage)
    return CountedLimit(
        limit.force_n,
        equation,
        limit.sigma_ln,
        coverage,
        lower_n,
        limit.probability_below(lower_n),
        limit.sources,
    )


def chance_of_yield(payload: Payload, theory: Theory, force_n: float) -> float | None:
    """The probability that the true F_c is below a force in N; None where F_c is taken as stated.

    Each limit that is known has a log-normal distribution; of several the largest chance counts.
    """
    chances = []
    if theory.yield_onset is not None:
        bodies = payload.geometry, payload.material, payload.plate
        chances.append(probability_below(doubted_limits(*bodies), force_n))
    counted = theory.counted
    if counted.sigma_ln > 0.0 and counted.equation in (DECLARED, MESHED):
        stated = DoubtedLimit(counted.value_n, counted.sources)
        chances.append(stated.probability_below(force_n))
    elif counted.equation == DECLARED:
        return None
    return max(chances, default=None)
