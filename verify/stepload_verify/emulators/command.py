"""`stepload emulate …`: one emulated device, or a rig of them around one contact world."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer

from stepload.errors import BadInputError
from stepload_drivers.streamed import prefer_this_thread
from stepload_verify.emulators import ur_command
from stepload_verify.emulators.faults import FAULTS, FaultBoard, parse_fault


@contextmanager
def port_link(path: Path, address: str) -> Iterator[None]:
    """`path` leads to `address` inside `with`; a link left behind by a dead emulator is replaced.

    Raises:
        BadInputError: there is something at `path` already, or it cannot be made.
    """
    if not address.startswith("/dev/"):
        raise BadInputError(
            f"--link {path}: the emulator has no port but the address {address}",
            hint="leave --link out and use the address",
        )
    if path.is_symlink() and not path.exists():
        path.unlink()
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.symlink_to(address)
    except FileExistsError as error:
        raise BadInputError(
            f"--link {path}: is there already",
            hint="end the emulator that uses it, or take another name",
        ) from error
    except OSError as error:
        raise BadInputError(f"--link {path}: {error}", hint="take another name") from error
    try:
        yield
    finally:
        if path.is_symlink() and str(path.readlink()) == address:
            path.unlink()


app = typer.Typer(
    rich_markup_mode=None,
    help="Emulated devices: their wire protocol on loopback or a pseudo-terminal.\n\n"
    "Each prints what a driver has to be given, then runs until Ctrl+C. Faults can be switched on "
    "with --fault, or by the same text as a line on standard input; `clear` ends them, `quit` "
    "ends the emulator.",
    no_args_is_help=True,
    add_completion=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)

FAULT_HELP = "NAME[:MAGNITUDE][@START][+DURATION] (s); NAME one of " + ", ".join(FAULTS)
Fault = Annotated[list[str] | None, typer.Option("--fault", help=FAULT_HELP)]
Peak = Annotated[float, typer.Option("--peak", help="Peak of the measured force, N.")]
Axis = Annotated[str, typer.Option("--axis", help="Wrench component that grows when pressing.")]
Serial = Annotated[str, typer.Option("--serial-number", help="Serial number that it tells.")]
UntilEof = Annotated[bool, typer.Option("--until-eof", help="End when standard input closes.")]
Transport = Annotated[str, typer.Option(help="slcan (on a pty) or socketcand (TCP).")]
Port = Annotated[int, typer.Option(help="TCP port for socketcand; 0: any free one.")]


def _run(
    name: str, faults: list[str] | None, peak_n: float, axis: str, until_eof: bool, **options: Any
) -> None:
    from stepload_verify.emulators.catalog import EMULATORS, driver_options
    from stepload_verify.emulators.physics import Sine, WrenchSource
    from stepload_verify.emulators.service import serve

    board = FaultBoard(tuple(parse_fault(text) for text in faults or ()))
    source = WrenchSource(Sine(peak_n), axis)
    prefer_this_thread()
    with EMULATORS[name](source, board, **options) as emulator:
        greeting = json.dumps({"driver": name, "options": driver_options(emulator)})
        serve(board, [greeting], typer.echo, until_eof=until_eof)


@app.command()
def bota(
    fault: Fault = None,
    peak: Peak = 10.0,
    axis: Axis = "+fz",
    serial_number: Serial = "EMULATED",
    until_eof: UntilEof = False,
) -> None:
    """Bota SensONE on a pseudo-terminal."""
    _run("bota_serial", fault, peak, axis, until_eof, serial_number=serial_number)


@app.command("robotous-uart")
def robotous_uart(
    fault: Fault = None,
    peak: Peak = 10.0,
    axis: Axis = "+fz",
    serial_number: Serial = "EMULATED",
    model: Annotated[str, typer.Option(help="Model name.")] = "RFT64-SB01",
    until_eof: UntilEof = False,
) -> None:
    """ROBOTOUS RFT on a pseudo-terminal."""
    _run("robotous_uart", fault, peak, axis, until_eof, serial_number=serial_number,
         model_name=model)  # fmt: skip


@app.command("robotous-can")
def robotous_can(
    fault: Fault = None,
    peak: Peak = 10.0,
    axis: Axis = "+fz",
    serial_number: Serial = "EMULATED",
    model: Annotated[str, typer.Option(help="Model name.")] = "RFT64-SB01",
    transport: Transport = "slcan",
    port: Port = 0,
    until_eof: UntilEof = False,
) -> None:
    """ROBOTOUS RFT on CAN."""
    _run("robotous_can", fault, peak, axis, until_eof, serial_number=serial_number,
         model_name=model, transport=transport, port=port)  # fmt: skip


@app.command()
def ati(
    fault: Fault = None,
    peak: Peak = 10.0,
    axis: Axis = "+fz",
    serial_number: Serial = "EMULATED",
    transport: Transport = "slcan",
    port: Port = 0,
    until_eof: UntilEof = False,
) -> None:
    """ATI NETCANOEM on CAN."""
    _run("ati_can", fault, peak, axis, until_eof, serial_number=serial_number,
         transport=transport, port=port)  # fmt: skip


@app.command("ati-net")
def ati_net(
    fault: Fault = None,
    peak: Peak = 10.0,
    axis: Axis = "+fz",
    serial_number: Serial = "EMULATED",
    rate: Annotated[float, typer.Option(help="Records per second, up to 7000.")] = 1000.0,
    until_eof: UntilEof = False,
) -> None:
    """ATI Net F/T: RDT over UDP, settings over HTTP."""
    _run("ati_net", fault, peak, axis, until_eof, serial_number=serial_number, rate_hz=rate)


@app.command()
def gauge(
    fault: Fault = None,
    peak: Peak = 10.0,
    rate: Annotated[float, typer.Option(help="Readings per second.")] = 10.0,
    request: Annotated[str, typer.Option(help="What asks for a reading; empty: streams.")] = "",
    unit: Annotated[str, typer.Option(help="Unit of the number: mm, um, in, …")] = "mm",
    until_eof: UntilEof = False,
) -> None:
    """Digital gauge on a pseudo-terminal; it feels 1 µm per newton."""
    requested = request.replace("\\r", "\r").replace("\\n", "\n").encode("ascii")
    _run("gauge_serial", fault, peak, "+fz", until_eof, rate_hz=rate, request=requested, unit=unit)


@app.command()
def line(
    fault: Fault = None,
    peak: Peak = 10.0,
    axis: Axis = "+fz",
    rate: Annotated[float, typer.Option(help="Readings per second.")] = 100.0,
    request: Annotated[str, typer.Option(help="What asks for a reading; empty: streams.")] = "",
    unit: Annotated[str, typer.Option(help="Unit of the number: N, kN, kgf, lbf, …")] = "N",
    until_eof: UntilEof = False,
) -> None:
    """Load cell with lines of text on a pseudo-terminal; `Z` and CR zero it."""
    _run("line_serial", fault, peak, axis, until_eof, rate_hz=rate, request=request, unit=unit)


@app.command()
def rig(
    world: Annotated[Path | None, typer.Option(help="World as JSON; default: a stiff rig.")] = None,
    sensor: Annotated[
        list[str] | None, typer.Option("--sensor", help="Driver name of a sensor to emulate.")
    ] = None,
    fault: Annotated[list[str] | None, typer.Option("--fault", help=f"DRIVER={FAULT_HELP}")] = None,
    ur: Annotated[str, typer.Option(help="Loopback address of an emulated UR arm.")] = "",
    approach: Annotated[
        tuple[float, float, float], typer.Option(help="Approach direction of the arm, base frame.")
    ] = (0.0, 0.0, -1.0),
    link: Annotated[
        list[str] | None,
        typer.Option("--link", help="DRIVER=PATH: a name of its own for a sensor's port."),
    ] = None,
    transport: Transport = "slcan",
    ur_version: Annotated[str, typer.Option(help="PolyScope version of the arm.")] = "5.12.6.0",
    until_eof: UntilEof = False,
) -> None:
    """Sensors and a UR arm around one contact world, in real time.

    With --ur, standard input takes the commands of `emulate ur`, and a sensor's faults as
    DRIVER FAULT; `DRIVER clear` ends them. --fault ur=COMMAND gives the arm a command at the start.
    """
    from stepload.rig.world import DEFAULT_SPEC
    from stepload_verify.emulators.catalog import driver_options
    from stepload_verify.emulators.live_rig import LiveRig, load_spec
    from stepload_verify.emulators.service import obey, serve

    sensors = tuple(sensor or ("bota_serial",))
    faults = _faults_by_driver(sensors, fault or [])
    commands = faults.pop("ur")
    if commands and not ur:
        raise BadInputError(f"--fault ur={commands[0]}: no arm here", hint="add --ur ADDRESS")
    boards = {
        name: FaultBoard(tuple(parse_fault(text) for text in texts))
        for name, texts in faults.items()
    }
    live = LiveRig(load_spec(world) if world else DEFAULT_SPEC, sensors, boards, transport)
    links = [text.partition("=") for text in link or ()]
    with ExitStack() as stack:
        for name, _, path in links:
            if name not in live.emulators or not path:
                raise BadInputError(
                    f"--link {name}={path}", hint=f"DRIVER=PATH, DRIVER one of {', '.join(sensors)}"
                )
            stack.enter_context(port_link(Path(path), live.emulators[name].address))
        prefer_this_thread()
        live.start()
        stack.callback(live.stop)
        greeting = [
            json.dumps({"driver": name, "options": driver_options(emulator)})
            for name, emulator in live.emulators.items()
        ]
        if ur:
            from stepload_verify.emulators.ur_emulator import parse_version, run_ur_emulator

            typer.echo("\n".join(greeting))
            others = {name: partial(obey, board) for name, board in boards.items()}
            try:
                run_ur_emulator(
                    ur,
                    version=parse_version(ur_version),
                    direction=approach,
                    axis=live.axis,
                    tool=live.tool,
                    commands=commands,
                    until_eof=until_eof,
                    others=others,
                )
            except (ValueError, OSError) as error:
                raise BadInputError(
                    f"emulate rig --ur {ur}: {error}",
                    hint="the UR protocol fixes the ports: take an address of 127.0.0.0/8 that no "
                    "other emulator uses",
                ) from error
            except KeyboardInterrupt:
                return
        else:
            serve(boards[sensors[0]], greeting, typer.echo, until_eof=until_eof)


def _faults_by_driver(sensors: tuple[str, ...], faults: list[str]) -> dict[str, list[str]]:
    """Texts of `DRIVER=FAULT` by driver, "ur" among them; no driver: the first sensor.

    Raises:
        BadInputError: a driver that is not emulated.
    """
    found: dict[str, list[str]] = {name: [] for name in (*sensors, "ur")}
    for text in faults:
        driver, equals, rest = text.partition("=")
        if not equals:
            driver, rest = sensors[0], text
        if driver not in found:
            raise BadInputError(
                f"--fault {text}: no {driver!r} here", hint=f"one of {', '.join(found)}"
            )
        found[driver].append(rest)
    return found


ur_command.register(app)
