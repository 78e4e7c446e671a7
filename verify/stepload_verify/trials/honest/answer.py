"""The program's answers for a record, and whether they are true."""

from __future__ import annotations

import math
import traceback
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from stepload.errors import SteploadError
from stepload.identification.chord import chord
from stepload.identification.conditions import Conditions
from stepload.identification.quantity import Quantity, ResultVerdict
from stepload.identification.verdict import judge
from stepload.report.analyse import identify_payload
from stepload.report.press_data import PressData
from stepload.report.run_data import pressed
from stepload_verify.trials.honest.case import Case
from stepload_verify.trials.honest.laws import Law
from stepload_verify.trials.honest.measure import record, true_loading

IDENTIFIED = ResultVerdict.IDENTIFIED.value
QUANTITIES = ("chord", "secant_from_touch", "secant_from_mean_plane", "tangent")


@dataclass(frozen=True, slots=True)
class Answer:
    """One quantity as the program states it; N/m and N. `why` are the reasons of the verdict."""

    value_n_per_m: float
    low_n_per_m: float
    high_n_per_m: float
    from_n: float
    to_n: float
    verdict: str
    why: tuple[str, ...] = ()

    @property
    def half_width(self) -> float:
        """Half the interval over the value."""
        return (self.high_n_per_m - self.low_n_per_m) / (2.0 * self.value_n_per_m)


@dataclass(frozen=True, slots=True)
class Scored:
    """An answer beside the truth; `truth_n_per_m` None where the world has none.

    Where the contact settles faster than it is pressed, `settled_n_per_m` and all values between
    the two count as true as well.
    """

    quantity: str
    answer: Answer
    truth_n_per_m: float | None
    settled_n_per_m: float | None = None

    @property
    def expected(self) -> bool:
        """Whether it is called IDENTIFIED."""
        return self.answer.verdict == IDENTIFIED

    @property
    def true(self) -> bool:
        """Whether the interval holds the truth; False where there is no true value."""
        if self.truth_n_per_m is None:
            return False
        low, high = sorted((self.truth_n_per_m, self.settled_n_per_m or self.truth_n_per_m))
        return self.answer.low_n_per_m <= high and low <= self.answer.high_n_per_m

    @property
    def off(self) -> float:
        """ln(value/truth), of the nearest truth."""
        value = self.answer.value_n_per_m
        if self.truth_n_per_m is None or not value > 0.0:
            return math.nan
        low, high = sorted((self.truth_n_per_m, self.settled_n_per_m or self.truth_n_per_m))
        return math.log(value / min(max(value, low), high))


@dataclass(frozen=True, slots=True)
class Outcome:
    """All answers for one case; none and a `problem` where it was refused or broke."""

    world: str
    seed: int
    ideal: bool
    undetected: bool
    story: str
    family: str
    top_n: float
    scored: tuple[Scored, ...]
    problem: str = ""
    broken: bool = False


Ask = Callable[[PressData, Conditions], Mapping[str, Answer]]


def answer(press: PressData, conditions: Conditions) -> Mapping[str, Answer]:
    """The program's answers by quantity.

    Raises:
        SteploadError: the program refuses the record.
    """
    found = identify_payload(press, conditions)
    return {name: stated(each) for name, each in found.quantities.items()}


def evidence(press: PressData, conditions: Conditions) -> Mapping[str, Answer]:
    """The program's answers without the paper's fits, which take half of the time and alter none.

    Raises:
        SteploadError: the program refuses the record.
    """
    found = judge(pressed(press, conditions))
    return {name: stated(each) for name, each in found.quantities.items()}


def stated(each: Quantity) -> Answer:
    """A quantity of the program as an answer."""
    low, high = each.interval_n_per_m
    return Answer(
        each.value_n_per_m, low, high, each.from_n, each.to_n, each.verdict.value, each.why
    )


def truth(law: Law, quantity: str, answer: Answer) -> float | None:
    """True value of a quantity of a law at the forces of an answer; None where there is none."""
    if quantity == "chord":
        return law.chord(answer.from_n, answer.to_n)
    if quantity == "secant_from_mean_plane":
        return law.secant_from_plane(answer.to_n)
    if quantity == "tangent":
        return law.tangent(answer.to_n)
    return law.secant(answer.to_n)


def _true(case: Case, quantity: str, told: Answer) -> float | None:
    """The truth of a figure; a chord is that of its loading, creep and set included."""
    if quantity == "chord":
        return chord(true_loading(case), told.from_n, told.to_n).n_per_m
    return truth(case.law, quantity, told)


def judged(case: Case, ask: Ask = answer) -> Outcome:
    """Press a case, ask, and hold every answer against the truth."""
    data, conditions = record(case)
    answers: Mapping[str, Answer] = {}
    problem, broken = "", False
    try:
        answers = ask(data, conditions)
    except SteploadError as refusal:
        problem = str(refusal)
    except Exception:
        problem, broken = traceback.format_exc(limit=-3), True
    scored = tuple(
        Scored(
            name,
            answers[name],
            _true(case, name, answers[name]),
            truth(case.settled, name, answers[name]) if case.settled else None,
        )
        for name in QUANTITIES
        if name in answers
    )
    return Outcome(
        case.world, case.seed, case.ideal, case.undetected, case.story, case.rig.family,
        case.rig.top_n, scored, problem, broken,
    )  # fmt: skip
