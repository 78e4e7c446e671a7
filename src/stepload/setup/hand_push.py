"""Axis and sign of the force channels by a guided push by hand."""

from __future__ import annotations

import numpy as np

from stepload.errors import RefusedError
from stepload.estimators.fit import FloatArray
from stepload.setup.context import Setup, say_hazards
from stepload.setup.devices import second_is_arm
from stepload.setup.judge import Channel, Proven, agreed, judged
from stepload.setup.open_devices import FORCE, SECOND, Bench, Heard, listen
from stepload.setup.state import Found
from stepload.setup.yaml_keys import Value
from stepload.units import parse_quantity

ARM = "second_force"
REST_S, LOOK_S = 2.0, 0.1
PUSHES = 2
PUSH_LOOKS, RISING_LOOKS, QUIET_LOOKS = 13, 3, 5
"""Looks in a row that make a push, those of them in which it rises, and that make a release."""
PATIENCE_S = 30.0
LET_GO = 0.25
"""Share of the push below which a channel counts as let go."""
UNITS = {ARM: "the arm's own force", FORCE: "the force sensor", SECOND: "the second force sensor"}


def push(setup: Setup) -> Found:
    """Two pushes by hand, as the plate will push, prove axis and sign of every channel."""
    values = setup.state.values
    say_hazards(setup, "before a hand comes near the arm:")
    setup.answers.consent("may_push")
    with setup.opened(values, True) as bench:
        names = [*bench.sensors, *([ARM] if second_is_arm(values) else [])]
        setup.tell("hands off: the channels are read at rest")
        heard = listen(bench, REST_S)
        rest = {name: _at_rest(name, _forces(heard, name)) for name in names}
        least_n = max(channel.least_push_n for channel in rest.values())
        found: dict[str, list[FloatArray]] = {name: [] for name in names}
        for number in range(1, PUSHES + 1):
            setup.tell(
                f"push {number} of {PUSHES}: push the tool AWAY from where the plate is, as the"
                f" plate will push it, with about {1.5 * least_n:.0f} N, and hold"
            )
            for name, change in _one_push(setup, bench, rest).items():
                found[name].append(change)
    proven = {name: judged(rest[name], found[name]) for name in names}
    others = [name for name in names if name != FORCE]
    for name in others:
        tolerance = values.get("second_force.tolerance", Value("0 N", "")).text
        agreed((UNITS[FORCE], proven[FORCE].push_n), (UNITS[name], proven[name].push_n),
               parse_quantity(tolerance, "N"))  # fmt: skip
    return _as_found(setup, proven)


def _as_found(setup: Setup, proven: dict[str, Proven]) -> Found:
    values, notes = {}, []
    for name, one in proven.items():
        along = f"along {one.axis}" if one.axis else "the right way round"
        notes.append(
            f"{UNITS[name]} felt {PUSHES} pushes of {one.push_n:.1f} N {along}, "
            f"{one.cross_talk:.0%} across"
        )
        setup.tell(notes[-1])
        how = f"{setup.measured}: {PUSHES} pushes by hand of {one.push_n:.1f} N"
        if one.axis:
            values[f"{name}.axis"] = Value(f'"{one.axis}"', how)
        values["wiring_checked_on"] = Value(setup.today.isoformat(), how)
    return Found(values, notes)


def _forces(heard: Heard, name: str) -> FloatArray:
    return heard.arm_force_n() if name == ARM else heard.forces_n(name)


def _at_rest(name: str, forces_n: FloatArray) -> Channel:
    sigma_n = forces_n.std(axis=0)
    if not float(sigma_n.max()) > 0.0:
        raise RefusedError(
            f"{UNITS[name]}: every reading at rest is the same",
            hint="a live channel has noise: this one is frozen, or not connected to its gauge",
        )
    return Channel(UNITS[name], forces_n.mean(axis=0), sigma_n)


def _one_push(setup: Setup, bench: Bench, rest: dict[str, Channel]) -> dict[str, FloatArray]:
    """The mean change of every channel while the tool was held pushed; returns after letting go."""
    clock = bench.clock
    end_s = clock.now_s() + PATIENCE_S
    looks: list[dict[str, FloatArray]] = []
    while len(looks) < PUSH_LOOKS:
        changes = _look(bench, rest)
        pushed = any(_size(changes[name]) >= rest[name].least_push_n for name in rest)
        looks = [*looks, changes] if pushed else []
        if len(looks) < PUSH_LOOKS and clock.now_s() > end_s:
            raise RefusedError(
                f"no push was seen on any channel within {PATIENCE_S:g} s",
                hint="push harder; if you did: no channel measures what acts on the tool",
            )
    means = {name: np.mean([look[name] for look in looks[RISING_LOOKS:]], axis=0) for name in rest}
    setup.tell("felt; let go")
    quiet, end_s = 0, clock.now_s() + PATIENCE_S
    while quiet < QUIET_LOOKS:
        changes = _look(bench, rest)
        gone = all(
            _size(changes[name])
            < max(LET_GO * _size(means[name]), 0.5 * channel.least_push_n)
            for name, channel in rest.items()
        )  # fmt: skip
        quiet = quiet + 1 if gone else 0
        if clock.now_s() > end_s:
            raise RefusedError(
                f"a channel has not come back to its rest within {PATIENCE_S:g} s",
                hint="let go of the tool; a sensor that does not come back is not sound",
            )
    return means


def _look(bench: Bench, rest: dict[str, Channel]) -> dict[str, FloatArray]:
    heard = listen(bench, LOOK_S)
    return {
        name: _forces(heard, name).mean(axis=0) - channel.mean_n for name, channel in rest.items()
    }


def _size(change: FloatArray) -> float:
    return float(np.abs(change).max())
