"""Finds records that no run has finished, repairs them, and says in a line what is in each."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from stepload.errors import SteploadError, in_words
from stepload.identification.identify import Identification
from stepload.record.recovery import Recovered, find_unfinished, recover
from stepload.report.conditions import Stated
from stepload.report.from_file import identify_file
from stepload.report.identified import identification_data
from stepload.session.files import RECORD, write_bag_metadata
from stepload.session.reevaluation import results_again, write_new
from stepload.units import format_quantity


@dataclass(frozen=True, slots=True)
class Repaired:
    """One record that was found unfinished; `problem` says what could not be done with it.

    `report` is the report that was written beside it, None where none could be: `unwritten`.
    """

    source: Path
    found: Recovered | None
    identification: Identification | None
    problem: str
    report: Path | None = None
    unwritten: str = ""

    @property
    def line(self) -> str:
        """The result of the repair in one line."""
        if self.found is None:
            return f"unfinished record {self.source}: not repaired: {self.problem}"
        counts = self.found.counts
        text = f"unfinished record {self.source}: repaired, marked partial ({self.found.path.name}"
        text += f", {sum(counts.values())} messages read back, {self.found.cut_bytes} bytes cut); "
        if self.identification is None:
            return text + f"nothing to identify: {self.problem}"
        found, said = self.identification.headline, self.identification.verdict.value
        if found is None:
            return text + f"from what is there: no stiffness, {said}"
        low, high = (format_quantity(force_n, "N") for force_n in (found.from_n, found.to_n))
        return text + (
            f"from what is there: chord stiffness {format_quantity(found.value_n_per_m, 'N/m')} "
            f"from {low} to {high}, {said}"
        )

    @property
    def data(self) -> dict[str, Any]:
        """The same for `--json`."""
        found, identified = self.found, self.identification
        return {
            "source": self.source,
            "path": found.path if found else None,
            "counts": found.counts if found else {},
            "cut_bytes": found.cut_bytes if found else 0,
            "damage": found.damage if found else "",
            "identification": identification_data(identified) if identified else None,
            "problem": self.problem,
            "report": self.report,
            "unwritten": self.unwritten,
        }


def repair(path: Path, out: Path | None = None) -> Repaired:
    """Repair one record, identify what is in it, and write results and report beside it.

    Results that are there already stay: somebody has written them.

    Raises:
        BadInputError: it cannot be repaired.
    """
    found = recover(path, out)
    try:
        identification, _ = identify_file(found.path, Stated())
    except (SteploadError, ArithmeticError, ValueError) as error:
        repaired = Repaired(path, found, None, _one_line(error))
    else:
        repaired = Repaired(path, found, identification, "")
    try:
        if found.path.name == RECORD:
            write_bag_metadata(found.path)
        report = write_new(found.path.parent, *results_again(found.path))
    except (SteploadError, ArithmeticError, ValueError, OSError) as error:
        return replace(repaired, unwritten=_one_line(error))
    return replace(repaired, report=report)


def repair_all(directory: Path) -> list[Repaired]:
    """Repair what is unfinished in `directory` and one level below; never raises for one of them.

    What a living run still writes is left alone.
    """
    done = []
    for path in find_unfinished(directory) if directory.is_dir() else []:
        try:
            done.append(repair(path))
        except (SteploadError, OSError) as error:  # it must not keep the next run from beginning
            done.append(Repaired(path, None, None, _one_line(error)))
    return done


def _one_line(error: Exception) -> str:
    text = error.message if isinstance(error, SteploadError) else in_words(error)
    return " ".join(text.split())
