"""`stepload emulate ur`: the UR controller emulator on the command line."""

from __future__ import annotations

from typing import Annotated

import typer

from stepload.errors import BadInputError
from stepload_verify.emulators.ur_faults import HELP


def emulate_ur(
    host: Annotated[str, typer.Option(help="loopback address to serve")] = "127.0.0.2",
    version: Annotated[str, typer.Option(help="PolyScope version, e.g. 3.15 or 5.12")] = "5.12.6.0",
    model: Annotated[str, typer.Option(help="arm model the dashboard tells")] = "UR5",
    serial_number: Annotated[str, typer.Option(help="serial number")] = "20235500001",
    approach: Annotated[
        tuple[float, float, float], typer.Option(help="approach direction, base frame")
    ] = (0.0, 0.0, -1.0),
    surface_mm: Annotated[
        float | None, typer.Option(help="travel to the payload in mm; not given: free air")
    ] = None,
    payload_k: Annotated[float, typer.Option(help="K of the payload in N/m^n")] = 6.57e8,
    payload_n: Annotated[float, typer.Option(help="n of the payload")] = 1.5,
    system_stiffness: Annotated[float, typer.Option(help="K_s of the arm in N/m")] = 1e5,
    fault: Annotated[
        list[str] | None, typer.Option(help="fault from the start, as on standard input; repeat")
    ] = None,
    protective_stop_ends_program: Annotated[
        bool, typer.Option(help="the other reading of a protective stop")
    ] = False,
) -> None:
    """Emulate a UR controller on a loopback address, until `quit` or Ctrl+C."""
    from stepload_verify.emulators.ur_emulator import parse_version, run_ur_emulator
    from stepload_verify.emulators.ur_world import Axis, FreeAirAxis

    axis: Axis = FreeAirAxis()
    if surface_mm is not None:
        from stepload.rig.world import PayloadTruth
        from stepload_drivers.sim.live import damping
        from stepload_verify.emulators.ur_world import axis_in_world

        axis = axis_in_world(
            surface_m=surface_mm * 1e-3,
            payload=PayloadTruth("smooth", payload_k, payload_n),
            system_stiffness_n_per_m=system_stiffness,
            system_damping_n_s_per_m=damping(system_stiffness, 5.0),
            effective_mass_kg=5.0,
        )
    try:
        run_ur_emulator(
            host,
            version=parse_version(version),
            direction=approach,
            axis=axis,
            serial_number=serial_number,
            model=model,
            commands=fault or (),
            protective_stop_ends_program=protective_stop_ends_program,
        )
    except (ValueError, OSError) as error:
        raise BadInputError(
            f"emulate ur: {error}", hint="see `stepload emulate ur --help`"
        ) from error
    except KeyboardInterrupt:
        return


def register(app: typer.Typer) -> None:
    """Add `ur` to the `emulate` commands; its help ends with the fault commands."""
    text = f"{emulate_ur.__doc__}\n\nCommands on standard input, and for --fault:\n\n\b\n{HELP}"
    app.command("ur", help=text)(emulate_ur)
