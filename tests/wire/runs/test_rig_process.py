"""The emulated rig as a process: what it refuses, and that it leaves nothing behind."""

from __future__ import annotations

import pytest

from stepload.errors import RefusedError
from stepload.rig.world import DEFAULT_SPEC
from stepload_verify.emulators.rig_process import RigProcess


def test_busy_ports_and_names_are_refused_with_the_reason(emulated_run, tmp_path):
    host = emulated_run().rig.options["ur"]["host"]
    with pytest.raises(RefusedError, match=rf"{host}.*in use"):
        RigProcess(DEFAULT_SPEC, ur=host)
    taken = tmp_path / "port"
    taken.write_text("somebody's file")
    with pytest.raises(RefusedError, match="is there already"):
        RigProcess(DEFAULT_SPEC, ur="127.0.99.1", links={"bota_serial": taken})
    assert taken.read_text() == "somebody's file"
