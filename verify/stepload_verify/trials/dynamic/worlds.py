"""What the simulated rig really is: as its plan declares, or wrong in one way or two."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from stepload_verify.trials.dynamic.plans import (
    Draft,
    Rng,
    metres,
    newtons,
    percent,
    with_table,
    without_table,
)
from stepload_verify.trials.honest.laws import FloatArray
from stepload_verify.trials.honest.rig import between


@dataclass(frozen=True, slots=True)
class World:
    """A way to spoil a draft, and what the draft must be; `spoil` adds to the story.

    Attributes:
        spoil: makes the plan and its story.
        sphere, arm: whether it needs n = 1.5, and travel measured by the arm.
        unseen: what is wrong leaves no trace in a record.
    """

    spoil: Callable[[Draft, Rng], tuple[Draft, str]]
    sphere: bool = False
    arm: bool = False
    unseen: bool = False

    def fits(self, draft: Draft) -> bool:
        """Whether this world can be pressed by that plan."""
        return (draft.sphere or not self.sphere) and not (draft.gauge and self.arm)


def _sign(rng: Rng) -> float:
    return float(rng.choice([-1.0, 1.0]))


def _as_declared(draft: Draft, rng: Rng) -> tuple[Draft, str]:
    return draft, ""


def _rough_silent(draft: Draft, rng: Rng) -> tuple[Draft, str]:
    sigma = between(0.02, 0.12, rng) * draft.depth_m
    modulus = float(draft.text["payload"]["material"]["youngs_modulus"].split()[0])
    silent = draft.changed("payload", roughness=None)
    rough = silent.simulated(
        roughness=metres(sigma), micro_hardness=f"{modulus * between(0.05, 0.3, rng):.6g} Pa"
    )
    return rough, f"sigma {sigma:.3g} m"


def _plastic(draft: Draft, rng: Rng) -> tuple[Draft, str]:
    over = between(1.0, 5.0, rng)
    return draft.simulated(yield_force=newtons(draft.top_n / over)), f"peak {over:.2f} F_c"


def _creep(draft: Draft, rng: Rng, most: float = 0.35) -> tuple[Draft, str]:
    share, time_s = between(0.005, most, rng), between(0.3, 10.0, rng)
    decades = int(rng.integers(0, 3))
    changed = draft.simulated(
        creep=percent(share), creep_time=f"{time_s:.4g} s", creep_decades=decades
    )
    return changed, f"creep {share:.3f}, {time_s:.2f} s, {decades} decades"


def _hysteresis(draft: Draft, rng: Rng) -> tuple[Draft, str]:
    share = rng.uniform(0.03, 0.15)
    return draft.simulated(hysteresis=percent(share)), f"loss {share:.3f}"


def _seating(draft: Draft, rng: Rng) -> tuple[Draft, str]:
    share, at = between(0.01, 0.1, rng), rng.uniform(0.05, 0.98)
    changed = draft.simulated(
        seating=metres(share * draft.depth_m), seating_force=newtons(at * draft.top_n)
    )
    return changed, f"{share:.3f} of the depth until {at:.2f}"


def _slip(draft: Draft, rng: Rng) -> tuple[Draft, str]:
    share = between(0.003, 0.05, rng)
    return draft.simulated(slip=metres(share * draft.depth_m)), f"{share:.3f} of the depth"


def _drift(draft: Draft, rng: Rng, most: float = 0.3) -> tuple[Draft, str]:
    share = between(0.003, most, rng) * _sign(rng)
    rate = share * draft.depth_m / draft.cycle_s
    return draft.simulated(drift=f"{rate:.6g} m/s"), f"{share:+.3f} of the depth a cycle"


def _zero_drift(draft: Draft, rng: Rng) -> tuple[Draft, str]:
    share = between(0.002, 0.01, rng) * _sign(rng)
    rate = share * draft.top_n / draft.cycle_s
    return draft.simulated(force_drift=f"{rate:.6g} N/s"), f"{share:+.4f} of the top a cycle"


def _pad(draft: Draft, rng: Rng) -> tuple[Draft, str]:
    depth_m, at = between(0.1, 0.6, rng) * draft.depth_m, rng.uniform(0.08, 0.85)
    changed = draft.simulated(
        pad_depth=metres(depth_m), pad_stiffness=f"{at * draft.top_n / depth_m:.6g} N/m"
    )
    return changed, f"pad {depth_m / draft.depth_m:.2f} of the depth, full at {at:.2f}"


def _stop(draft: Draft, rng: Rng) -> tuple[Draft, str]:
    at, ratio = rng.uniform(0.2, 0.9), between(0.5, 6.0, rng)
    stiffness = ratio * draft.top_n / draft.depth_m
    changed = draft.simulated(
        stop_depth=metres(at * draft.depth_m), stop_stiffness=f"{stiffness:.6g} N/m"
    )
    return changed, f"stop at {at:.2f}, ratio {ratio:.2f}"


def _adhesion(draft: Draft, rng: Rng) -> tuple[Draft, str]:
    touch_n = float(draft.text["procedure"]["touch_force"].split()[0])
    pull_n = min(between(0.01, 0.2, rng) * draft.top_n, 0.8 * touch_n)
    smooth = draft.text["payload"].get("roughness") == "0 m" and draft.sphere
    law = {"adhesion_law": "jkr", "law": "smooth"} if smooth and rng.uniform() < 0.5 else {}
    changed = draft.simulated(adhesion=newtons(pull_n), **law)
    return changed, f"{'jkr' if law else 'dmt'}, pull-off {pull_n / draft.top_n:.3f}"


def _soft(draft: Draft, rng: Rng, table: bool) -> tuple[Draft, str]:
    size, reach_n = between(0.05, 0.5, rng), between(0.05, 0.4, rng) * draft.top_n
    declared = draft.declared_n_per_m

    def extra_m(force_n: FloatArray) -> FloatArray:
        return np.asarray(size * reach_n / declared * (1.0 - np.exp(-force_n / reach_n)))

    soft = draft.simulated(softness=percent(size), softness_force=newtons(reach_n))
    soft = with_table(soft, rng, extra_m) if table else without_table(soft)
    return soft, f"softer by {size:.2f} below {reach_n / draft.top_n:.2f} of the top"


def _soft_path(draft: Draft, rng: Rng) -> tuple[Draft, str]:
    return _soft(draft, rng, False)


def _soft_path_table(draft: Draft, rng: Rng) -> tuple[Draft, str]:
    return _soft(draft, rng, True)


def _wrong_stiffness(draft: Draft, rng: Rng) -> tuple[Draft, str]:
    off = rng.uniform(0.04, 0.1) * _sign(rng)
    return without_table(draft.simulated(stiffness_factor=1.0 + off)), f"K_s {off:+.3f}"


def _lateral(draft: Draft, rng: Rng) -> tuple[Draft, str]:
    share, coupling = rng.uniform(0.0, 0.3), rng.uniform(0.05, 0.6) * _sign(rng)
    changed = draft.simulated(lateral=percent(share), lateral_coupling=percent(coupling))
    return changed, f"share {share:.3f}, coupling {coupling:+.2f}"


def _cross_talk(draft: Draft, rng: Rng) -> tuple[Draft, str]:
    share, talk = rng.uniform(0.02, 0.3), rng.uniform(0.01, 0.08) * _sign(rng)
    changed = draft.simulated(
        lateral=percent(share), lateral_coupling="0 %", cross_talk=percent(talk)
    )
    return changed, f"share {share:.3f}, cross-talk {talk:+.3f}: gain {share * talk:+.4f}"


def _bent_sensor(draft: Draft, rng: Rng) -> tuple[Draft, str]:
    size = between(0.005, 0.02, rng) * _sign(rng)
    cubic = bool(rng.integers(2))
    name, power = ("sensor_cubic", 2) if cubic else ("sensor_quadratic", 1)
    # The simulated error is stated at full scale; here it is a share of the top force at the top.
    bend = float(np.clip(size * (1000.0 / draft.top_n) ** power, -0.1, 0.1))
    return draft.simulated(**{name: percent(bend)}), f"{name} {size:+.4f} of the top"


def _late(draft: Draft, rng: Rng) -> tuple[Draft, str]:
    delay_s, lag_s = between(0.001, 0.02, rng), between(0.002, 0.04, rng)
    rig = draft.text["rig"]
    late = draft.changed("rig", force={**rig["force"], "delay": f"{delay_s:.4g} s"})
    late = late.changed("rig", arm={**rig["arm"], "lag": f"{lag_s:.4g} s"})
    return late, f"sensor {1e3 * delay_s:.1f} ms, servo {1e3 * lag_s:.1f} ms"


def _noisy(draft: Draft, rng: Rng) -> tuple[Draft, str]:
    share = between(0.003, 0.02, rng)
    noise_n = share * draft.top_n
    noisy = draft.changed("rig", force={**draft.text["rig"]["force"], "noise": newtons(noise_n)})
    touch_n = float(draft.text["procedure"]["touch_force"].split()[0])
    noisy = noisy.changed("procedure", touch_force=newtons(max(touch_n, 6.5 * noise_n)))
    return noisy, f"noise {share:.4f} of the top"


def _two_at_once(draft: Draft, rng: Rng) -> tuple[Draft, str]:
    ways = [
        lambda d: _creep(d, rng, 0.06), lambda d: _drift(d, rng, 0.05),
        lambda d: _seating(d, rng), lambda d: _hysteresis(d, rng),
    ]  # fmt: skip
    stories = []
    for i in rng.choice(len(ways), size=2, replace=False).tolist():
        draft, story = ways[i](draft)
        stories.append(story)
    return draft, " and ".join(stories)


IDEAL = {"as-declared": World(_as_declared)}
SPOILED = {
    "rough-silent": World(_rough_silent, sphere=True),
    "plastic": World(_plastic, sphere=True),
    "creep": World(_creep),
    "hysteresis": World(_hysteresis),
    "seating": World(_seating),
    "slip": World(_slip, arm=True),
    "drift": World(_drift),
    "zero-drift": World(_zero_drift),
    "pad": World(_pad),
    "stop": World(_stop),
    "adhesion": World(_adhesion),
    "soft-path": World(_soft_path, arm=True, unseen=True),
    "soft-path-table": World(_soft_path_table, arm=True),
    "wrong-stiffness": World(_wrong_stiffness, arm=True, unseen=True),
    "lateral": World(_lateral),
    "cross-talk": World(_cross_talk, unseen=True),
    "bent-sensor": World(_bent_sensor, unseen=True),
    "late": World(_late),
    "noisy": World(_noisy),
    "two-at-once": World(_two_at_once),
}
ALL = {**IDEAL, **SPOILED}
