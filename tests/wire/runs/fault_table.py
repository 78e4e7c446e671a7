"""Every fault of a UR controller, its link and of the force sensors: what a run makes of it.

One row of `ROWS` is one whole run. Which of the known faults (first column) which rows cover:

A UR controller and its link
  drop (FIN, RST)                        drop, drop rst
  controller away (refused)              refuse on
  data frozen, TCP up                    freeze on
  same package repeated                  repeat on
  blackhole (cable)                      blackhole on
  protective stop                        protective-stop
  emergency stop                         emergency-stop
  program killed, watchdog trip          kill-program; ignore-inputs on
  safeguard stop                         safeguard on
  not in remote control                  local on (before the run)
  script refused later                   local on + kill-program; emergency-stop (no retract taken)
  old controller 3.3                     version 3.3
  e-Series 5.0 to 5.3                    version 5.3
  CB3 3.15, e-Series 5.4                 version 3.15, version 5.4: sound
  speed slider                           slider 0.5, slider 0; slider 0.5 (before the run)
  payload or TCP changed                 payload 2, tcp 0 0 -0.0005
  local control, program goes on         local on
  clients served one by one              gap 0.002: sound
  PolyScope X                            version 10.7
  rate 50 Hz, jitter 20 ms               rate 50, jitter 0.02: counted
  NaN or random payload                  nan on, random on
  wrong type, wrong recipe id            wrong-type on; wrong-recipe on: sound
  short package                          short on
  wrong size                             wrong-size receive, wrong-size control
  registers in use, 2nd control object   claim 0 23; the second arm in test_run_faults.py
  no data at construction                freeze on (before the run)
  blackhole at construction              blackhole on (before the run)
  client killed -9                       host kill; the whole run in test_run_killed.py

Force sensors
  checksum, sync loss, lost on resync    bit_flip, noise, cut; noise:0.003, drop:0.05: counted
  app_took_too_long, overrange, invalid  status:0: counted; overrange, status:2, status:3
  overload above 120 %                   overrange (RFT)
  saturation, broken cable, status bits  overrange (ATI), status:4 to status:7; status:14: counted
  zero drift, offset after restart       drift, offset, restart
  tare touching, or lost on reboot       restart (RFT); tare touching: surface nearer than believed
  16 ms batches                          batch: sound
  stream lag by buffering                lag
  permanent all-zero readings            zero, freeze
  torn sample, reply out of step         torn; late (ATI): counted
  unplug, second reader, boot banner     unplug (slcan, socketcand, serial), second_reader, restart
  wrong divider or units                 wrong_model, gain
  stream taken by a second client        second_client (Net F/T)
  wrong sign, wrong axis                 gain:-1, swap; with a shake before the approach, too
  the emulators' other switches          silent, nan, clock_stop, clock_jump, wrap, late, deaf,
                                         refuse
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

BOTA, UART, CAN, ATI = "bota_serial", "robotous_uart", "robotous_can", "ati_can"
NET, LINE, WRIST = "ati_net", "line_serial", "ur_force"

RETRACTED = "retracted"
"""The run ends as stopped, the arm is off the surface."""
HELD = "held"
"""The run ends as stopped where nothing can or may move the arm any more; nothing pushes on."""
REFUSED = "refused"
"""A device does not open; nothing has moved."""
UNHARMED = "unharmed"
"""The run is completed; what was lost is counted."""


@dataclass(frozen=True)
class Row:
    """One fault in one run.

    `commands` go to the emulated rig; "host kill" ends the process of ur_rtde instead. They are
    given while the arm presses, or (`at_start`) before the run. `says` is a pattern for rule or
    fault code, and message. `counted`: error counter of the driver's health, or "lost". `always`
    rows run with every `make test`, the others with `make wire`.
    """

    commands: tuple[str, ...]
    end: str
    says: str = ""
    sensor: str = BOTA
    at_start: bool = False
    counted: str = ""
    always: bool = False
    rig: Mapping[str, Any] = field(default_factory=dict)

    @property
    def name(self) -> str:
        words = [" + ".join(self.commands) or "sound", *map(str, self.rig.values())]
        if self.sensor == WRIST:
            words.insert(0, WRIST)
        if self.at_start:
            words.append("at start")
        return " ".join(words)


def _arm(*commands: str, end: str = RETRACTED, says: str = "", **more: Any) -> Row:
    return Row(commands, end, says, **more)


def _sensor(name: str, fault: str, end: str = RETRACTED, says: str = "", **more: Any) -> Row:
    return Row((f"{name} {fault}",), end, says, sensor=name, **more)


_LINK_LOST = "(device|loop) .*the controller closed the connection"


def _flagged(code: str) -> str:
    """The sample's flag stops the run, or the driver refuses a target; it says which stop."""
    return (
        rf"(R4 arm: cannot follow.*; arm \(driver ur.*\): {code}|loop .*position target not sent)"
    )


_OLD = "(R3 arm: no new|R7 the arm was told to move|device .*stale: no new)"

ARM = (
    _arm("drop", says=_LINK_LOST, always=True),
    _arm("drop rst", says=_LINK_LOST),
    _arm("refuse on", end=HELD, says=_LINK_LOST),
    _arm("freeze on", says=_OLD),
    _arm("repeat on", says=_OLD),
    _arm("blackhole on", end=HELD, says=_OLD),
    _arm("protective-stop", end=HELD, says=_flagged("protective_stop")),
    _arm("emergency-stop", end=HELD, says=_flagged("emergency_stop")),
    _arm("safeguard on", end=HELD, says=_flagged("safeguard_stop")),
    _arm("kill-program", end=HELD, says=_flagged("program_stopped")),
    _arm("ignore-inputs on", end=HELD, says=_flagged("program_stopped")),
    _arm("local on", "kill-program", end=HELD, says=_flagged("not_remote")),
    _arm("local on", end=HELD, says="(device|R4|loop) .*(not_remote: somebody|target not sent)"),
    _arm("slider 0.5", says="device .*setting_changed: .*speed slider from 100 % to 50 %"),
    _arm("slider 0", end=HELD, says="device .*setting_changed: .*speed slider from 100 % to 0 %"),
    _arm("payload 2", says="setting_changed: .*payload mass from 0.000 kg to 2.000 kg"),
    _arm("tcp 0 0 -0.0005", says="setting_changed: .*TCP from"),
    _arm("gap 0.002", end=UNHARMED, at_start=True),
    _arm("rate 50", end=UNHARMED, counted="arm lost"),
    _arm("jitter 0.02", end=UNHARMED, counted="arm lost"),
    _arm("nan on", says="(device|loop) .*not.finite"),
    _arm("random on", says="(device|loop) .*(not.finite|out.of.range|clock)"),
    _arm("wrong-type on", says=_OLD),
    _arm("wrong-recipe on", end=UNHARMED),
    _arm("short on", says="(device|loop) .*(not.finite|out.of.range|clock)"),
    _arm("wrong-size receive", says="(device|loop) .*ur_rtde crashed"),
    _arm("wrong-size control", says="(device|loop) .*the controller closed the connection"),
    _arm("host kill", says="(device|loop) .*ur_rtde crashed"),
    _arm("local on", end=REFUSED, says="not_remote", at_start=True),
    _arm("slider 0.5", end=REFUSED, says="unsupported.*speed slider is at 50%", at_start=True),
    _arm("claim 0 23", end=REFUSED, says="refused_command.*in use", at_start=True),
    _arm("freeze on", end=REFUSED, says="not_connected", at_start=True),
    _arm("blackhole on", end=REFUSED, says="not_connected", at_start=True),
    _arm("nan on", end=REFUSED, says="not_finite", at_start=True),
    _arm("protective-stop", end=REFUSED, says="protective_stop", at_start=True),
    _arm("emergency-stop", end=REFUSED, says="emergency_stop", at_start=True),
    _arm("safeguard on", end=REFUSED, says="safeguard_stop", at_start=True),
    _arm(end=REFUSED, says="unsupported.*3.4", rig={"version": "3.3"}),
    _arm(end=REFUSED, says="unsupported.*5.0 to 5.3", rig={"version": "5.3"}),
    _arm(end=REFUSED, says="unsupported.*PolyScope X", rig={"version": "10.7"}),
    _arm(end=UNHARMED, rig={"version": "3.15", "arm_rate_hz": 125.0}),
    _arm(end=UNHARMED, rig={"version": "5.4"}),
)

_CORRUPT = "device .*corrupt: "
_SAME = r"(R4 force sensor: \d+ identical|device .*stale: .* the same to the last bit)"
_SILENT = r"(R3 force sensor: no new|device .*stale: .* newest sample)"
_GONE = "device .*not_connected"
_OVER = r"(R1|R2|R4 force sensor|R9 force jumped|device .*overload)"
_DISAGREES = "R5 the second channel"
_ZEROED = r"(R4 force sensor: \d+ identical|R9 force jumped|R2 force -)"
"""Exact zeros: what was tared away appears as a pull, which R2 sees grow."""
_WRONG_FORCE = "(R1|R2|R5|R9) "
_CLOCK = r"(R10 force sensor|device .*clock: )"
_BY_DEVICE = "(R4 force sensor: the device flags|device .*device_reports)"
_TCP = {"transport": "socketcand"}
_FAR = {"retract_m": 1e-3, "touch_force_n": 1.5}
"""A sensor that reads a tenth is touched, as it seems, half a millimetre late."""

SENSORS = (
    _sensor(BOTA, "bit_flip:0.3", says=_CORRUPT),
    _sensor(BOTA, "noise:0.3", says=_CORRUPT),
    _sensor(BOTA, "cut:0.3", says=_CORRUPT),
    _sensor(BOTA, "noise:0.003", UNHARMED, counted="checksum"),
    _sensor(BOTA, "drop:0.05", UNHARMED, counted="lost"),
    _sensor(BOTA, "status:0", UNHARMED, counted="app_took_too_long"),
    _sensor(BOTA, "overrange:2", says=_OVER),
    _sensor(BOTA, "status:2", says=_BY_DEVICE),
    _sensor(BOTA, "status:3", says=_BY_DEVICE),
    _sensor(BOTA, "silent", says=_SILENT),
    _sensor(BOTA, "freeze", says=_SAME),
    _sensor(BOTA, "zero", says=_ZEROED),
    _sensor(BOTA, "nan", says="(R4 force sensor|device .*not_finite)"),
    _sensor(BOTA, "unplug", says=f"{_GONE}: serial port"),
    _sensor(BOTA, "second_reader:0.3", says=f"({_CORRUPT}|{_GONE}: serial port)"),
    _sensor(BOTA, "restart", says=_CLOCK),
    _sensor(BOTA, "clock_stop", says=_CLOCK),
    _sensor(BOTA, "clock_jump:30", says=_CLOCK),
    _sensor(BOTA, "wrap:3", UNHARMED, at_start=True),
    _sensor(BOTA, "drift:-600", says=_DISAGREES),
    _sensor(BOTA, "drift:600", says=_WRONG_FORCE),
    _sensor(BOTA, "offset:-20", says=_WRONG_FORCE),
    _sensor(BOTA, "offset:20", says=_WRONG_FORCE),
    _sensor(BOTA, "gain:0.4", says=_DISAGREES, at_start=True),
    _sensor(BOTA, "gain:-1", says="R11 .*the sign of force.axis is wrong", at_start=True),
    _sensor(BOTA, "swap", says="R11 .*force.axis names the wrong axis", at_start=True),
    _sensor(BOTA, "batch:0.004", UNHARMED),
    _sensor(BOTA, "lag:0.8", says=f"({_DISAGREES}|R10 force sensor|device .*clock: )"),
    _sensor(BOTA, "batch:0.016", UNHARMED),
    _sensor(BOTA, "late:0.015", UNHARMED),
    _sensor(BOTA, "deaf", REFUSED, says="not_connected", at_start=True),
    _sensor(BOTA, "refuse", REFUSED, says="refused_command", at_start=True),
    _sensor(UART, "bit_flip:0.3", says=_CORRUPT),
    _sensor(UART, "noise:0.3", says=_CORRUPT),
    _sensor(UART, "cut:0.3", says=_CORRUPT),
    _sensor(UART, "overrange:2", says=_OVER),
    _sensor(UART, "silent", says=_SILENT),
    _sensor(UART, "freeze", says=_SAME),
    _sensor(UART, "zero", says=_ZEROED),
    _sensor(UART, "unplug", says=f"{_GONE}: serial port", always=True),
    _sensor(UART, "second_reader:0.3", says=f"({_CORRUPT}|{_GONE}: serial port)"),
    _sensor(UART, "restart", says=_SILENT),
    _sensor(UART, "gain:0.4", says=_DISAGREES, at_start=True),
    _sensor(UART, "lag:0.8", says=_DISAGREES),
    _sensor(UART, "batch:0.016", UNHARMED),
    _sensor(UART, "wrong_model", REFUSED, says="unsupported", at_start=True),
    _sensor(UART, "deaf", REFUSED, says="not_connected", at_start=True),
    _sensor(UART, "refuse", REFUSED, says="refused_command", at_start=True),
    _sensor(CAN, "torn:0.5", says=_CORRUPT),
    _sensor(CAN, "torn:0.003", UNHARMED, counted="orphans"),
    _sensor(CAN, "bit_flip:0.3", says=_CORRUPT),
    _sensor(CAN, "overrange:2", says=_OVER),
    _sensor(CAN, "restart", says=_SILENT),
    _sensor(CAN, "unplug", says=f"{_GONE}: CAN bus"),
    _sensor(CAN, "unplug", says=f"{_GONE}: CAN bus", rig=_TCP),
    _sensor(CAN, "silent", says=_SILENT, rig=_TCP),
    _sensor(ATI, "overrange:3", says=_OVER),
    _sensor(ATI, "status:4", says=_BY_DEVICE),
    _sensor(ATI, "status:5", says=_BY_DEVICE),
    _sensor(ATI, "status:6", says=_BY_DEVICE),
    _sensor(ATI, "status:7", says=_BY_DEVICE),
    _sensor(ATI, "status:14", UNHARMED, counted="status_bits"),
    _sensor(ATI, "restart", UNHARMED, counted="status_bits"),
    _sensor(ATI, "torn:0.5", says=_CORRUPT),
    _sensor(ATI, "late:0.03", UNHARMED, counted="resyncs"),
    _sensor(ATI, "drop", says=_SILENT),
    _sensor(ATI, "freeze", says=_SAME),
    _sensor(ATI, "zero", says=_ZEROED),
    _sensor(ATI, "wrong_model", says=_DISAGREES, at_start=True, rig=_FAR),
    _sensor(ATI, "lag:0.8", says=f"({_DISAGREES}|{_SILENT})"),
    _sensor(ATI, "unplug", says=f"{_GONE}: CAN bus"),
    _sensor(ATI, "unplug", says=f"{_GONE}: CAN bus", rig=_TCP),
    _sensor(NET, "drop:0.05", UNHARMED, counted="lost"),
    _sensor(NET, "status:16", UNHARMED, counted="status_bits"),
    _sensor(NET, "batch:0.016", UNHARMED),
    _sensor(NET, "wrap:3", UNHARMED, at_start=True),
    _sensor(NET, "cut:0.3", says=_CORRUPT),
    _sensor(NET, "second_client", says=_SILENT),
    _sensor(NET, "silent", says=_SILENT),
    _sensor(NET, "restart", says=_SILENT),
    _sensor(NET, "unplug", says=f"({_SILENT}|{_GONE}: UDP)"),
    _sensor(NET, "freeze", says=_SAME),
    _sensor(NET, "zero", says=_ZEROED),
    _sensor(NET, "overrange:2", says=_OVER),
    _sensor(NET, "status:17", says=_OVER),
    _sensor(NET, "status:28", says=_BY_DEVICE),
    _sensor(NET, "offset:-20", says=_WRONG_FORCE),
    _sensor(NET, "drift:-600", says=_DISAGREES),
    _sensor(NET, "gain:0.4", says=_DISAGREES, at_start=True),
    _sensor(NET, "lag:0.8", says=f"({_DISAGREES}|R10 force sensor|device .*clock: )"),
    _sensor(NET, "clock_stop", says=_CLOCK),
    _sensor(NET, "clock_jump:30", says=_CLOCK),
    _sensor(NET, "wrong_model", says=_DISAGREES, at_start=True, rig=_FAR),
    _sensor(NET, "deaf", REFUSED, says="not_connected", at_start=True),
    _sensor(NET, "refuse", REFUSED, says="refused_command", at_start=True),
    _sensor(LINE, "noise:1", says=_CORRUPT),
    _sensor(LINE, "cut:0.5", says=f"({_CORRUPT}|{_SILENT})"),
    _sensor(LINE, "nan", says=f"({_CORRUPT}|{_SILENT})"),
    _sensor(LINE, "silent", says=_SILENT),
    _sensor(LINE, "freeze", says=_SAME),
    _sensor(LINE, "overrange:2", says=_OVER),
    _sensor(LINE, "unplug", says=f"{_GONE}: serial port"),
    _sensor(LINE, "offset:-20", says=_WRONG_FORCE),
    _sensor(LINE, "drift:-600", says=_DISAGREES),
    _sensor(LINE, "gain:0.4", says=_DISAGREES, at_start=True),
    _sensor(LINE, "drop:0.01", UNHARMED),
    _arm(end=UNHARMED, sensor=WRIST),
    _arm("freeze on", says=f"({_OLD}|{_SILENT})", sensor=WRIST),
    _arm("drop", says=f"({_LINK_LOST}|{_GONE}|{_SILENT})", sensor=WRIST),
    _arm("emergency-stop", end=HELD, says="(R4|device )", sensor=WRIST),
    _arm(
        end=REFUSED,
        says="unsupported.*3.15",
        sensor=WRIST,
        rig={"version": "3.15", "arm_rate_hz": 125.0},
    ),
)

ROWS = ARM + SENSORS
