"""Every figure of speed in one table, beside its goal, a baseline and the table that was kept.

    python bench/table.py              measure, compare with bench/table.json (a quarter of an hour)
    python bench/table.py --keep       keep it there and in docs/speed.md
    python bench/table.py --quick      one small repeat of each: whether the table can be made

Each figure is measured several times; its median and its smallest and largest value are shown. What
became worse than the kept table by more than the larger of both spreads is marked, where that was
made on such a machine as this. Exit code 1 where something is. Linear algebra has one thread.
"""

from __future__ import annotations

import os

os.environ["OPENBLAS_NUM_THREADS"] = "1"
os.environ["OMP_NUM_THREADS"] = "1"
os.environ["MKL_NUM_THREADS"] = "1"

import argparse
import json
import platform
import sys
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from _figures import QUICK, STEPS, WHOLE
from _row import HEAD, Row, as_json, became_worse, cells, markdown, plain, row_of

HERE = Path(__file__).parent
KEPT = HERE / "table.json"
PAGE = HERE.parent / "docs" / "speed.md"
BEGIN, END = "<!-- made by `make bench`: begin -->", "<!-- made by `make bench`: end -->"
BUSY = 0.5
"""Above this load of the machine its figures are not worth keeping."""


def machine() -> dict[str, Any]:
    """What the figures depend on, without any name of the machine."""
    about = Path("/proc/cpuinfo")
    lines = about.read_text().splitlines() if about.exists() else []
    models = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return {
        "cpu": models[0] if models else platform.machine(),
        "cores": os.cpu_count(),
        "python": platform.python_version(),
    }


def measured(quick: bool, only: str) -> list[Row]:
    """All rows; what is being measured is told on standard error."""
    found: list[Row] = []
    for step in STEPS:
        if not only or step.__name__ == only:
            print(f"… {step.__name__}", file=sys.stderr, flush=True)
            found += step(QUICK if quick else WHOLE)
    return found


def lines_of(rows: list[Row], kept: dict[str, Any] | None) -> list[tuple[str, ...]]:
    """Head and rows in words, beside the kept table."""
    before = {} if kept is None else {each["name"]: row_of(each) for each in kept["rows"]}
    same = kept is not None and kept["machine"] == machine()
    return [HEAD, *(cells(row, before.get(row.name), comparable=same) for row in rows)]


def losses(rows: list[Row], kept: dict[str, Any] | None) -> list[str]:
    """Names of the figures that became worse on such a machine as this."""
    if kept is None or kept["machine"] != machine():
        return []
    before = {each["name"]: row_of(each) for each in kept["rows"]}
    return [row.name for row in rows if row.name in before and became_worse(row, before[row.name])]


def page_with(page: str, made: dict[str, Any], lines: list[tuple[str, ...]]) -> str:
    """The page with its generated part made anew."""
    start, rest = page.split(BEGIN)
    _, end = rest.split(END)
    where = made["machine"]
    told = f"{made['date']}, {where['cpu']}, {where['cores']} cores, Python {where['python']}."
    table = markdown([line[:-1] for line in lines])
    return f"{start}{BEGIN}\n\n{told}\n\n{table}\n\n{END}{end}"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--keep", action="store_true", help="in bench/table.json, docs/speed.md")
    parser.add_argument("--quick", action="store_true", help="one small repeat; not to be kept")
    parser.add_argument("--only", default="", choices=[step.__name__ for step in STEPS])
    wanted = parser.parse_args()
    if wanted.keep and (wanted.quick or wanted.only):
        parser.error("--keep takes the whole table: not with --quick or --only")
    load = os.getloadavg()[0]
    if wanted.keep and load > BUSY:
        parser.error(f"the load of the machine is {load:.2f}, above {BUSY}: not kept")
    kept = json.loads(KEPT.read_text()) if KEPT.exists() and not wanted.quick else None
    rows = measured(wanted.quick, wanted.only)
    lines, worse = lines_of(rows, kept), losses(rows, kept)
    print(plain(lines))
    print(f"load of the machine at the start {load:.2f}")
    if kept is not None and kept["machine"] != machine():
        print("the kept table was made on another machine: nothing is compared with it")
    if wanted.keep:
        date = datetime.now(UTC).date().isoformat()
        made = {"date": date, "machine": machine(), "rows": [as_json(row) for row in rows]}
        KEPT.write_text(json.dumps(made, indent=1, ensure_ascii=False) + "\n")
        PAGE.write_text(page_with(PAGE.read_text(), made, lines))
    if worse:
        print(f"worse than the kept table by more than the spread: {', '.join(worse)}")
    return int(bool(worse))


if __name__ == "__main__":
    sys.exit(main())
