"""How a contact is made: bias, intervals and verdicts of a table of rigs; how soon slips are seen.

    python -m stepload_verify.trials.contact_quality [--poses 20] [--seed 1] [--only detection]
        [--rigs UR10e UR5e machine]

Arms of UR10 and UR5 class and a stiff machine press payloads of 3e4, 1e5 and 5e6 N/m that stick
(friction 0.6) or slide (0.1), on a plate tilted by 0 or 3 degrees, with a sensor askew by up to 0
or 2. Bias is the size of the chord's error, median and 90th percentile over the poses. "False" is
a run that says identified while the truth is outside of its 95 % interval.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from stepload.envelope.envelope import envelope_of
from stepload.plan.load import load_plan
from stepload_verify.trials.contact_quality.bias import WAYS, Cell, cells
from stepload_verify.trials.contact_quality.detection import alone, slips_seen, steps_of, told
from stepload_verify.trials.contact_quality.whole import rows
from stepload_verify.trials.coupling.__main__ import SETTINGS, Found

PLAN = Path("procedures/ur5e-silicone-sphere.yaml")
WRENCH_NOISES = ((0.03, 0.001), (0.15, 0.005))
"""Noise (sd) of force in N and torque in N·m: of a good six-axis sensor and of a plain one."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--poses", type=int, default=20)
    parser.add_argument("--runs", type=int, default=300, help="of each kind of slip")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", choices=("bias", "detection", "whole"))
    parser.add_argument("--rigs", nargs="+", default=[setting.arm for setting in SETTINGS])
    parser.add_argument("--plan", type=Path, default=PLAN)
    asked = parser.parse_args()
    if asked.only in (None, "detection"):
        _detection(asked.runs, asked.seed, asked.plan)
    if asked.only in (None, "whole"):
        _whole(asked.plan, asked.seed)
    if asked.only in (None, "bias"):
        _bias(asked.poses, asked.seed, asked.rigs)


def _detection(runs: int, seed: int, plan: Path) -> None:
    print(f"slips, {runs} runs of 10 s each at 500 Hz: seen after (5, 50, 95 %), size told, missed,"
          " false")  # fmt: skip
    for seen in slips_seen(runs, seed):
        when = "nothing to see"
        if seen.latency_s:
            low, middle, high = 1e3 * np.percentile(seen.latency_s, (5, 50, 95))
            when = f"{low:4.1f} {middle:4.1f} {high:4.1f} ms, {np.mean(seen.sizes_n):.2f} N"
        missed = f"missed {seen.missed} of {runs}" if seen.jump_n else ""
        print(f"  {seen.jump_n:3.1f} N, noise {seen.noise_n:4.2f} N: {when:30} {missed} false "
              f"{seen.false}", flush=True)  # fmt: skip
    limits = envelope_of(load_plan(plan)).limits
    assert limits is not None
    limits = alone(limits)
    print(f"rules on the whole wrench, {runs} runs of 4 s each, a period of"
          f" {1e3 * limits.period_s:g} ms, F_lim {limits.force_limit_n:.3g} N: told after (5, 50,"
          " 95 %), missed, ended by another rule or too early")  # fmt: skip
    for noise in WRENCH_NOISES:
        for step in steps_of(limits):
            found = told(limits, step, runs, noise, seed)
            when = "nothing to tell"
            if found.latency_s:
                low, middle, high = 1e3 * np.percentile(found.latency_s, (5, 50, 95))
                when = f"{step.rule} {low:4.0f} {middle:4.0f} {high:4.0f} ms"
            print(f"  {step.name:28} noise {noise[0]:g} N, {noise[1]:g} N m: {when:22} missed"
                  f" {found.missed} false {found.false}", flush=True)  # fmt: skip


def _whole(plan: Path, seed: int) -> None:
    print("whole dry runs: friction, tilt/mounting, verdict, error %, ± %, true, contact, signs")
    with TemporaryDirectory() as out:
        for row in rows(plan, Path(out), seed):
            print(
                f"  {row.friction} {row.tilt_deg:g}/{row.askew_deg:g} {row.told:10} "
                f"{100 * row.error:+5.1f} ±{100 * row.half_width:4.1f} {row.covered!s:5} "
                f"{row.contact}  {', '.join(row.fires)}",
                flush=True,
            )


def _bias(poses: int, seed: int, rigs: Sequence[str]) -> None:
    print("rig, secant, friction, tilt/mounting, reading: |bias| %, ± %, identified and true,"
          " identified and false, marginal or less")  # fmt: skip
    whole: dict[str, list[Found | None]] = {way: [] for way in WAYS}
    for cell in cells(poses, seed, rigs):
        print(_title(cell), flush=True)
        for way in WAYS:
            found = [each[way] for each in cell.results]
            whole[way] += found
            print("   ", _line(way, found), flush=True)
    print("all of them")
    for way in WAYS:
        print("   ", _line(way, whole[way]))


def _title(cell: Cell) -> str:
    setting = cell.setting
    friction = "sticks" if cell.friction > 0.3 else "slides"
    return (f"{setting.arm} {setting.secant_n_per_m:.0e} N/m {friction} "
            f"{cell.tilt_deg:g}/{cell.mounting_deg:g} deg")  # fmt: skip


def _line(way: str, results: list[Found | None]) -> str:
    got = [each for each in results if each is not None]
    if not got:
        return f"{way:18} nothing"
    middle, most = np.percentile([100.0 * abs(each.error) for each in got], (50, 90))
    half = float(np.median([100.0 * each.half_width for each in got]))
    said = [each for each in got if each.identified]
    true = sum(each.covered for each in said)
    covered = sum(each.covered for each in got)
    return (
        f"{way:18} {middle:5.1f}/{most:5.1f} ±{half:5.1f}  true {true:3} false "
        f"{len(said) - true:3} marginal {len(results) - len(said):3}  covered {covered} of"
        f" {len(got)}"
    )


if __name__ == "__main__":
    main()
