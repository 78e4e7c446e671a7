"""State of a run in words and numbers, for every display of its progress."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from stepload.live.words import where
from stepload.record.rows import Phase

if TYPE_CHECKING:
    from stepload.engine.tick import Engine
    from stepload.envelope.envelope import Envelope
    from stepload.envelope.remaining import Remaining


class Seen(NamedTuple):
    """State of a run at one time; `left_s` and `share` (of its time) stop while it is paused."""

    elapsed_s: float
    left_s: float
    share: float
    force: str
    where: str


class Watcher:
    """Observes a run; estimates the time that is left."""

    def __init__(self) -> None:
        from stepload.envelope.remaining import Remaining  # computed now, and not in a tick

        self._make = Remaining
        self._remaining: Remaining | None = None

    def look(self, engine: Engine, envelope: Envelope) -> Seen | None:
        """The present state; None before the first tick."""
        row = engine.row
        if row is None:
            return None
        if self._remaining is None:
            self._remaining = self._make(envelope.stages, envelope.plan.procedure)
        left_s = self._remaining.at(row)
        active_s = self._remaining.active_s
        force = f"{row.force_n:7.2f} N of {row.limit_n:.4g} N"
        return Seen(active_s, left_s, self._remaining.share, force, where(row) + _asked(engine))


def _asked(engine: Engine) -> str:
    """A request of the operator that is not carried out yet."""
    operator = engine.operator
    if operator.stop_level and not engine.safing:
        return "; ends after this step" if operator.stop_level == 1 else "; stops now"
    if not operator.paused:
        return ""
    return "; p goes on" if engine.course.phase == Phase.PAUSED else "; pauses after this step"
