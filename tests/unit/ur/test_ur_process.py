"""The process of ur_rtde: what it is made from."""

from __future__ import annotations

from stepload_drivers.ur import wire
from stepload_drivers.ur.process import ChildProcess
from stepload_drivers.ur.settings import Settings


def test_no_module_of_the_working_directory_runs_with_the_arm(tmp_path, monkeypatch):
    (tmp_path / "resource.py").write_text("raise SystemExit(77)")
    monkeypatch.chdir(tmp_path)
    child = ChildProcess(Settings(host="127.0.0.1"), 0.002, 20.0)
    try:
        messages = child.receive(60.0)
        assert [message[:1] for message in messages[:1]] == [wire.STAGE]
    finally:
        child.kill()
