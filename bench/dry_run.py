"""How much faster than real time a dry run is, and how much memory a long one takes.

python bench/dry_run.py                 the plastic sphere
python bench/dry_run.py --hours 1       the same with so many cycles that it lasts an hour
python bench/dry_run.py --mount --plan procedures/ur5e-silicone-sphere.yaml
                                        another plan, its simulated rig with six axes

"run" is the loop with recording up to the end of safing, "all" the whole command with evaluation
and report. "CPU ×" is the loop's own processor time, which a busy machine does not stretch;
"both ×" counts the process that writes the record, too.
"loop MB" is what the runner grew by in the loop; the other two are the largest resident sizes of
the runner and of the record's writer.
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

PLAN = Path(__file__).parents[1] / "procedures" / "plastic-sphere.yaml"
LEAST_RATIO = 50.0
MOST_MB = 300.0


def _resident_mb() -> float:
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * resource.getpagesize() / 1e6


def _children_s() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def measure(hours: float, path: Path = PLAN, mount: bool = False) -> dict[str, float]:
    """One dry run in this process; `mount` gives its simulated rig six axes."""
    from stepload.feasibility.preflight import preflight_of
    from stepload.plan.load import load_plan
    from stepload.plan.mounting import Mounting
    from stepload.report.conditions import Stated
    from stepload.report.from_file import results_of_file
    from stepload.session import experiment

    plan = load_plan(path)
    if mount:
        simulation = replace(plan.rig.simulation, mount=Mounting())
        plan = replace(plan, rig=replace(plan.rig, simulation=simulation))
    if hours:
        each_s = preflight_of(plan).duration_s
        each_s -= preflight_of(
            replace(plan, procedure=replace(plan.procedure, cycles=1))
        ).duration_s
        cycles = max(1, round(hours * 3600.0 / each_s))
        plan = replace(plan, procedure=replace(plan.procedure, cycles=cycles))
    loop_s = cpu_s = loop_mb = 0.0
    run_loop = experiment.run_loop

    def timed(*args: object, **kwargs: object) -> object:
        nonlocal loop_s, cpu_s, loop_mb
        before_mb = _resident_mb()
        begin_s, begin_cpu_s = time.perf_counter(), time.process_time()
        outcome = run_loop(*args, **kwargs)  # type: ignore[arg-type]
        loop_s, cpu_s = time.perf_counter() - begin_s, time.process_time() - begin_cpu_s
        loop_mb = _resident_mb() - before_mb
        return outcome

    experiment.run_loop = timed  # type: ignore[assignment]
    begin_s, begin_cpu_s, begin_writer_s = time.perf_counter(), time.process_time(), _children_s()
    with tempfile.TemporaryDirectory() as place:
        done = experiment.run_plan(preflight_of(plan), dry_run=True, out=Path(place) / "run")
        command_cpu_s = time.process_time() - begin_cpu_s
        all_s = time.perf_counter() - begin_s
        runner_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
        size = (done.directory / "run.mcap").stat().st_size
        begin_cpu_s = time.process_time()
        results_of_file(done.directory / "run.mcap", Stated())
        identify_cpu_s = time.process_time() - begin_cpu_s
    virtual_s = done.outcome.end_s - done.outcome.start_s
    return {
        "virtual_s": virtual_s,
        "run_s": loop_s,
        "cpu_s": cpu_s,
        "writer_cpu_s": _children_s() - begin_writer_s,
        "command_cpu_s": command_cpu_s,
        "identify_cpu_s": identify_cpu_s,
        "all_s": all_s,
        "loop_mb": loop_mb,
        "record_mb": size / 1e6,
        "runner_mb": runner_mb,
        "writer_mb": resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024.0,
    }


def in_a_process(hours: float, path: Path = PLAN, mount: bool = False) -> dict[str, float]:
    """The same in a process of its own."""
    words = [sys.executable, __file__, "--one", "--hours", str(hours), "--plan", str(path)]
    words += ["--mount"] * mount
    return json.loads(subprocess.run(words, stdout=subprocess.PIPE, check=True).stdout)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--hours", type=float, default=0.0)
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--plan", type=Path, default=PLAN)
    parser.add_argument("--mount", action="store_true")
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--one", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.one:
        print(json.dumps(measure(options.hours, options.plan, options.mount)))
        return 0
    requested = options.hours, options.plan, options.mount
    done = [in_a_process(*requested) for _ in range(1 if options.hours else options.runs)]
    if options.json:
        print(json.dumps(done))
    else:
        names = (
            "virtual s",
            "run ×",
            "CPU ×",
            "both ×",
            "all ×",
            "record MB",
            "loop MB",
            "runner MB",
        )
        print(" ".join(f"{name:>10}" for name in names), " writer MB")
        for one in done:
            virtual_s = one["virtual_s"]
            both_s = one["cpu_s"] + one["writer_cpu_s"]
            spent_s = one["run_s"], one["cpu_s"], both_s, one["all_s"]
            figures = [virtual_s, *(virtual_s / each_s for each_s in spent_s)]
            figures += [one[k] for k in ("record_mb", "loop_mb", "runner_mb", "writer_mb")]
            print(" ".join(f"{figure:10.1f}" for figure in figures))
    best = max(one["virtual_s"] / one["cpu_s"] for one in done)
    return int(best < LEAST_RATIO or max(one["runner_mb"] for one in done) > MOST_MB)


if __name__ == "__main__":
    sys.exit(main())
