"""Verbs about what comes with stepload: plans, profiles, schema, layout, explanations."""

from __future__ import annotations

import json
from collections.abc import Callable
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import Annotated, Any

from typer import Argument, Context, Typer

from stepload.cli.options import rig_names
from stepload.errors import BadInputError
from stepload.report.terminal import AsJson, Output

plans = Typer(help="Plans that come with stepload, ready to run or to begin with.")


@plans.callback(invoke_without_command=True)
def list_plans(context: Context, as_json: AsJson = False) -> None:
    """List the plans that come with stepload."""
    if context.invoked_subcommand is not None:
        return
    from stepload.plan.shipped import shipped_plans

    out, found = Output(as_json=as_json), shipped_plans()
    out.table("Plans", ("name", "what it is"), [(plan.name, plan.about) for plan in found])
    out.line("stepload plans copy NAME copies one, with the files it names, to begin with")
    out.result({"plans": found})


def plan_names(incomplete: str) -> list[str]:
    """Plans whose names begin with a text, for the shell's completion."""
    from stepload.plan.shipped import names

    return [name for name in names() if name.startswith(incomplete)]


@plans.command("copy")
def copy(
    name: Annotated[
        str, Argument(help="Plan, as `stepload plans` lists it.", autocompletion=plan_names)
    ],
    directory: Annotated[Path, Argument(help="Where to; made where missing.")] = Path(),
    as_json: AsJson = False,
) -> None:
    """Copy a plan and the files it names; nothing that is there is overwritten.

    Example: stepload plans copy plastic-sphere
    """
    from stepload.plan.shipped import copy_plan

    out, written = Output(as_json=as_json), copy_plan(name, directory)
    for path in written:
        out.line(str(path))
    out.result({"written": written})


def profile_names(incomplete: str) -> list[str]:
    """Rig profiles and data sheets whose names begin with a text, for the shell's completion."""
    from stepload.plan.references import data_sheets

    sheets = [name for name in data_sheets() if name.startswith(incomplete)]
    return rig_names(incomplete) + sheets


def profiles(
    name: Annotated[
        str, Argument(help="Print the text of this one.", autocompletion=profile_names)
    ] = "",
    as_json: AsJson = False,
) -> None:
    """List the rig profiles and data sheets that come with stepload.

    Example: stepload profiles ur5e
    """
    from stepload.plan import references

    rigs = {each: references.read_profile(each) for each in references.profiles()}
    sheets = {each: references.read_data_sheet(each) for each in references.data_sheets()}
    out = Output(as_json=as_json)
    if name:
        source = (rigs | sheets).get(name)
        if source is None:
            known = ", ".join(rigs | sheets)
            raise BadInputError(f"no profile is named {name!r}", hint=f"there are {known}")
        out.line(source.text.rstrip())
        out.result({"name": name, "text": source.text})
        return
    kinds = {
        "rigs": ("Rigs: `rig: NAME`, or `rig: {profile: NAME, …}`", rigs),
        "force_sensors": (
            "Force sensors: `rig: {force: {profile: NAME, axis: …, options: …}}`", sheets,
        ),
    }  # fmt: skip
    for title, found in kinds.values():
        rows = [(each, references.title(source)) for each, source in found.items()]
        out.table(title, ("name", "what it is"), rows)
    out.line("stepload profiles NAME prints one, every number with its source")
    out.result(
        {
            kind: [{"name": each, "about": references.about(s)} for each, s in found.items()]
            for kind, (_, found) in kinds.items()
        }
    )


class Documents(StrEnum):
    """What a schema describes."""

    PLAN = "plan"
    RESULTS = "results"
    COMPARISON = "comparison"
    CALIBRATION = "calibration"
    PREFLIGHT = "preflight"
    RUNS = "runs"
    BATCH = "batch"


def schema(
    document: Annotated[
        Documents, Argument(help="Which: a plan, results.json, or the JSON of a verb.")
    ] = Documents.PLAN,
) -> None:
    """Print the JSON Schema of a plan, for editors, or of results.

    Example: stepload schema results
    """
    from stepload.data.catalog import Runs
    from stepload.plan.schema import json_schema
    from stepload.report.batch import Batch
    from stepload.report.calibration_document import calibration_schema
    from stepload.report.comparison_document import comparison_schema
    from stepload.report.preflight_results import preflight_schema
    from stepload.report.rows import schema_of
    from stepload.report.run_results import results_schema

    made: dict[Documents, Callable[[], dict[str, Any]]] = {
        Documents.PLAN: json_schema,
        Documents.RESULTS: results_schema,
        Documents.COMPARISON: comparison_schema,
        Documents.CALIBRATION: calibration_schema,
        Documents.PREFLIGHT: preflight_schema,
        Documents.RUNS: partial(schema_of, Runs, "runs"),
        Documents.BATCH: partial(schema_of, Batch, "batch"),
    }
    text = json.dumps(made[document](), indent=1, ensure_ascii=False)
    Output(as_json=False).document(text)


def layout(
    file: Annotated[Path, Argument(help="The file to write.")] = Path("stepload-layout.json"),
) -> None:
    """Write a layout for Foxglove and Lichtblick.

    Example: stepload layout stepload-layout.json
    """
    from stepload.live.state import layout as made

    text = made()
    try:
        with file.open("x", encoding="utf-8") as out:
            out.write(text)
    except FileExistsError:
        raise BadInputError(f"{file} exists already", hint="name another file") from None
    except OSError as error:
        raise BadInputError(f"cannot write {file}: {error.strerror}") from error
    Output(as_json=False).line(f"{file}: import it as a layout in Foxglove or Lichtblick")


def codes(incomplete: str) -> list[str]:
    """Codes that begin with a text, for the shell's completion."""
    from stepload.explain.codes import explanations

    return [each.code for each in explanations() if each.code.startswith(incomplete)]


def explain(
    code: Annotated[
        str,
        Argument(
            help="A code (R6), a key of a plan (search_distance), a threshold, a word; none: all.",
            autocompletion=codes,
        ),
    ] = "",
    as_json: AsJson = False,
) -> None:
    """Say what a code, key, threshold or word means and what to do.

    Example: stepload explain unidentifiable
    """
    from stepload.explain.codes import GROUPS, OTHERS, explained, explanations

    output = Output(as_json=as_json)
    found = explained(code) if code else explanations()
    if code:
        for each in found:
            output.line(f"{each.code} ({(GROUPS | OTHERS)[each.group]})")
            output.line(f"  {each.means}")
            if each.do:
                output.line(f"  What to do: {each.do}")
            output.line(f"  More: docs/{each.page}")
    else:
        for group, title in GROUPS.items():
            words = [each.code for each in found if each.group == group]
            output.line(f"{title}: {', '.join(words)}")
        output.line("keys of a plan: docs/plan.md, or stepload explain KEY")
        output.line("words and symbols: docs/glossary.md, or stepload explain WORD")
    output.result({"codes": found})
