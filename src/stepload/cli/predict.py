"""The verb `predict`: the curve of a payload by theory or finite elements."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Argument, Option

from stepload.cli.options import Plastic, Rough, Surface, TipRadius, quantity
from stepload.errors import BadInputError
from stepload.report.terminal import AsJson, Output

if TYPE_CHECKING:
    from collections.abc import Iterator

    from stepload.feasibility.predicted import Prediction
    from stepload.plan.model import Payload


def predict(
    payload: Annotated[Path, Argument(help="Payload file, or a plan.", show_default=False)],
    rough: Rough = False,
    plastic: Plastic = False,
    surface: Surface = None,
    tip_radius: TipRadius = None,
    to: Annotated[
        float | None, quantity("--to", "N", 'Highest force, "300 N"; else top force, or limit.')
    ] = None,
    csv: Annotated[Path | None, Option(help="Write the curve to a new CSV file.")] = None,
    plot: Annotated[Path | None, Option(help="Draw it into a new SVG or PNG file.")] = None,
    no_mesh: Annotated[bool, Option("--no-mesh", help="As on a half-space.")] = False,
    as_json: AsJson = False,
) -> None:
    """Predict force against deformation of a payload; nothing is moved.

    A shape of finite size is meshed once and kept; preflight then uses that curve.

    Example: stepload predict procedures/payloads/plastic-sphere.yaml --to "300 N" --rough
    """
    from stepload.feasibility import predicted
    from stepload.plan.room_to_write import check_new
    from stepload.report.tip_factors import tip_factors

    output = Output(as_json=as_json)
    if plot is not None and plot.suffix.lower() not in (".svg", ".png"):
        raise BadInputError(f"--plot {plot}", hint="a file that ends in .svg or .png")
    for flag, path in (("--csv", csv), ("--plot", plot)):
        if path is not None:
            check_new(flag, path)
    body, to_n = _asked(payload, to)
    factors = tip_factors(body, rough=rough, plastic=plastic, surface=surface, radius_m=tip_radius)
    found = predicted.predict(body, to_n, factors=factors, mesh=not no_mesh)
    heads, rows = _curve(found)
    output.table(f"{body.name}, {found.theory}", heads, rows)
    figures = list(_figures(body, found))
    output.table("Figures", ("figure", "value", "note"), figures)
    if csv is not None:
        lines = [f"# {factors.note}"] if factors is not None else []
        lines += ["displacement_m,force_n"]
        curve = zip(found.deformation_m.tolist(), found.force_n.tolist(), strict=True)
        lines += [f"{deformation!r},{force!r}" for deformation, force in curve]
        csv.write_text("\n".join(lines) + "\n", encoding="utf-8")
        output.line(f"written: {csv}")
    if plot is not None:
        _draw(plot, body, found)
        output.line(f"written: {plot}")
    output.result(_data(body, found))


def _asked(path: Path, to_n: float | None) -> tuple[Payload, float]:
    """The payload of a file, and the highest force."""
    from stepload.feasibility.theory import theory_of
    from stepload.plan.load import load_payload, load_plan
    from stepload.plan.references import tree_of
    from stepload.plan.tree import Mapping

    root = tree_of(path)
    if isinstance(root, Mapping) and "procedure" in root.entries:
        plan = load_plan(path)
        return plan.payload, plan.procedure.top_force_n if to_n is None else to_n
    payload = load_payload(path)
    return payload, theory_of(payload).elastic_limit_n if to_n is None else to_n


def _curve(found: Prediction) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    from stepload.units import format_quantity as f

    heads: tuple[str, ...] = ("force", "deformation")
    columns = [
        [f(n, "N") for n in found.force_n.tolist()],
        [f(m, "m", 4) for m in found.deformation_m.tolist()],
    ]
    if (mesh := found.mesh) is not None:
        heads += ("contact radius", "von Mises")
        columns += [[f(m, "m") for m in mesh.contact_radius_m]]
        columns += [[f(pa, "Pa") for pa in mesh.mises_pa]]
    return heads, list(zip(*columns, strict=True))


def _figures(payload: Payload, found: Prediction) -> Iterator[tuple[str, str, str]]:
    from stepload.contact.limit import elastic_limit
    from stepload.contact.material_range import is_range
    from stepload.units import format_quantity as f
    from stepload.units import percent

    fit, mesh = found.fit, found.mesh
    yield "K", f"{fit.k:.3g} N/m^n", "RS-BTLS (25)"
    yield "n", f"{fit.n:.4g}", ""
    yield "secant", f(fit.secant_n_per_m, "N/m"), f"at {f(fit.secant_force_n, 'N')} (28)"
    onset = elastic_limit(payload.geometry, payload.material, payload.plate)
    if onset is not None:
        yield "F_c", f(onset.force_n, "N"), "(13), of the tip"
    if is_range(payload.material) or is_range(payload.plate):
        yield "material", "a range", "the curve is that of its middle"
    if found.hertz_share is not None and found.hertz_share > 1e-6:
        yield "off Hertz", percent(found.hertz_share, 2), "of the highest force, smooth, (7)"
    if mesh is None or found.coarse is None:
        return
    if mesh.yield_force_n is not None:
        yield "von Mises at Y", f(mesh.yield_force_n, "N"), "mesh"
    secant = found.coarse.secant_n_per_m / found.smooth.secant_n_per_m - 1.0
    yield (
        "coarser mesh",
        f"{secant * 100.0:+.2f} %",
        f"secant; n {found.coarse.n - found.smooth.n:+.3f}; {mesh.coarse_nodes} for {mesh.nodes}"
        " nodes",
    )
    yield "computed in", f"{mesh.computed_s:.3g} s", "once; kept after that"


def _data(payload: Payload, found: Prediction) -> dict[str, object]:
    from stepload.contact.limit import elastic_limit

    onset = elastic_limit(payload.geometry, payload.material, payload.plate)
    fits = {"fit": found.fit, "smooth": found.smooth, "coarse": found.coarse}
    return {
        "payload": payload.name,
        "theory": found.theory,
        "force_n": found.force_n.tolist(),
        "deformation_m": found.deformation_m.tolist(),
        **{
            name: {"k": fit.k, "n": fit.n, "secant_n_per_m": fit.secant_n_per_m}
            for name, fit in fits.items()
            if fit is not None
        },
        "elastic_limit_n": None if onset is None else onset.force_n,
        "hertz_share": found.hertz_share,
        "mesh": found.mesh,
    }


def _draw(path: Path, payload: Payload, found: Prediction) -> None:
    from stepload.report import figures

    with figures.figure_of(4.0) as (figure, (axes,)):
        axes.plot(found.deformation_m * 1e6, found.force_n, "o-", color=figures.BLUE)
        axes.set(xlabel="deformation [µm]", ylabel="force [N]")
        axes.set_title(figures.plain(f"{payload.name}, {found.theory}"))
        if path.suffix.lower() == ".png":
            path.write_bytes(figures.png_of(figure))
        else:
            path.write_text(figures.svg_of(figure), encoding="utf-8")
