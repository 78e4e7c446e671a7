"""Answers to begin a plan with: the shapes that theory has a law for, and an unknown material.

Tips are blunt enough for a usual rig; sizes are there to be changed. A preset never states an
elastic limit: a person does who answers for it.
"""

from __future__ import annotations

from difflib import get_close_matches

from stepload.errors import BadInputError

UNKNOWN = "unknown"
"""The material of which a range is stated instead of numbers."""

_ACETAL = {"material": "acetal", "plate": "aluminium 6061", "surface_distance": "5 mm"}

PRESETS: dict[str, dict[str, str]] = {
    "sphere": {"shape": "sphere", "radius": "28.7 mm", **_ACETAL},
    "cone": {"shape": "cone_tip", "radius": "28.7 mm", **_ACETAL},
    "pyramid": {"shape": "pyramid_tip", "radius": "28.7 mm", **_ACETAL},
    "flat-punch": {
        "shape": "flat_punch",
        "radius": "10 mm",
        **_ACETAL,
        "material": "polyurethane, 70 Shore A",
    },
    "unknown": {"material": UNKNOWN, "plate": "aluminium 6061", "surface_distance": "5 mm"},
}
"""The answers of each preset by the name of their question; the rest is asked for."""


def preset(name: str) -> dict[str, str]:
    """The answers of a preset; a person may still change them.

    Raises:
        BadInputError: there is none of that name.
    """
    if name not in PRESETS:
        near = get_close_matches(name, PRESETS, n=1)
        guess = f"did you mean {near[0]}? " if near else ""
        raise BadInputError(f"{name!r} is no preset", hint=f"{guess}there are {', '.join(PRESETS)}")
    return {"payload_name": f"my {name} payload", **PRESETS[name]}
