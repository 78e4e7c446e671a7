"""What the channels of a simulated rig need of its mechanics, of one axis or of six."""

from __future__ import annotations

from typing import Protocol


class Pressed(Protocol):
    """What a force sensor feels: the force now, and a base step ago."""

    @property
    def force_n(self) -> float: ...

    @property
    def last_force_n(self) -> float: ...


class Mechanics(Pressed, Protocol):
    """A plant; positions and forces along the press. See `Plant` for what each means."""

    step_s: float
    time_s: float
    braked: bool

    @property
    def peak_n(self) -> float: ...

    @property
    def peak_equivalent_n(self) -> float: ...

    @property
    def target_m(self) -> float: ...

    @property
    def drive_m(self) -> float: ...

    @property
    def drive_speed(self) -> float: ...

    @property
    def measured_m(self) -> float: ...

    @property
    def tip_m(self) -> float: ...

    @property
    def tip_speed(self) -> float: ...

    @property
    def tip_acceleration_m_s2(self) -> float: ...

    @property
    def closed_m(self) -> float: ...

    @property
    def surface_m(self) -> float: ...

    @property
    def sub_steps(self) -> int: ...

    def command(self, apply_s: float, target_m: float) -> None: ...

    def step(self) -> None: ...
