"""The `stepload` command with stage directions: at a chosen place of the run it stands still until
something has happened, or a chosen part breaks. Everything else is the real program.

    python staged.py '{"at": "HOLD 2", "wait": "stop 1", "say": 5}' run plan.yaml --dry-run
    python staged.py serve 5

The second form forks a process for each message on a socket, so that the imports are made once.

at     phase and step at which the directions begin to hold (from the start if left out)
wait   "stop N", "paused", "gone PATH" or "for ever": what the run stands still for, once it is
       there
say    descriptor on which one line is written when it is there
break  part → "raise", "hang" (comes back when a signal raises) or "hang for good"
fault  [kind, start_s, duration_s, magnitude] of the simulated world
judge  true: also identify and draw the report, which takes longer than the run
"""

from __future__ import annotations

import contextlib
import json
import os
import socket
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from stepload.cli.main import main
from stepload.engine import controller, open_rig, safe_end, supervisor, tick
from stepload.errors import BadInputError
from stepload.record import recorder
from stepload.record.recorder import Recorder
from stepload.record.rows import Phase
from stepload.report import analyse
from stepload.rig.world import WorldFault
from stepload.session import experiment, files
from stepload_drivers.sim.arm import WorldArm
from stepload_drivers.sim.sensors import WorldForceSensor

PATIENCE_S = 60.0
PARTS: dict[str, tuple[Any, str]] = {
    "arm drain": (WorldArm, "drain"),
    "arm command": (WorldArm, "command"),
    "arm retract": (WorldArm, "retract"),
    "arm safe": (WorldArm, "safe"),
    "arm close": (WorldArm, "close"),
    "arm fault": (WorldArm, "fault"),
    "force open": (WorldForceSensor, "open"),
    "force drain": (WorldForceSensor, "drain"),
    "force safe": (WorldForceSensor, "safe"),
    "force close": (WorldForceSensor, "close"),
    "engine": (tick.Engine, "tick"),
    "supervisor": (supervisor.Supervisor, "check"),
    "controller": (controller.StepController, "step"),
    "event": (Recorder, "event"),
    "read back": (recorder, "count_messages"),
    "safing": (safe_end, "make_safe"),
    "evaluation": (experiment, "evaluate"),
    "reading": (experiment, "read_to_evaluate"),
    "report": (experiment, "run_document"),
    "results": (files, "write_results"),
}


def leave_out_judgement(patch: Callable[[Any, str, Any], None]) -> None:
    """No identification and no figures, where a test asks for neither."""

    def not_now(*_: Any) -> Any:
        raise BadInputError("left out")

    patch(analyse, "identify_payload", not_now)
    patch(files, "render", lambda document: "")


class Stage:
    """The directions, and whether they hold yet."""

    def __init__(self, directions: dict[str, Any]) -> None:
        place = directions.get("at", "").split()
        self.phase = Phase[place[0]] if place else None
        self.step = int(place[1]) if len(place) > 1 else None
        self.wait = directions.get("wait", "")
        self.say_fd = directions.get("say", -1)
        self.on = self.phase is None
        for part, how in directions.get("break", {}).items():
            self._break(*PARTS[part], how)
        experiment.refuse_simulated = lambda plan: None  # on purpose: nothing is measured here
        experiment.refuse_unproven = lambda preflight: None
        if not directions.get("judge"):
            leave_out_judgement(setattr)
        if fault := directions.get("fault"):
            made = open_rig.world_for
            open_rig.world_for = lambda preflight, seed: made(
                preflight, seed=seed, faults=[WorldFault(*fault)]
            )
        self._watch()

    def _break(self, owner: Any, name: str, how: str) -> None:
        original: Callable[..., Any] = getattr(owner, name)

        def broken(*args: Any, **kwargs: Any) -> Any:
            while self.on and how == "hang for good":
                try:
                    time.sleep(3600.0)
                except BaseException as error:
                    del error
            if self.on and how == "hang":
                if self.say_fd >= 0:
                    os.write(self.say_fd, b"hanging\n")
                time.sleep(3600.0)
            if self.on:
                raise RuntimeError(f"{name} broken on purpose")
            return original(*args, **kwargs)

        setattr(owner, name, broken)

    def _watch(self) -> None:
        original = tick.Engine.tick

        def watched(engine: tick.Engine, *args: Any) -> Any:
            answer = original(engine, *args)
            row = engine.row
            here = row is not None and row.phase == self.phase and self.step in (None, row.step)
            if here and not self.on:
                self.on = True
                self._stand_still(engine.operator)
            return answer

        tick.Engine.tick = watched  # type: ignore[method-assign]

    def _stand_still(self, operator: Any) -> None:
        level = int(self.wait.removeprefix("stop ")) if self.wait.startswith("stop ") else 0
        told = operator.stop_level
        self._say(operator)
        give_up_at = time.monotonic() + PATIENCE_S
        while self.wait and time.monotonic() < give_up_at:
            if operator.stop_level != told:
                told = operator.stop_level
                self._say(operator)
            if level and told >= level:
                return
            if self.wait == "paused" and operator.paused:
                return
            if self.wait.startswith("gone ") and not Path(self.wait.removeprefix("gone ")).exists():
                return
            time.sleep(0.005)

    def _say(self, operator: Any) -> None:
        if self.say_fd >= 0:
            os.write(self.say_fd, f"here, stop level {operator.stop_level}\n".encode())


def serve(requested: socket.socket) -> None:
    """Fork a staged process for each message on `asked`; returns in those.

    A message is directions and arguments, with the files for output, errors and `say`, and a pipe
    on which the process's number is written when it runs and its status when it has ended.
    """
    while True:
        message, files_sent, _, _ = socket.recv_fds(requested, 1 << 16, 4)
        with contextlib.suppress(ChildProcessError):
            while os.waitpid(-1, os.WNOHANG if message else 0)[0]:
                pass
        if not message:
            sys.exit()
        if os.fork() == 0:
            requested.close()
            told = files_sent.pop()
            if (child := os.fork()) == 0:
                os.close(told)
                _become(*files_sent, json.loads(message))
                return
            for each in files_sent:
                os.close(each)
            os.write(told, child.to_bytes(8, "big"))
            os.write(told, os.waitpid(child, 0)[1].to_bytes(8, "big"))
            os._exit(0)
        for each in files_sent:
            os.close(each)


def _become(out: int, err: int, say: int, requested: dict[str, Any]) -> None:
    """The staged process: output and errors to these files, in a session of its own."""
    os.setsid()
    nothing = os.open(os.devnull, os.O_RDONLY)
    for descriptor, number in ((nothing, 0), (out, 1), (err, 2)):
        os.dup2(descriptor, number)
        os.close(descriptor)
    os.chdir(requested["directory"])
    sys.argv[1:] = [json.dumps({**requested["directions"], "say": say}), *requested["arguments"]]


if __name__ == "__main__":
    if sys.argv[1] == "serve":
        serve(socket.socket(fileno=int(sys.argv[2])))
    Stage(json.loads(sys.argv.pop(1)))
    main()
