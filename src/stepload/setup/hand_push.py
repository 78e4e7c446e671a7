"""Axis and sign of the force channels by a guided push by hand.

The push stands in for the plate: it pushes the tool away from where the plate is, so what a channel
reads during it is what it reads when the arm presses.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from stepload.errors import RefusedError
from stepload.identification.fit import FloatArray
from stepload.setup.bench import ARM, FORCE, SECOND, Bench, Setup, listen, say_hazards
from stepload.setup.state import Found
from stepload.setup.yaml_keys import Value
from stepload.units import parse_quantity, percent

REST_S, LOOK_S = 2.0, 0.1
PUSHES = 2
PUSH_LOOKS, RISING_LOOKS, QUIET_LOOKS = 13, 3, 5
"""Looks in a row that make a push, those of them in which it rises, and that make a release."""
PATIENCE_S = 30.0
LET_GO = 0.25
"""Share of the push below which a channel counts as let go."""
AXES = ("fx", "fy", "fz")
LEAST_PUSH_N = 10.0
NOISE_TIMES = 12.0
"""Least size of a push in standard deviations of the noise of a channel."""
CROSS_TALK = 0.5
"""Share of the largest component that another may have: a push within 27 degrees of the axis."""
AGREE = 0.3
"""Share by which two channels may differ in what they read of one push."""
UNITS = {ARM: "the arm's own force", FORCE: "the force sensor", SECOND: "the second force sensor"}


def push(setup: Setup) -> Found:
    """Two pushes by hand, as the plate will push, prove axis and sign of every channel."""
    values = setup.state.values
    say_hazards(setup, "before a hand comes near the arm:")
    setup.answers.consent("may_push")
    with setup.opened(values, True) as bench:
        names = [*bench.sensors, *([ARM] if values["second_force.source"].text == "arm" else [])]
        setup.tell("hands off: the channels are read at rest")
        received = listen(bench, REST_S)
        rest = {name: _at_rest(name, received.forces_n(name)) for name in names}
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
            f"{percent(one.cross_talk, 2)} across"
        )
        setup.tell(notes[-1])
        how = f"{setup.measured}: {PUSHES} pushes by hand of {one.push_n:.1f} N"
        if one.axis:
            values[f"{name}.axis"] = Value(f'"{one.axis}"', how)
        values["wiring_checked_on"] = Value(setup.today.isoformat(), how)
    return Found(values, notes)


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
    received = listen(bench, LOOK_S)
    return {
        name: received.forces_n(name).mean(axis=0) - channel.mean_n
        for name, channel in rest.items()
    }


def _size(change: FloatArray) -> float:
    return float(np.abs(change).max())


@dataclass(frozen=True, slots=True)
class Channel:
    """A force channel at rest in free air: mean and standard deviation of each component in N.

    Shape (3,) for a sensor, (1,) for a channel that says of itself what pressing is (an arm's own).
    """

    name: str
    mean_n: FloatArray
    sigma_n: FloatArray

    @property
    def least_push_n(self) -> float:
        """The smallest push in N that the channel detects reliably."""
        return max(LEAST_PUSH_N, NOISE_TIMES * float(self.sigma_n.max()))


class Proven(NamedTuple):
    """What the pushes proved: `axis` as a rig file has it ("" for a channel of one component).

    `cross_talk` is the largest other component over that along the axis; `push_n` the mean push.
    """

    axis: str
    cross_talk: float
    push_n: float


def judged(channel: Channel, pushes: Sequence[FloatArray]) -> Proven:
    """Axis and sign of a channel from the change of its mean reading in N during each push.

    Raises:
        RefusedError: it did not feel a push, felt it along no one axis, or felt two differently.
    """
    found = [_axis_of(channel, push) for push in pushes]
    if len(set(found)) > 1:
        raise RefusedError(
            f"{channel.name}: the pushes disagree: {' and '.join(found)}",
            hint="push the same way each time, along the tool, and let go in between",
        )
    index = AXES.index(found[0][1:]) if channel.mean_n.size > 1 else 0
    along = np.array([abs(push[index]) for push in pushes])
    across = [np.abs(np.delete(push, index)).max(initial=0.0) for push in pushes]
    axis = found[0] if channel.mean_n.size > 1 else ""
    return Proven(axis, float(np.max(across / along)), float(along.mean()))


def _axis_of(channel: Channel, push: FloatArray) -> str:
    size = np.abs(push)
    order = np.argsort(size)[::-1]
    best = int(order[0])
    if size[best] < channel.least_push_n:
        raise RefusedError(
            f"{channel.name}: it read {size[best]:.1f} N of a push, at least"
            f" {channel.least_push_n:.1f} N are needed to tell it from its noise",
            hint="push harder; if the other channel felt it: this one is dead, wrongly scaled, or"
            " not between the hand and the arm",
        )
    if channel.mean_n.size == 1:
        if push[0] < 0.0:
            raise RefusedError(
                f"{channel.name}: it read {push[0]:+.1f} N, as if pulled towards the plate, while"
                " the tool was pushed away from it",
                hint="either the push went the wrong way or the approach direction or the sign of"
                " this channel is wrong: settle which one before you change any of them",
            )
        return "+"
    second = int(order[1])
    if size[second] > CROSS_TALK * size[best]:
        raise RefusedError(
            f"{channel.name}: the push shows on two components, {AXES[best]} {push[best]:+.1f} N"
            f" and {AXES[second]} {push[second]:+.1f} N: which one is the axis is not clear",
            hint="push along the tool; a sensor that is mounted askew cannot be used",
        )
    return ("-" if push[best] < 0.0 else "+") + AXES[best]


def agreed(one: tuple[str, float], other: tuple[str, float], tolerance_n: float) -> None:
    """Check that two channels read the same push alike, each given by name and mean push in N.

    Raises:
        RefusedError: they differ by more than `tolerance_n` and 30 % of the larger.
    """
    off_n = abs(one[1] - other[1])
    limit_n = tolerance_n + AGREE * max(one[1], other[1])
    if off_n > limit_n:
        raise RefusedError(
            f"{one[0]} read {one[1]:.1f} N and {other[0]} {other[1]:.1f} N of the same push, which"
            f" differ by more than {limit_n:.1f} N",
            hint="one of them has a wrong gain, unit or divider: compare each with a known weight",
        )
