"""What contact theory and the plan together say of a payload: its law and its elastic limit."""

from __future__ import annotations

from dataclasses import dataclass

from stepload.contact.elastic import law_for
from stepload.contact.limit import ElasticLimit, elastic_limit, no_limit_reason
from stepload.contact.power_law import ContactLaw
from stepload.errors import RefusedError
from stepload.plan.model import Payload


@dataclass(frozen=True, slots=True)
class Theory:
    """The smooth law of a payload and the force that a run must stay below.

    `yield_onset` is theory's elastic limit (13), None where theory has none; `elastic_limit_n` is
    the F_c that counts, `limit_equation` says where it comes from.
    """

    law: ContactLaw
    yield_onset: ElasticLimit | None
    elastic_limit_n: float
    limit_equation: str


def theory_of(payload: Payload) -> Theory:
    """Law and elastic limit of a payload; a declared limit counts where it is lower than theory's.

    Raises:
        RefusedError: neither theory nor the plan gives a limit.
        DomainError: a number outside the domain of contact theory.
    """
    law = law_for(payload.geometry, payload.material, payload.plate)
    onset = elastic_limit(payload.geometry, payload.material, payload.plate)
    declared_n = payload.declared_force_limit_n
    if declared_n is not None and (onset is None or declared_n < onset.force_n):
        return Theory(law, onset, declared_n, "declared in the plan")
    if onset is None:
        raise RefusedError(
            no_limit_reason(payload.geometry, payload.material, payload.plate),
            hint="declare the payload's force_limit in the plan",
        )
    return Theory(law, onset, onset.force_n, f"{onset.equation} elastic-plastic sphere")
