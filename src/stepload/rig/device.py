"""What a device must offer. A driver is a concrete subclass of one of the three devices below.

Life of a device: construct (touches nothing) → `open` → `drain` each tick → `safe` → `close`.
`drain`, `health` and `fault` never block. Drivers that read hardware do so in one thread or child
process of their own; there are no callbacks into the engine. All methods are called by one thread.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from pydantic import dataclasses as declared

from stepload.declaration.sections import SECTION
from stepload.rig.faults import Fault
from stepload.rig.samples import ArmSample, DisplacementSample, ForceSample, SixFloats


@dataclass(frozen=True, slots=True)
class Identity:
    """Who answers: goes into every record, and is compared with what the rig file expects."""

    driver: str
    model: str
    serial_number: str
    firmware: str
    calibration_revision: str


@dataclass(frozen=True, slots=True)
class Health:
    """A snapshot of how the device's data come in, since `open`.

    `age_s` is the age of the newest sample (inf before the first); `rate_hz` the measured sample
    rate; `lost` samples that the device produced and the host never saw; `errors` by name
    (checksum, orphan, resync …).
    """

    received: int
    lost: int
    rate_hz: float
    age_s: float
    longest_gap_s: float
    errors: Mapping[str, int]


@dataclass(frozen=True, slots=True)
class ArmConfiguration:
    """The configuration of an arm as it reports it; None: it does not report it.

    Attributes:
        joints_rad: shape (joints,).
        tcp_offset: TCP from the flange: x, y, z in m, rotation vector in rad.
        payload_kg: mass at the flange that the controller assumes.
        payload_cog_m: its centre of gravity from the flange, shape (3,).
        speed_fraction: of the speed slider, 0 to 1.
        held_pose: TCP pose at which the controller holds it, in the arm's base frame: its own
            target, not what it measures; as `ArmSample.pose`.
    """

    joints_rad: tuple[float, ...] | None = None
    tcp_offset: SixFloats | None = None
    payload_kg: float | None = None
    payload_cog_m: tuple[float, float, float] | None = None
    speed_fraction: float | None = None
    held_pose: SixFloats | None = None


@dataclass(frozen=True, slots=True)
class StopProof:
    """What an arm did when it was deliberately left without commands.

    `stop_s` from the last command until its own watchdog acted, `still_s` until it stood still,
    `travel_m` how far it went meanwhile.
    """

    stop_s: float
    still_s: float
    travel_m: float


@declared.dataclass(frozen=True, slots=True, kw_only=True, config=SECTION)
class NoOptions:
    """The options of a driver that takes none."""


LARGEST_SHIFT_M = 0.01
"""How far across its approach axis an arm may be asked to go, from its start pose."""


class Device(ABC):
    """Common to all devices.

    Subclasses are constructed with the options of the plan's `options:` mapping as keyword
    arguments, validated against `OPTIONS`, quantities already in SI units.
    """

    OPTIONS: ClassVar[type] = NoOptions
    """Every option the driver takes, a field each, as a plan's sections have their keys.

    Unknown ones are refused before the driver is constructed.
    """

    ADDRESS: ClassVar[tuple[str, ...]] = ()
    """Options that distinguish this device from another of its kind; none: every required text."""

    @abstractmethod
    def open(self, timeout_s: float) -> Identity:
        """Connect, identify and start the data stream.

        Returns when the first good sample is there.

        Raises:
            DeviceError: not reachable, wrong device, unsupported, or not ready within `timeout_s`;
                nothing is left open.
        """

    @abstractmethod
    def health(self) -> Health:
        """How the data come in; never blocks, never raises."""

    @abstractmethod
    def fault(self) -> Fault | None:
        """The first fault since `open`, latched; None while sound. Staleness is a fault."""

    @abstractmethod
    def safe(self, timeout_s: float) -> None:
        """Put the device into its safe state; callable in any state, any number of times.

        Always sends, whatever state is believed.

        Raises:
            DeviceError: the device did not confirm within `timeout_s`.
        """

    @abstractmethod
    def close(self) -> None:
        """Give everything back (threads, processes, ports). Idempotent; never raises."""


class ForceSensor(Device):
    """A force or force–torque sensor."""

    rate_hz: float
    """Nominal sample rate; valid after `open`."""

    built_into_arm: ClassVar[bool] = False
    """Whether it is the same sensor as that of `Arm.has_force`: the two are then one channel."""

    @abstractmethod
    def drain(self) -> list[ForceSample]:
        """All samples that arrived since the last call, oldest first; none lost, none repeated."""

    def bias(self, timeout_s: float) -> bool:
        """Zero the device itself where it can; returns whether it did.

        The engine tares in software in any case and verifies the residual afterwards.
        """
        return False


class DisplacementSensor(Device):
    """A gauge that measures the approach of payload and plate directly, across the contact."""

    rate_hz: float

    @abstractmethod
    def drain(self) -> list[DisplacementSample]:
        """All samples that arrived since the last call, oldest first; none lost, none repeated."""


class Arm(Device):
    """A position-controlled axis. The only motion command is an absolute position target.

    A target is inherently bounded when the link dies: the arm goes there and holds.

    The pressing frame is right-handed: axis 3 points along the approach, axes 1 and 2 across it.
    With the tool down axis 1 is the base's -x and axis 2 its y; otherwise axis 2 is the base's y as
    far as it lies across the approach.
    """

    can_shift: bool = False
    """Whether `command` takes a `shift_m`. A class says what its arms can at best, an open arm what
    it can itself; only such an arm needs the parameter."""

    period_s: float
    """The arm's control period; the engine ticks at this period. Valid after `open`."""

    has_force: bool
    """Whether `ArmSample.force_n` is a real second force channel."""

    has_wrench: bool = False
    """Whether `ArmSample.wrench` reports that force along all three axes. A class says what its
    arms can at best, an open arm what it does itself."""

    SETTINGS_AT: ClassVar[Mapping[str, str]] = {}
    """Where a person changes what `configuration` reports, by its field, and under "safety" the
    limits that protect people: advice for setting the arm up."""

    @abstractmethod
    def drain(self) -> list[ArmSample]:
        """All samples that arrived since the last call, oldest first; none repeated."""

    @abstractmethod
    def command(self, position_m: float, shift_m: tuple[float, float] = (0.0, 0.0)) -> None:
        """Send one absolute target along the approach axis; returns at once.

        Args:
            position_m: travel from the start pose towards the plate.
            shift_m: travel from the start pose along axes 1 and 2 of the pressing frame. It is only
                for touches beside the axis, is limited as the travel
                is, and a retract keeps it. An arm that cannot shift refuses one.

        Raises:
            DeviceError: the command could not be handed over, or the shift is no number, beyond
                `LARGEST_SHIFT_M`, or too far ahead. (A latched fault does not prevent sending: a
                retract must always go out.)
        """

    @abstractmethod
    def retract(self, distance_m: float, speed_m_s: float, timeout_s: float) -> None:
        """Unload without the engine: back along the approach axis, never forth.

        From the measured position or the last target, whichever is further back: a measured
        position that has jumped, frozen or drifted must not become a push.

        Used by safing when the loop is gone. Blocks until there or `timeout_s`.

        Raises:
            DeviceError: not confirmed; its code says whether it may be requested again. Nothing
                moves an arm that a person or its safety system has taken over.
        """

    def held_m(self) -> float:
        """Travel at which the controller holds the arm: its own target, not what is measured.

        Asked before the first command of a run: where the measured position says something else, a
        command to stay there would move the arm. NaN: not reported, and no run begins. Valid after
        `open`; never blocks.
        """
        return math.nan

    def configuration(self) -> ArmConfiguration | None:
        """The configuration of the arm as of the newest sample; None: it does not report it.

        Valid after `open`; never blocks, never raises.
        """
        return None

    def prove_stop(self, distance_m: float, speed_m_s: float, timeout_s: float) -> StopProof | None:
        """Move slowly away from the plate, stop sending under way, and see the arm stop by itself.

        For free air only; the arm can be used afterwards. None: it has no watchdog of its own.

        Raises:
            DeviceError: it did not stop by itself; it was stopped.
        """
        return None
