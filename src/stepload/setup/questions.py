"""Every question of a set-up: what it is called as a flag, and its default.

An answer is a text. `--host 192.168.1.10` and a prompt give the same one; the flag is the name with
`-` for `_`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

from stepload.declaration.quantities import Name
from stepload.declaration.uncertain import Modulus
from stepload.errors import BadInputError, guess
from stepload.plan.reader import checked
from stepload.units import QuantityError, parse_quantity

Check = Callable[[str], None]
YES, NO = ("yes", "true", "y"), ("no", "false", "n")


@dataclass(frozen=True, slots=True)
class Question:
    """One question; `default` None: it must be answered, "" stands for nothing.

    `check` raises BadInputError for an answer that cannot be used; `consent`: an answer is good for
    the step it is given in and is never kept, and `--yes` gives it; `fact`: a "no" to it is a
    finding about the rig, not a wish to wait; `many`: words KEY=VALUE.
    """

    name: str
    text: str
    default: str | None = None
    check: Check | None = None
    consent: bool = False
    fact: bool = False
    many: bool = False

    @property
    def flag(self) -> str:
        """As it is written on a command line."""
        return "--" + self.name.replace("_", "-")


def _one_of(choices: tuple[str, ...], text: str) -> None:
    if text not in choices:
        raise BadInputError(f"{text!r} is no answer", hint=f"one of {', '.join(choices)}")


def _yes_or_no(text: str) -> None:
    _one_of((*YES, *NO), text.lower())


def _quantity(unit: str, words: tuple[str, ...], text: str) -> None:
    if text in words:
        return
    try:
        value = parse_quantity(text, unit)
    except QuantityError as error:
        raise BadInputError(error.message, hint=error.hint) from None
    if not value > 0.0:
        raise BadInputError(f"{text!r} is not above 0", hint=f"a quantity in {unit}")


def _as_in_a_plan(hint: Any, text: str) -> None:
    checked(hint, text)


_name = partial(_as_in_a_plan, Name)
_modulus = partial(_as_in_a_plan, Modulus)


def _either(*choices: str) -> Check:
    return partial(_one_of, choices)


def _in(unit: str, *words: str) -> Check:
    return partial(_quantity, unit, words)


_consent = partial(Question, check=_yes_or_no, consent=True)

_ALL = (
    # the arm
    Question("name", "What the rig is called in records", check=_name),
    Question("arm", "Driver of the arm (`stepload drivers` lists them)", "ur"),
    Question("host", "Address of the arm's controller, a number rather than a name"),
    Question("approach", "Approach direction in the arm's base frame", "[0, 0, -1]"),
    Question("arm_options", "Further options of the arm's driver", "", many=True),
    Question("arm_profile", "Profile of the arm; auto: by the model it tells", "auto"),
    _consent(
        "limits_set",
        "Are the robot's own safety limits (force, speed, planes) set and tested on its pendant?",
        fact=True,
    ),
    # the sensor
    Question("sensor", "Data sheet of the force sensor: a name, or a file with its keys"),
    Question("sensor_options", "Options of its driver: where it is reached", "", many=True),
    Question("second", "What checks the force sensor: arm, sensor or none", "arm",
             _either("arm", "sensor", "none")),
    Question("second_sensor", "Data sheet of the second sensor: a name, or a file"),
    Question("second_options", "Options of its driver", "", many=True),
    Question("keys", "Further keys of the rig, arm.max_age=20 ms and the like", "", many=True),
    # push
    _consent(
        "may_push",
        "Free air around the tool, and you stand where the arm cannot pinch you: may it begin?",
    ),
    # the start
    _consent("led_to_start", "Is the arm led to its start pose, and in remote control?"),
    _consent("towards_plate", "Does this direction lead from the tool to the plate?", fact=True),
    Question("hazards_read_by", "Who has read the hazards and answers for the rig: a name",
             check=_name),
    _consent("may_back", "May the arm move back from the plate and to its start again?"),
    Question("back", "How far it backs away", "5 mm", _in("m")),
    # the first payload
    Question("plan", "Where the plan of the first payload is written", "first-payload.yaml"),
    Question("payload", "Payload file, if there is one; empty: questions follow", ""),
    Question("payload_name", "What the payload is called", "first payload", _name),
    Question("shape", "Its shape", None,
             _either("sphere", "cone_tip", "pyramid_tip", "flat_punch")),
    Question("radius", "Radius of sphere, tip or face", None, _in("m")),
    Question("material", "Its material: a shipped one, a file with its keys, or unknown"),
    Question("modulus", "Young's modulus, or a range: rubber 1 MPa to 20 MPa, plastics 0.5 GPa to"
             " 5 GPa, metals 40 GPa to 250 GPa; of an unknown material only", None,
             _modulus),
    Question("plate", "Material of the plate", "aluminium 6061"),
    Question("force_limit", "Elastic limit F_c where you know it; none: by theory", "none",
             _in("N", "none")),
    Question("top_force", "Largest force; most: what preflight allows, less a tenth", "most",
             _in("N", "most")),
    Question("surface_distance", "Travel from the start pose to the payload", None, _in("m")),
    Question("surface_uncertainty", "How wrong that may be", "1 mm", _in("m")),
    Question("procedure", "Further keys of the procedure, hold=3 s and the like", "", many=True),
    # proofs
    _consent("may_move", "May the arm move up to 2 mm away from the plate and back, as `doctor`"
             " does?"),
    _consent("may_touch", "May the arm approach and touch the payload at the lowest force?"),
)  # fmt: skip

QUESTIONS = {question.name: question for question in _ALL}
"""All questions by name."""

OF_THE_PLAN = (
    "payload", "payload_name", "shape", "radius", "material", "modulus", "plate",
    "force_limit", "top_force",
    "surface_distance", "surface_uncertainty", "procedure",
)  # fmt: skip
"""Those that `stepload init` asks."""

REQUESTED_IN: dict[str, tuple[str, ...]] = {
    "arm": ("name", "arm", "host", "approach", "arm_options", "arm_profile", "limits_set"),
    "sensor": ("sensor", "sensor_options", "second", "second_sensor", "second_options", "keys"),
    "push": ("may_push",),
    "start": ("led_to_start", "towards_plate"),
    "way": ("hazards_read_by", "may_back", "back"),
    "plan": ("plan", *OF_THE_PLAN),
    "doctor": ("may_move",),
    "touch": ("may_touch",),
}
"""The questions of each step of a set-up."""

STEP_OF = {name: step for step, names in REQUESTED_IN.items() for name in names}
"""The step that asks a question."""

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
"""Answers to begin a plan with, by the name of their question; the rest is asked for.

Tips are blunt enough for a usual rig. No preset states an elastic limit: a person answers for it.
"""


def preset(name: str) -> dict[str, str]:
    """The answers of a preset; a person may still change them.

    Raises:
        BadInputError: there is none of that name.
    """
    if name not in PRESETS:
        hint = f"{guess(name, PRESETS)}there are {', '.join(PRESETS)}"
        raise BadInputError(f"{name!r} is no preset", hint=hint)
    return {"payload_name": f"my {name} payload", **PRESETS[name]}
