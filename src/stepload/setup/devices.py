"""The first two steps: which arm, which force sensor, and whether they answer."""

from __future__ import annotations

import logging
import math
from collections.abc import Mapping
from contextlib import suppress

from stepload.declaration.sections import keys
from stepload.errors import BadInputError, RefusedError
from stepload.plan.load import profiles
from stepload.plan.references import data_sheets, names_a_file, read_data_sheet, read_profile
from stepload.plan.source import read_source
from stepload.rig.device import ArmConfiguration, Identity
from stepload.rig.plugins import load_driver
from stepload.setup.bench import ARMS, FORCE, SECOND, SENSORS, Setup, listen
from stepload.setup.state import Found
from stepload.setup.yaml_keys import Value, flat, quoted
from stepload.units import parse_quantity, percent

RATE_TOLERANCE = 0.05
NO_ADAPTERS = ("virtual", "udp_multicast", "serial", "socketcand")
"""Not plugged in, or any serial port; the last one listens to the network for four seconds."""
NOT_TOLD = "it does not tell: look at the pendant"


def arm(setup: Setup) -> Found:
    """The arm answers, and is what its profile describes; its settings are shown."""
    ask = setup.answers
    driver = ask.text("arm")
    declared = {key.name for key in keys(load_driver(ARMS, driver).OPTIONS)}
    values = {"name": setup.stated("name"), "arm.driver": setup.stated("arm")}
    if "host" in declared:
        values["arm.options.host"] = setup.stated("host")
    if "approach" in declared:
        values["arm.options.approach"] = Value(ask.text("approach"), setup.you)
    values |= _options(setup, "arm", ARMS, driver, "arm_options")
    with setup.opened(values, False) as bench:
        identity, told = bench.identities["arm"], bench.arm.configuration()
        rate_hz = 1.0 / bench.arm.period_s
        where = type(bench.arm).SETTINGS_AT
    setup.tell(f"the arm answers: {identity.model} {identity.serial_number}, {identity.firmware}")
    for line in _settings(told, where):
        setup.tell(f"  {line}")
    setup.tell(
        "  safety limits: this program does not read them from the arm; "
        + where.get("safety", "see the manual of the arm")
    )
    ask.consent("limits_set")
    base = _profile(setup, identity, rate_hz)
    if identity.serial_number and "serial_number" in declared:
        values["arm.options.serial_number"] = Value(
            f'"{identity.serial_number}"', f"told by the arm, {setup.today}"
        )
    return Found(
        {**{k: v for k, v in base.items() if not k.startswith("force.")}, **values},
        (f"{identity.model} {identity.serial_number}, {identity.firmware}",
         *_settings(told, {})),
    )  # fmt: skip


def _settings(told: ArmConfiguration | None, where: Mapping[str, str]) -> list[str]:
    """The arm's settings, a line each, with where a person changes them."""
    shown: dict[str, str] = {}
    told = told or ArmConfiguration()
    if told.tcp_offset is not None:
        shown["tcp_offset"] = f"TCP from the flange {_millimetres(told.tcp_offset)} mm"
    if told.payload_kg is not None:
        at = f" at {_millimetres(told.payload_cog_m)} mm" if told.payload_cog_m else ""
        shown["payload_kg"] = f"payload {told.payload_kg:.3g} kg{at}"
    if told.speed_fraction is not None:
        shown["speed_fraction"] = f"speed slider {percent(told.speed_fraction, 2)}"
    names = {"tcp_offset": "TCP", "payload_kg": "payload", "speed_fraction": "speed slider"}
    return [
        shown.get(key, f"{name}: {NOT_TOLD}")
        + (f"; changed at {place}" if (place := where.get(key)) else "")
        for key, name in names.items()
    ]


def _millimetres(way_m: tuple[float, ...]) -> str:
    return ", ".join(f"{1e3 * part:.1f}" for part in way_m[:3])


def _profile(setup: Setup, identity: Identity, rate_hz: float) -> dict[str, Value]:
    """The values of the arm's profile, which must be of an arm of this rate."""
    wanted, known = setup.answers.text("arm_profile"), profiles()
    model = identity.model.lower()
    name = next((n for n in (model, f"{model}e") if n in known), "") if wanted == "auto" else wanted
    if name not in known:
        raise BadInputError(
            f"the arm says that it is {identity.model!r}: no profile has its figures"
            if wanted == "auto" else f"{wanted!r} is no profile",
            hint=f"--arm-profile, one of {', '.join(known)}",
        )  # fmt: skip
    values = flat(read_profile(name), f"default of profile {name}")
    planned_hz = parse_quantity(values["arm.rate"].text, "Hz")
    if math.fabs(rate_hz / planned_hz - 1.0) > RATE_TOLERANCE:
        raise RefusedError(
            f"the profile {name} is of an arm at {planned_hz:g} Hz, this one runs at"
            f" {rate_hz:g} Hz",
            hint="it is another generation of arm: write its rig file by hand (docs/plan.md)",
        )
    return {key: value for key, value in values.items() if key != "name"}


def _options(setup: Setup, key: str, group: str, driver: str, question: str) -> dict[str, Value]:
    """Further options of a driver, as they were answered."""
    texts = {each.name for each in keys(load_driver(group, driver).OPTIONS) if each.is_text}
    return {
        f"{key}.options.{name}": Value(quoted(text) if name in texts else text, setup.you)
        for name, text in setup.answers.words(question).items()
    }


def sensor(setup: Setup) -> Found:
    """The force sensor answers, and the second channel is chosen."""
    ask, before = setup.answers, setup.state.values
    for what, found in (("serial ports", serial_ports()), ("CAN adapters", can_adapters())):
        setup.tell(f"{what}: {'; '.join(found) or 'none found'}")
    setup.tell(f"data sheets: {', '.join(data_sheets())}")
    values = _sensor(setup, FORCE, "sensor", "sensor_options")
    source = ask.text("second")
    values["second_force.source"] = Value(source, setup.you)
    if source == "sensor":
        values |= _sensor(setup, SECOND, "second_sensor", "second_options")
    values |= {key: Value(text, setup.you) for key, text in ask.words("keys").items()}
    notes = []
    with setup.opened(before | values, True) as bench:
        if source == "arm" and not bench.arm.has_force:
            raise RefusedError(
                "the arm has no force of its own that could check the sensor",
                hint="--second sensor, or --second none for payloads that may be pressed without",
            )
        received = listen(bench, 1.0)
        for key in bench.sensors:
            force_n = received.forces_n(key)
            identity = bench.identities[key]
            notes.append(f"{key}: {identity.model} {identity.serial_number}".rstrip())
            setup.tell(f"{notes[-1]} answers: {len(force_n)} readings in 1 s")
            driver = values[f"{key}.driver"].text
            options = {key.name: key.info for key in keys(load_driver(SENSORS, driver).OPTIONS)}
            told = options.get("serial_number")
            if told is not None and told.default == "" and identity.serial_number:
                values[f"{key}.options.serial_number"] = Value(
                    f'"{identity.serial_number}"', f"told by the sensor, {setup.today}"
                )
    return Found(values, notes)


def _sensor(setup: Setup, key: str, question: str, options: str) -> dict[str, Value]:
    """Driver, figures and address of one sensor."""
    name = setup.answers.text(question)
    if names_a_file(name):
        sheet = flat(read_source(setup.rig.parent / name), f"your data sheet {name}")
    elif name in data_sheets():
        sheet = flat(read_data_sheet(name), f"data sheet {name}")
        sheet = {"profile": Value(name, setup.you), **sheet}
    else:
        raise BadInputError(
            f"{name!r} is no data sheet of a force sensor",
            hint=f"one of {', '.join(data_sheets())}, or a file: a path that ends in .yaml;"
            f" --{question.replace('_', '-')} gives another answer",
        )
    if "driver" not in sheet:
        raise BadInputError(f"{name}: no `driver`", hint="see the data sheets of stepload")
    if "axis" in sheet:
        raise BadInputError(
            f"{name}: `axis` is on no data sheet", hint="leave it out: a push by hand tells it"
        )
    values = {f"{key}.{part}": value for part, value in sheet.items()}
    return values | _options(setup, key, SENSORS, sheet["driver"].text, options)


def serial_ports() -> list[str]:
    """Serial ports, each with its adapter's description; those without an adapter last."""
    from serial.tools import list_ports

    found = sorted(list_ports.comports(), key=lambda port: (port.vid is None, port.device))
    return [f"{port.device} ({port.description})" for port in found]


def can_adapters() -> list[str]:
    """CAN adapters that python-can sees, as interface and channel; virtual ones left out."""
    import can

    logging.getLogger("can").setLevel(logging.CRITICAL)  # it names every library that is not there
    requested = sorted(can.VALID_INTERFACES - set(NO_ADAPTERS))
    found: list[str] = []
    with suppress(Exception):  # an adapter's library that is half installed fails in its own way
        found += [
            f"{seen['interface']} {seen['channel']}"
            for seen in can.detect_available_configs(interfaces=requested)
        ]
    return found
