"""Content of stepload's own live topic, as JSON Schema."""

from __future__ import annotations

from typing import Any

from stepload.engine.margins import MEANING

LIVE = "/live"


def _number(meaning: str) -> dict[str, Any]:
    return {"type": ["number", "null"], "description": meaning}


LIVE_SCHEMA: dict[str, Any] = {
    "title": "stepload.Live",
    "type": "object",
    "properties": {
        "time_s": _number("the run's clock"),
        "phase": {"type": "string"},
        "may": {"type": "string", "description": "what the phase may command"},
        "cycle": {"type": "integer"},
        "step": {"type": "integer"},
        "level_n": _number("load level aimed at"),
        "force_n": _number("tared contact force, positive when pressing"),
        "largest_force_n": _number("largest since the last message"),
        "second_force_n": _number("the second channel, tared"),
        "predicted_peak_n": _number("as R2 predicts it"),
        "force_limit_n": _number("F_lim"),
        "elastic_limit_n": _number("F_c"),
        "counted_limit_n": _number("what of F_c is counted on"),
        "target_um": _number("commanded travel from the start pose"),
        "deformation_um": _number("of the payload since the first touch"),
        "margins": {
            "type": "object",
            "description": "share of its limit that each rule has used; 1 stops the run",
            "properties": {rule: _number(meaning) for rule, meaning in MEANING.items()},
        },
    },
}
