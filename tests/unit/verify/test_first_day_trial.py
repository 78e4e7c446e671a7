"""The trial of the first day tells a busy machine from a rig that is not sound."""

from __future__ import annotations

import io

import pytest

from stepload.errors import RefusedError
from stepload_verify.trials import first_day as trial


class FakeRig:
    """An emulated arm that begins `late` of every 1000 periods late."""

    def __init__(self, late: int) -> None:
        self.late, self.looks = late, 0
        self.options = {"ur": {"host": "127.0.0.1"}, "bota_serial": {"port": "/dev/null"}}

    def state(self):
        self.looks += 1
        return {
            "time_s": 2.0 * self.looks, "periods_skipped": 0,
            "periods_late": self.late * self.looks,
        }  # fmt: skip


@pytest.fixture
def refusing(monkeypatch):
    """Refuses so often as told, then is done; counts how often it was begun."""

    def make(times):
        begun = []

        def set_up(rig, answers, *, press, until=""):
            begun.append(rig)
            if len(begun) <= times:
                raise RefusedError("arm: lost", hint="idle machine")
            return []

        monkeypatch.setattr(trial, "set_up", set_up)
        monkeypatch.setattr(trial.time, "sleep", lambda seconds: None)
        return begun

    return make


def test_a_step_refused_on_a_busy_machine_is_begun_again(refusing, tmp_path):
    begun, said = refusing(2), io.StringIO()
    assert trial.first_day(tmp_path, FakeRig(late=50), said) == []
    assert len(begun) == 3
    assert "the machine was busy: the emulated arm began 5.0% of its" in said.getvalue()


def test_a_step_refused_at_its_leisure_is_not(refusing, tmp_path):
    begun = refusing(2)
    with pytest.raises(RefusedError, match="arm: lost"):
        trial.first_day(tmp_path, FakeRig(late=1), io.StringIO())
    assert len(begun) == 1


def test_a_machine_that_stays_busy_ends_it(refusing, tmp_path):
    begun = refusing(99)
    with pytest.raises(RefusedError):
        trial.first_day(tmp_path, FakeRig(late=50), io.StringIO())
    assert len(begun) == trial.TRIES


@pytest.mark.parametrize(("late", "said"), [(0.05, "was busy: "), (0.001, "kept up: ")])
def test_the_end_names_the_step_the_reason_and_the_machine(tmp_path, late, said):
    told = trial.why_it_ended(tmp_path, RefusedError("no answer", hint="power"), late)
    assert told.startswith("\nthe first day ended in its step `arm`: no answer\n  -> power\n")
    assert said in told
