"""The contact parameters that the page of a run shows as text."""

from __future__ import annotations

from stepload.errors import BadInputError
from stepload.estimators.hunt_crossley import HuntCrossley
from stepload.results.analyse import Evaluation
from stepload.results.snippets import SIMULATORS, snippet, spring_of


def snippet_texts(run: Evaluation) -> list[tuple[str, str]]:
    """(name, content) for every simulator, at half of the highest force; none without a law."""
    if run.identification is None:
        return []
    damping = run.extras.hunt_crossley if run.extras is not None else None
    d = damping.dissipation_s_per_m if isinstance(damping, HuntCrossley) else None
    try:
        spring = spring_of(run.identification, dissipation_s_per_m=d, simulated=run.dry_run)
    except BadInputError:
        return []
    return [(f"contact parameters: {name}", snippet(spring, name)) for name in SIMULATORS]
