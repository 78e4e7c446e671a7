"""The list of a batch: what it may say, and where it is wrong."""

from __future__ import annotations

from pathlib import Path

import pytest
from run_plans import stvf_plan

from stepload.data.batch import Piece, read_list
from stepload.plan.problems import PlanError

PLAN = Path("plan.yaml")


def _list(tmp_path: Path, text: str) -> list[Piece]:
    path = tmp_path / "specimens.csv"
    path.write_text(text)
    return read_list(path, PLAN)


@pytest.mark.parametrize("mark", [",", ";", "\t"])
def test_rows(tmp_path: Path, mark: str) -> None:
    text = 'Specimen,operator,trial,plan\n"07",Ann,1,\n\n07,"soft, wet",2,b.yaml\n'
    text = text.replace(",", mark).replace(f"soft{mark} wet", "soft, wet")
    first, second = _list(tmp_path, text)
    assert (first.plan, first.specimen, first.operator, first.trial) == (PLAN, "07", "Ann", "1")
    assert second.plan == tmp_path / "b.yaml"
    assert second.key(stvf_plan())[1:] == ("07", "soft, wet", "2")


def test_what_a_press_is_called(tmp_path: Path) -> None:
    made = _list(tmp_path, "specimen,trial\n1,2\n")[0].of(stvf_plan(), "B7")
    assert (made.record.batch, made.record.specimen) == ("B7", "1")
    assert "trial=2" in made.record.tags


@pytest.mark.parametrize(
    ("text", "places"),
    [
        ("", [(1, 1)]),
        ("specimen\n", [(1, 1)]),
        ("specimen,trial,trial\n1,1,1\n", [(1, 1)]),
        ("name,operator\n1,\n", [(1, 1), (1, 1)]),
        ("specimen,colour\n1,red\n", [(1, 10)]),
        ("specimen,operator\n1,a,b\n2,\n", [(2, 5)]),
        ("specimen,operator\n,Ann\n", [(2, 1)]),
        ("specimen,trial\n1,1\n1,1\n", [(3, 1)]),
        (f"specimen,operator\n{'x' * 101},\na\x07,\n", [(2, 1), (2, 1), (3, 1), (3, 1)]),
        ('specimen,operator,plan\n1,"a, ""b""",\x07\n', [(2, 14)]),
    ],
)
def test_what_is_wrong_has_its_place(
    tmp_path: Path, text: str, places: list[tuple[int, int]]
) -> None:
    with pytest.raises(PlanError) as caught:
        _list(tmp_path, text)
    assert [(each.line, each.column) for each in caught.value.problems] == places
