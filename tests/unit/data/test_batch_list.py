"""The list of a batch: what it may say, and where it is wrong."""

from __future__ import annotations

from pathlib import Path

import pytest
from run_plans import stvf_plan

from stepload.data.batch import Piece, first_looks, read_list
from stepload.plan.problems import PlanError
from stepload.record.summary import Summary

PLAN = Path("plan.yaml")


def _list(tmp_path: Path, text: str, *, dry: bool = True) -> list[Piece]:
    path = tmp_path / "specimens.csv"
    path.write_text(text)
    return read_list(path, PLAN, dry_run=dry)


@pytest.mark.parametrize("mark", [",", ";", "\t"])
def test_rows(tmp_path: Path, mark: str) -> None:
    text = 'Specimen,operator,trial,plan,notes\n07,Ann,1,,\n\n07,Ann,2,b.yaml,"soft, wet"\n'
    text = text.replace(",", mark).replace(f"soft{mark} wet", "soft, wet")
    first, second = _list(tmp_path, text)
    assert (first.plan, first.specimen, first.operator, first.trial) == (PLAN, "07", "Ann", "1")
    assert (second.plan, second.trial) == (tmp_path / "b.yaml", "2")
    assert second.notes == "soft, wet"
    assert second.key(stvf_plan())[1:] == ("07", "Ann", "2")


def test_the_truth_of_a_rehearsal(tmp_path: Path) -> None:
    text = "specimen,simulation.payload_factor,simulation.surface_error\n1,1.1,-0.2 mm\n2,,\n"
    first, second = _list(tmp_path, text)
    made = first.of(stvf_plan(), "B7")
    assert made.rig.simulation.payload_factor == 1.1
    assert made.rig.simulation.surface_error_m == pytest.approx(-2e-4)
    assert (made.record.batch, made.record.specimen) == ("B7", "1")
    assert "simulation.payload_factor=1.1" in made.record.tags
    assert second.of(stvf_plan(), "B7").rig.simulation.payload_factor == 1.0


@pytest.mark.parametrize(
    ("text", "places"),
    [
        ("", [(1, 1)]),
        ("specimen\n", [(1, 1)]),
        ("specimen,trial,trial\n1,1,1\n", [(1, 1)]),
        ("name,notes\n1,\n", [(1, 1), (1, 1)]),
        ("specimen,colour\n1,red\n", [(1, 10)]),
        ("specimen,notes\n1,a,b\n2,\n", [(2, 5)]),
        ("specimen,operator\n,Ann\n", [(2, 1)]),
        ("specimen,trial\n1,1\n1,1\n", [(3, 1)]),
        ("specimen,simulation.payload_factor\n1,much\n2,1000\n", [(2, 3), (3, 3)]),
        (f"specimen,notes\n{'x' * 101},\na\x07,\n", [(2, 1), (2, 1), (3, 1), (3, 1)]),
        ('specimen,notes,simulation.surface_error\n1,"a, b",3\n', [(2, 10)]),
    ],
)
def test_what_is_wrong_has_its_place(
    tmp_path: Path, text: str, places: list[tuple[int, int]]
) -> None:
    with pytest.raises(PlanError) as caught:
        _list(tmp_path, text)
    assert [(each.line, each.column) for each in caught.value.problems] == places


def test_a_truth_belongs_to_a_rehearsal(tmp_path: Path) -> None:
    with pytest.raises(PlanError) as caught:
        _list(tmp_path, "specimen,simulation.payload_factor\n1,1.1\n", dry=False)
    assert (caught.value.problems[0].line, caught.value.problems[0].column) == (1, 10)


def _summary(results: dict[str, object] | None) -> Summary:
    return Summary(Path("run.mcap"), {}, {}, results, False)


def test_first_looks_of_records_that_lack_them() -> None:
    touches = {"touches": [{"position_m": 1e-3}]}
    whole = _summary({"measured": touches, "levels": [{"deformation_m": 2e-6}]})
    lacking = _summary({"measured": touches, "levels": [{"deformation_m": None}]})
    assert first_looks([whole, lacking, _summary({}), _summary(None)]) == [(1e-3, 2e-6)]
