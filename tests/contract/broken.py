"""Broken drivers of every kind: each is the healthy simulated one with a few lines changed.

Each function takes the healthy class and returns the broken one. `self._place.host()` is the
simulated program side: its clock and its world.
"""

from __future__ import annotations

import math
import threading
from dataclasses import replace

from stepload.errors import DeviceError
from stepload.rig.faults import FaultCode
from stepload.rig.samples import ForceSample

LEAKED: list[tuple[threading.Thread, threading.Event]] = []


def end_leaked_threads():
    """End what the leaking drivers have left behind."""
    while LEAKED:
        thread, ended = LEAKED.pop()
        ended.set()
        thread.join()


def _leave_thread():
    ended = threading.Event()
    thread = threading.Thread(target=ended.wait, name="left behind", daemon=True)
    thread.start()
    LEAKED.append((thread, ended))


def _variant(healthy, **methods):
    return type("Broken", (healthy,), methods)


def _each(healthy, change):
    """Samples pass through `change(self, sample)`; None leaves one out."""

    def drain(self):
        changed = (change(self, sample) for sample in healthy.drain(self))
        return [sample for sample in changed if sample is not None]

    return _variant(healthy, drain=drain)


def _now_s(self):
    return self._place.host().clock.now_s()


def _blocks(self, seconds):
    clock = self._place.host().clock
    clock.sleep_until(clock.now_s() + seconds)


# options and life


def swallows_unknown_options(healthy):
    def init(self, place, **ignored):
        healthy.__init__(self, place)

    return _variant(healthy, __init__=init)


def works_in_the_constructor(healthy):
    def init(self, *arguments, **options):
        healthy.__init__(self, *arguments, **options)
        _leave_thread()

    return _variant(healthy, __init__=init)


def _before_open(healthy, name, value):
    def method(self):
        return getattr(healthy, name)(self) if self._stream else value

    return _variant(healthy, **{name: method})


def has_samples_before_open(healthy):
    sample = ForceSample(1, 0.0, 0.0, 0, (0.0,) * 6, 20.0)
    return _before_open(healthy, "drain", [sample])


def open_exceeds_its_deadline(healthy):
    def late(self, timeout_s):
        _blocks(self, 10.0)
        return healthy.open(self, timeout_s)

    return _variant(healthy, open=late)


def _after_open(healthy, act):
    def changed(self, timeout_s):
        identity = healthy.open(self, timeout_s)
        act(self)
        return identity

    return _variant(healthy, open=changed)


def leaks_when_open_fails(healthy):
    def half(self, timeout_s):
        if timeout_s < 1e-3:
            _leave_thread()
            raise DeviceError("no", code=FaultCode.NOT_CONNECTED)
        return healthy.open(self, timeout_s)

    return _variant(healthy, open=half)


def close_leaks_a_thread(healthy):
    def leave(self, timeout_s):
        _leave_thread()
        return healthy.open(self, timeout_s)

    return _variant(healthy, open=leave)


def opens_only_once(healthy):
    def once(self, timeout_s):
        if getattr(self, "_used", False):
            raise DeviceError("port in use", code=FaultCode.NOT_CONNECTED)
        self._used = True
        return healthy.open(self, timeout_s)

    return _variant(healthy, open=once)


def safe_always_refuses(healthy):
    def safe(self, timeout_s):
        raise DeviceError("no", code=FaultCode.REFUSED_COMMAND)

    return _variant(healthy, safe=safe)


def safe_works_once(healthy):
    def safe(self, timeout_s):
        if healthy.health(self).received:
            if getattr(self, "_safe", False):
                raise DeviceError("already safe", code=FaultCode.REFUSED_COMMAND)
            self._safe = True
            healthy.safe(self, timeout_s)

    return _variant(healthy, safe=safe)


def safe_crashes_before_open(healthy):
    def safe(self, timeout_s):
        if not hasattr(self, "_used"):
            raise AttributeError("no link")

    def begin(self, timeout_s):
        self._used = True
        return healthy.open(self, timeout_s)

    return _variant(healthy, safe=safe, open=begin)


# data


def repeats_a_sample(healthy):
    def drain(self):
        samples = healthy.drain(self)
        return samples + samples[-1:]

    return _variant(healthy, drain=drain)


def loses_unnoticed(healthy):
    def drain(self):
        return healthy.drain(self)[:-1]

    return _variant(healthy, drain=drain)


def faults_by_itself(healthy):
    def fault(self):
        if self._stream and healthy.health(self).received > 200:
            self._stream.latch(FaultCode.CORRUPT, "for no reason", 0.0)
        return healthy.fault(self)

    return _variant(healthy, fault=fault)


def miscounts(healthy):
    def health(self):
        found = healthy.health(self)
        return replace(found, received=(found.received + 1) // 2)

    return _variant(healthy, health=health)


def gives_plain_tuples(healthy):
    return _variant(healthy, drain=lambda self: [tuple(s) for s in healthy.drain(self)])


def gives_one_axis_only(healthy):
    return _each(healthy, lambda self, s: s._replace(wrench=s.wrench[2:3]))


def gives_a_pose_of_three(healthy):
    return _each(healthy, lambda self, s: s._replace(pose=s.pose[:3]))


def receive_time_goes_back(healthy):
    def change(self, sample):
        back_s = 0.01 if sample.sequence % 50 == 0 else 0.0
        return sample._replace(receive_time_s=sample.receive_time_s - back_s)

    return _each(healthy, change)


def stamps_at_drain(healthy):
    return _each(healthy, lambda self, sample: sample._replace(receive_time_s=_now_s(self)))


def stamps_in_the_future(healthy):
    return _each(
        healthy, lambda self, sample: sample._replace(receive_time_s=sample.receive_time_s + 0.5)
    )


def drain_waits_for_data(healthy):
    def drain(self):
        while not (samples := healthy.drain(self)) and self._stream:
            if healthy.fault(self):
                break
            _blocks(self, 1e-4)
        return samples

    return _variant(healthy, drain=drain)


def passes_nan_on(healthy):
    def change(self, sample):
        return sample._replace(wrench=(float("nan"),) * 6) if sample.sequence == 100 else sample

    return _each(healthy, change)


# values


def frozen_force(healthy):
    def change(self, sample):
        self._wrench = getattr(self, "_wrench", sample.wrench)
        return sample._replace(wrench=self._wrench)

    return _each(healthy, change)


def force_in_millinewton(healthy):
    return _each(
        healthy, lambda self, s: s._replace(wrench=tuple(1e3 * value for value in s.wrench))
    )


def ignores_the_zero(healthy):
    return _variant(healthy, bias=lambda self, timeout_s: True)


def gauge_in_millimetres(healthy):
    return _each(healthy, lambda self, s: s._replace(displacement_m=1e3 * s.displacement_m))


# silence


def never_stale(healthy):
    return _variant(healthy, fault=lambda self: None)


def _repeats_when_silent(healthy):
    def drain(self):
        samples = healthy.drain(self)
        if not samples and healthy.fault(self) and getattr(self, "_newest", None):
            old = self._newest
            samples = [old._replace(sequence=old.sequence + 1, receive_time_s=_now_s(self))]
        self._newest = samples[-1] if samples else getattr(self, "_newest", None)
        return samples

    return _variant(healthy, drain=drain)


def goes_on_repeating(healthy):
    return never_stale(_repeats_when_silent(healthy))


def forgets_its_fault(healthy):
    def fault(self):
        found = healthy.fault(self)
        self._requested = getattr(self, "_requested", 0) + (found is not None)
        return found if self._requested < 2 else None

    return _variant(healthy, fault=fault)


def _without_link(healthy, name, act):
    """Method `name` calls `act(self)` once the device has its fault."""

    def method(self, *arguments):
        if healthy.fault(self):
            act(self)
        getattr(healthy, name)(self, *arguments)

    return _variant(healthy, **{name: method})


def _crash(self):
    raise OSError("bad file descriptor")


def safe_crashes_without_link(healthy):
    return _without_link(healthy, "safe", _crash)


def safe_blocks_without_link(healthy):
    return _without_link(healthy, "safe", lambda self: _blocks(self, 30.0))


def close_crashes_without_link(healthy):
    return _without_link(healthy, "close", _crash)


def command_blocks_without_link(healthy):
    return _without_link(healthy, "command", lambda self: _blocks(self, 30.0))


# rest


def moves_after_open(healthy):
    """It begins to move when nothing supervises it yet."""
    return _after_open(healthy, lambda self: self._send(self.held_m() + 1.5e-3))


def moves_before_open_returns(healthy):
    def act(self):
        self._send(self.held_m() - 1.5e-3)
        _blocks(self, 0.5)
        self.drain()

    return _after_open(healthy, act)


def close_leaves_a_target(healthy):
    """The tip goes on when nobody is there any more."""

    def close(self):
        if self._stream:
            self._send(self.held_m() + 0.9e-3)
        healthy.close(self)

    return _variant(healthy, close=close)


# motion


def frozen_position(healthy):
    return _each(healthy, lambda self, s: s._replace(position_m=0.0, pose=(0.0,) * 6))


def reversed_position(healthy):
    return _each(healthy, lambda self, s: s._replace(position_m=-s.position_m))


def tells_its_wrench_in_another_frame(healthy):
    def change(_self, sample):
        x, y, z, *torques = sample.wrench
        return sample._replace(wrench=(z, x, y, *torques))

    return _each(healthy, change)


def has_no_force_but_says_so(healthy):
    return _each(healthy, lambda self, s: s._replace(force_n=float("nan")))


def takes_nan(healthy):
    def command(self, position_m):
        if abs(position_m) < 1.0:
            healthy.command(self, position_m)

    return _variant(healthy, command=command)


def tells_nothing_of_where_it_is_held(healthy):
    return _variant(healthy, held_m=lambda self: math.nan)


def moves_on_a_refused_target(healthy):
    def command(self, position_m):
        if abs(position_m) == math.inf:
            healthy.command(self, -5e-4)
        healthy.command(self, position_m)

    return _variant(healthy, command=command)


def retracts_forth(healthy):
    def retract(self, distance_m, speed_m_s, timeout_s):
        healthy.retract(self, abs(distance_m), speed_m_s, timeout_s)

    return _variant(healthy, retract=retract)


def retracts_too_fast(healthy):
    def retract(self, distance_m, speed_m_s, timeout_s):
        healthy.retract(self, distance_m, 10.0 * speed_m_s, timeout_s)

    return _variant(healthy, retract=retract)


def retract_does_nothing(healthy):
    def retract(self, distance_m, speed_m_s, timeout_s):
        if not distance_m > 0.0:
            healthy.retract(self, distance_m, speed_m_s, timeout_s)

    return _variant(healthy, retract=retract)


def stops_short(healthy):
    """It says that it is held where it was sent."""

    def command(self, position_m):
        self._sent_m = position_m
        healthy.command(self, min(position_m, 0.8e-3))

    return _variant(healthy, command=command, held_m=lambda self: getattr(self, "_sent_m", 0.0))


def does_not_hold(healthy):
    def command(self, position_m):
        healthy.command(self, position_m)
        self._told_s = _now_s(self)

    def drain(self):
        silent_s = max(0.0, _now_s(self) - getattr(self, "_told_s", 1e9) - 0.1)
        fallen_m = 1e-3 * silent_s
        return [s._replace(position_m=s.position_m - fallen_m) for s in healthy.drain(self)]

    return _variant(healthy, command=command, drain=drain)


def safe_does_nothing(healthy):
    return _variant(healthy, safe=lambda self, timeout_s: None)


def safe_waits_for_the_target(healthy):
    def safe(self, timeout_s):
        if self._stream:
            _blocks(self, 0.5)

    return _variant(healthy, safe=safe)


# across the approach


def shift_takes_nan(healthy):
    def command(self, position_m, shift_m=(0.0, 0.0)):
        if shift_m[0] == shift_m[0]:
            healthy.command(self, position_m, shift_m)

    return _variant(healthy, command=command)


def shift_is_not_bounded(healthy):
    def command(self, position_m, shift_m=(0.0, 0.0)):
        if not 0.015 <= abs(shift_m[0]) < 1.0:
            healthy.command(self, position_m, shift_m)

    return _variant(healthy, command=command)


def ignores_the_shift(healthy):
    def command(self, position_m, shift_m=(0.0, 0.0)):
        healthy.command(self, position_m, shift_m)
        self._shift_m = shift_m
        for drive in self._host.world.plant._across:
            drive.commands.clear()

    return _variant(healthy, command=command)


def shift_in_another_frame(healthy):
    return _each(healthy, lambda self, s: s._replace(pose=(s.pose[1], s.pose[0], *s.pose[2:])))


def retract_drops_the_shift(healthy):
    def retract(self, distance_m, speed_m_s, timeout_s):
        healthy.retract(self, distance_m, speed_m_s, timeout_s)
        plant = self._host.world.plant
        if hasattr(plant, "command_shift"):
            plant.command_shift(_now_s(self), 0.0, 0.0)
            _blocks(self, 0.5)

    return _variant(healthy, retract=retract)


def shift_moves_the_axis(healthy):
    def drain(self):
        return [
            s._replace(position_m=s.position_m + 0.5 * math.hypot(*s.pose[:2]))
            for s in healthy.drain(self)
        ]

    return _variant(healthy, drain=drain)


# what no check can see


# sound all the same

LEASH_S = 0.1


def on_a_leash(healthy):
    """An arm that is left by its run for `LEASH_S` while it has a target ends its program."""

    def received(name):
        method = getattr(healthy, name)

        def call(self, *arguments):
            now_s = _now_s(self)
            silent_s = now_s - getattr(self, "_received_s", now_s)
            self._received_s = now_s
            if silent_s > LEASH_S and self._led:
                self._stream.latch(FaultCode.PROGRAM_STOPPED, f"silent for {silent_s:g} s", now_s)
            result = method(self, *arguments)
            self._received_s = _now_s(self)
            self._led = name == "command" or (self._led and name not in ("safe", "retract"))
            if name == "drain" and healthy.fault(self) is not None:
                return []
            return result

        return call

    names = ("drain", "fault", "health", "command", "retract", "safe")
    return _variant(healthy, _led=False, **{name: received(name) for name in names})
