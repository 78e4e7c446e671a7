"""Changes the product on purpose, one place at a time, and sees whether a test fails.

Each list `tests/mutants/ROOM.toml` holds mutants of one room:

    [[mutant]]
    says = "R2 looks one period ahead only"          # what it breaks; its name
    file = "src/stepload/engine/supervisor.py"
    old = "peak_n += rise * limits.reaction_s"       # occurs exactly once in the file
    new = "peak_n += rise * limits.period_s"
    tests = "tests/unit/engine/test_force_rules.py"     # paths, separated by spaces
    equivalent = "why no test can see it"            # only where none can; it is not run

The tree is copied to a temporary directory for each worker, so that the checkout stays as it is.
The tests must pass on the copy as it stands. Then every mutant is put in, its tests are run, and it
is taken back. A mutant is killed when a test fails. The exit code is 1 where less than 95 % are
killed, 2 where a list or the unchanged tests are wrong.
"""

from __future__ import annotations

import argparse
import json
import os
import queue
import re
import shutil
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
LISTS = Path(__file__).resolve().parent
LEAST_SHARE = 0.95
TIMEOUT_S = 120
NO_TESTS = 5
"""Exit code of pytest where none is selected."""
FORKER = """
import json, os, sys, traceback
import hypothesis.strategies, numpy, pytest, scipy.linalg, scipy.optimize, scipy.special

def run(arguments, place):
    out = os.open(place, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600)
    os.dup2(out, 1)
    os.dup2(out, 2)
    os.close(out)
    try:
        code = int(pytest.main(arguments))
        sys.stdout.flush()
    except BaseException:
        traceback.print_exc()
        code = 3
    os._exit(code)

assert not any(name.startswith("stepload") for name in sys.modules)
for line in sys.stdin:
    arguments, place = json.loads(line)
    child = os.fork()
    if child == 0:
        run(arguments, place)
    print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)
"""
"""Runs pytest again and again, each time in a fork of a process that has loaded what is slow to
load and is no part of the product."""
COPIED = ("src", "drivers", "verify", "tests", "procedures", "docs", "pyproject.toml", "README.md")
IMPORTED = ("src", "drivers", "verify")
KILLED = re.compile(r"^(?:FAILED|ERROR) (.+?)(?: - .*)?$", re.MULTILINE)


@dataclass(frozen=True)
class Mutant:
    """One change of the source; `room` is the name of the list it stands in."""

    room: str
    says: str
    file: str
    old: str
    new: str
    tests: str
    equivalent: str = ""

    def applied(self, source: str) -> str:
        """The source with the change in it.

        Raises:
            ValueError: `old` does not occur exactly once, or the result is no Python.
        """
        count = source.count(self.old)
        if count != 1:
            raise ValueError(f"{self.room}: {self.says!r}: old text occurs {count} times")
        if self.old == self.new:
            raise ValueError(f"{self.room}: {self.says!r}: nothing is changed")
        changed = source.replace(self.old, self.new)
        try:
            compile(changed, self.file, "exec")
        except SyntaxError as error:
            raise ValueError(f"{self.room}: {self.says!r}: {error}") from error
        return changed


@dataclass(frozen=True)
class Result:
    """What became of a mutant; `by` is the first test that failed, "" where none did."""

    mutant: Mutant
    by: str


def mutants_in(lists: Iterable[Path]) -> list[Mutant]:
    """The mutants of these lists, in order.

    Raises:
        ValueError: an entry lacks a key or has one that is not known.
    """
    found = []
    for path in lists:
        for entry in tomllib.loads(path.read_text(encoding="utf-8")).get("mutant", []):
            try:
                found.append(Mutant(room=path.stem, **entry))
            except TypeError as error:
                raise ValueError(f"{path.name}: {entry.get('says', entry)}: {error}") from error
    return found


def problems_of(mutants: Sequence[Mutant], root: Path = ROOT) -> list[str]:
    """What is wrong with these mutants: text not found exactly once, paths that do not exist."""
    problems = []
    for mutant in mutants:
        try:
            mutant.applied((root / mutant.file).read_text(encoding="utf-8"))
        except (OSError, ValueError) as error:
            problems.append(str(error))
        problems += [
            f"{mutant.room}: {mutant.says!r}: there is no {test}"
            for test in mutant.tests.split()
            if not (root / test.partition("::")[0]).exists()
        ]
    names = [(mutant.room, mutant.says) for mutant in mutants]
    problems += [f"{name[0]}: {name[1]!r} stands there twice"
                 for name in sorted(set(names)) if names.count(name) > 1]  # fmt: skip
    return problems


class Copy:
    """A copy of the tree in which one mutant at a time is tried."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self._environment = os.environ | {
            "PYTHONPATH": os.pathsep.join(str(root / part) for part in IMPORTED)
        }
        self._forker: subprocess.Popen[str] | None = None

    def close(self) -> None:
        """End the process that tests are forked from."""
        if self._forker is not None:
            self._forker.communicate()

    def check_imports(self) -> None:
        """See that the copy's code is what is imported.

        Raises:
            RuntimeError: it is not.
        """
        code = "import stepload, stepload_drivers as d, stepload_verify as v\n"
        code += "print(stepload.__file__, d.__file__, v.__file__)"
        done = subprocess.run(
            [sys.executable, "-c", code],
            cwd=self.root, env=self._environment, capture_output=True, text=True, check=False,
        )  # fmt: skip
        places = done.stdout.split()
        if done.returncode or not all(place.startswith(str(self.root)) for place in places):
            raise RuntimeError(f"the copy is not what is imported: {done.stdout}{done.stderr}")

    def failing(self, tests: Sequence[str]) -> str:
        """The first test that fails; "" where all pass.

        Raises:
            RuntimeError: the tests did not run.
        """
        arguments = ["-x", "-q", "-rfE", "--tb=no", "-p", "no:cacheprovider",
                     "-W", "ignore::pytest.PytestAssertRewriteWarning",
                     f"--timeout={TIMEOUT_S}", *tests]  # fmt: skip
        code, output = self._pytest(arguments)
        if code == NO_TESTS:  # all of them are those of `make long` or `make wire`
            code, output = self._pytest([*arguments, "-m", "long"])
        if code == 0:
            return ""
        if code not in (1, 2):
            raise RuntimeError(f"pytest ended with {code}:\n{output}")
        found = KILLED.search(output)
        return found[1] if found else "a test"

    def kills(self, mutant: Mutant) -> Result:
        """Try a mutant, and take it back."""
        file = self.root / mutant.file
        source = file.read_text(encoding="utf-8")
        file.write_text(mutant.applied(source), encoding="utf-8")
        self._forget(file)
        try:
            return Result(mutant, self.failing(mutant.tests.split()))
        finally:
            file.write_text(source, encoding="utf-8")
            self._forget(file)

    def _forget(self, file: Path) -> None:
        """Remove the bytecode of a file: it tells its source by time and size alone."""
        for stale in file.parent.glob(f"__pycache__/{file.stem}.*.pyc"):
            stale.unlink()

    def _pytest(self, arguments: Sequence[str]) -> tuple[int, str]:
        """Exit code and output of a run of pytest in the copy."""
        if self._forker is None:
            self._forker = subprocess.Popen(
                [sys.executable, "-c", FORKER], cwd=self.root, env=self._environment,
                stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
            )  # fmt: skip
        assert self._forker.stdin is not None
        assert self._forker.stdout is not None
        place = self.root / "output"
        print(json.dumps([list(arguments), str(place)]), file=self._forker.stdin, flush=True)
        code = int(self._forker.stdout.readline())
        return code, place.read_text(encoding="utf-8")


def copy_of(source: Path, target: Path) -> Copy:
    """Copy what the tests need of a tree."""
    target.mkdir()
    for name in COPIED:
        if (source / name).is_dir():
            shutil.copytree(source / name, target / name)
        else:
            shutil.copy2(source / name, target / name)
    return Copy(target)


def try_all(mutants: Sequence[Mutant], copies: Sequence[Copy]) -> list[Result]:
    """Try these mutants, each in a copy that is free."""
    free: queue.SimpleQueue[Copy] = queue.SimpleQueue()
    for each in copies:
        free.put(each)

    def one(mutant: Mutant) -> Result:
        copy = free.get()
        try:
            result = copy.kills(mutant)
        finally:
            free.put(copy)
        print(f"{mutant.room}: {mutant.says}: {result.by or 'SURVIVED'}", flush=True)
        return result

    with ThreadPoolExecutor(len(copies)) as pool:
        return list(pool.map(one, mutants))


def table(results: Sequence[Result], equivalent: Sequence[Mutant]) -> str:
    """Killed and total by room, with those that survived and those that no test can see."""
    rooms = dict.fromkeys([r.mutant.room for r in results] + [m.room for m in equivalent])
    lines = [f"{'room':<12} {'killed':>6} {'of':>4} {'equivalent':>10}"]
    for room in rooms:
        of_room = [result for result in results if result.mutant.room == room]
        killed = sum(bool(result.by) for result in of_room)
        same = [mutant for mutant in equivalent if mutant.room == room]
        lines.append(f"{room:<12} {killed:>6} {len(of_room):>4} {len(same):>10}")
        lines += [f"    survived: {r.mutant.says} ({r.mutant.file})" for r in of_room if not r.by]
        lines += [f"    equivalent: {m.says}: {m.equivalent}" for m in same]
    killed = sum(bool(result.by) for result in results)
    share = killed / len(results) if results else 1.0
    lines.append(f"{'all':<12} {killed:>6} {len(results):>4} {len(equivalent):>10}  {share:.1%}")
    return "\n".join(lines)


def main(arguments: Sequence[str] | None = None) -> int:
    """Try the lists named on the command line; the exit code."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("-k", default="", help="only mutants whose room, file or name holds this")
    parser.add_argument("--file", action="append", type=Path, help="a list (again for more)")
    parser.add_argument("--jobs", type=int, default=1, help="copies that are tried side by side")
    given = parser.parse_args(arguments)
    try:
        every = mutants_in(given.file or sorted(LISTS.glob("*.toml")))
    except ValueError as error:
        print(error, file=sys.stderr)
        return 2
    every = [m for m in every if given.k.lower() in f"{m.room} {m.file} {m.says}".lower()]
    if problems := problems_of(every):
        print("\n".join(problems), file=sys.stderr)
        return 2
    equivalent = [mutant for mutant in every if mutant.equivalent]
    tried = [mutant for mutant in every if not mutant.equivalent]
    with tempfile.TemporaryDirectory(prefix="mutants-") as place:
        first = copy_of(ROOT, Path(place, "0"))
        first.check_imports()
        paths = list(dict.fromkeys(path for mutant in tried for path in mutant.tests.split()))
        if paths and (broken := first.failing(paths)):
            print(f"the tests do not pass without any mutant: {broken}", file=sys.stderr)
            first.close()
            return 2
        copies = [first]
        copies += [copy_of(first.root, Path(place, str(n))) for n in range(1, max(1, given.jobs))]
        results = try_all(tried, copies)
        for copy in copies:
            copy.close()
    print(table(results, equivalent))
    killed = sum(bool(result.by) for result in results)
    return 0 if killed >= LEAST_SHARE * len(results) else 1


if __name__ == "__main__":
    sys.exit(main())
