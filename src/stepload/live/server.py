"""The process behind `run --live`: reads the record as it grows and shows it to viewers.

It is no part of the run. It reads the file that the record's writer fills, so nothing that a viewer
does, and nothing that goes wrong here, can reach the loop, the devices or the record. Viewers read;
they cannot publish, call or set anything.

Standard input brings the path of the record in one line, and its end is the end of this process.
Standard output says in one line that viewers can connect, or why not.
"""

from __future__ import annotations

import json
import os
import select
import signal
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stepload.errors import SteploadError
from stepload.live.messages import POSE, TARED, pose_message, wrench_message
from stepload.live.state import LIVE, LIVE_SCHEMA, State
from stepload.live.tail import Message, Tail
from stepload.record.scan import DamageError

if TYPE_CHECKING:
    import foxglove

PERIOD_S = 1.0 / 30.0
"""Period of the updates for viewers: the newest sample of each stream, and every event."""
LINGER_S = 0.5
NICE = 10
READY, FAILED = "ready", "failed"


class Publisher:
    """Publishes the new content of a record to all connected viewers."""

    def __init__(self, tail: Tail) -> None:
        self._tail = tail
        self._channels: dict[str, foxglove.Channel] = {}
        self._state: State | None = None
        self._problem = ""
        self._tick_ns = 0

    def publish(self) -> None:
        """Publish the new content since the last call."""
        self._tail.read()
        for each in self._tail.announced:
            if each.topic not in self._channels:
                self._open(each.topic, each.schema, each.definition)
        messages, events = self._tail.events()
        newest = self._tail.newest()
        for topic, message in (*(("/events", m) for m in messages), *newest.items()):
            if topic in self._channels:
                self._channels[topic].log(message.data, log_time=message.time_ns)
        self._tell(newest.get("/tick"), events)

    def _tell(self, tick: Message | None, events: Any) -> None:
        import foxglove

        rows = self._tail.rows()
        time_ns = self._tick_ns = tick.time_ns if tick is not None else self._tick_ns
        if self._problem:
            return
        try:
            if self._state is None:
                if not self._tail.attachments or tick is None:
                    return
                self._state = State(self._tail.metadata, self._tail.attachments)
                for topic in (TARED, POSE):
                    self._open(topic.name, topic.schema, topic.definition.encode())
                self._channels[LIVE] = foxglove.Channel(
                    LIVE, schema=LIVE_SCHEMA, message_encoding="json"
                )
            self._state.take(*rows, events, ended=self._tail.ended)
        except (SteploadError, ValueError, KeyError, TypeError, ArithmeticError) as error:
            self._problem = f"margins and deformation are not shown: {error}"
            print(self._problem, file=sys.stderr, flush=True)
            return
        if not self._state.taken:
            return
        told, arm, tared = self._state.told(), self._state.arm, self._state.tared_wrench
        if told is not None:
            self._channels[LIVE].log(json.dumps(told), log_time=time_ns)
        if arm is not None:
            self._channels[POSE.name].log(pose_message(time_ns, arm.pose), log_time=time_ns)
        if tared is not None:
            self._channels[TARED.name].log(wrench_message(time_ns, tared), log_time=time_ns)

    def _open(self, topic: str, schema: str, definition: bytes) -> None:
        import foxglove

        self._channels[topic] = foxglove.Channel(
            topic,
            schema=foxglove.Schema(name=schema, encoding="ros2msg", data=definition),
            message_encoding="cdr",
        )


def _quiet() -> None:
    """Keep standard error for our own words: the SDK logs there what any viewer makes it say."""
    words, nothing = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    os.dup2(nothing, 2)
    os.close(nothing)
    sys.stderr = os.fdopen(words, "w", buffering=1)


def main(host: str, port: int, *files: str) -> int:
    """Serve until standard input ends, by TLS with the files of a certificate and its key.

    Returns the exit code.
    """
    for name in ("SIGINT", "SIGHUP", "SIGQUIT"):
        signal.signal(getattr(signal, name), signal.SIG_IGN)
    os.nice(NICE)
    _quiet()
    try:
        import foxglove

        certificate, key = [Path(file).read_bytes() for file in files] or (None, None)
        server = foxglove.start_server(
            name="stepload", host=host, port=port, capabilities=[], supported_encodings=[],
            tls_cert=certificate, tls_key=key,
        )  # fmt: skip
    except ImportError:
        print(FAILED, "foxglove-sdk is not installed: pip install 'stepload[live]'", flush=True)
        return 1
    except Exception as error:  # the SDK's own
        print(FAILED, " ".join(str(error).split()), flush=True)
        return 1
    print(READY, server.port, flush=True)
    try:
        if path := sys.stdin.readline().rstrip("\n"):
            _follow(Path(path))
    finally:
        server.stop()
    return 0


def _follow(path: Path) -> None:
    try:
        publisher = Publisher(Tail(path))
        while True:
            began_s = time.monotonic()
            publisher.publish()
            left_s = max(0.0, PERIOD_S - (time.monotonic() - began_s))
            if select.select([0], [], [], left_s)[0]:  # nothing comes but the end
                publisher.publish()
                time.sleep(LINGER_S)
                return
    except (OSError, DamageError) as error:
        print(f"the live view ends: {error}", file=sys.stderr, flush=True)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], int(sys.argv[2]), *sys.argv[3:]))
