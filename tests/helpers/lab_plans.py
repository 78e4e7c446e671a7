"""Forty plans that a lab would write, with an expert's word on each before preflight saw any.

The word: `press` (it goes), `care` (it goes, with a warning that matters) or `pointless` (refused:
F_c, identifiability (34), impossible numbers).
"""

from __future__ import annotations

from pathlib import Path

from stepload.plan.load import load_plan
from stepload.plan.model import Plan

TABLE = """
# name              | rig      K_s      | shape      radius | E                  ν      limit | top  step  hold cycles distance ±    | word      | why | more
foam-pad            | one-axis profile  | flat_punch 30 mm  | 0.5 MPa            0.1    90 N  | 40 N  5 N   5 s  2  8 mm  2 mm   | press     | soft on stiff: the easiest test |
foam-block-ur3e     | ur3e     measured | flat_punch 20 mm  | 0.5 MPa            0.1    50 N  | 20 N  4 N   2 s  2  5 mm  1 mm   | press     | 1 mm at 20 N, K_s measured | friction: 0.2
foam-ball-ur3e      | ur3e     profile  | sphere     20 mm  | 0.5 MPa            0.3    40 N  | 8 N   2 N   3 s  2  10 mm 1 mm   | press     | so soft that the arm's class figure is enough |
silicone-machine    | one-axis profile  | sphere     25 mm  | 3 MPa              0.49   80 N  | 40 N  10 N  3 s  2  5 mm  1 mm   | press     | 1.3 mm on a machine of 16 MN/m |
silicone-ur5e-20    | ur5e     measured | sphere     25 mm  | 3 MPa              0.49   80 N  | 20 N  4 N   3 s  2  5 mm  1 mm   | press     | 0.83 mm, K_s measured |
silicone-ur5e-class | ur5e     profile  | sphere     25 mm  | 3 MPa              0.49   100 N | 40 N  8 N   3 s  2  10 mm 1 mm   | care      | class K_s: 16 % of the result |
gelatine-ur5e       | ur5e     profile  | sphere     30 mm  | 1.5 MPa            0.3    80 N  | 30 N  5 N   2 s  2  6 mm  1 mm   | press     | soft: class K_s costs 9 % |
apple-ur10e         | ur10e    measured | sphere     38 mm  | 4 MPa              0.35   90 N  | 40 N  8 N   2 s  1  10 mm 2 mm   | care      | 0.96 of K_max |
tomato-ur5e         | ur5e     profile  | sphere     30 mm  | 1 MPa              0.35   25 N  | 8 N   2 N   2 s  1  8 mm  2 mm   | press     | soft: class K_s costs 4 % |
peach-ur3e          | ur3e     measured | sphere     32 mm  | 1.2 MPa            0.4    40 N  | 14 N  3 N   2 s  2  10 mm 2 mm   | press     | 1.2 mm, K_s measured |
polyurethane-ur16e  | ur16e    measured | sphere     20 mm  | 5 MPa              0.49   180 N | 80 N  10 N  3 s  2  10 mm 1 mm   | press     | 1.6 mm, K_s measured |
hard-pu-ur16e       | ur16e    measured | sphere     15 mm  | 30 MPa             0.45   300 N | 120 N 20 N  3 s  2  10 mm 1 mm   | pointless | 1.4 times K_max |
silicone-ur16e      | ur16e    measured | sphere     40 mm  | 3 MPa              0.49   220 N | 100 N 10 N  2 s  3  8 mm  1 mm   | press     | 2.1 mm, K_s measured |
big-ball-ur20       | ur20     measured | sphere     50 mm  | 2 MPa              0.49   400 N | 200 N 25 N  3 s  2  15 mm 2 mm   | press     | 4 mm for a resolution of 100 µm |
big-ball-ur30       | ur30     measured | sphere     60 mm  | 3 MPa              0.49   600 N | 300 N 50 N  2 s  2  15 mm 2 mm   | press     | 3.8 mm for a resolution of 100 µm |
buffer-ur30         | ur30     profile  | flat_punch 20 mm  | 2 MPa              0.49   500 N | 250 N 25 N  2 s  2  10 mm 1 mm   | care      | class K_s: 24 % of the result |
cork-ur10e          | ur10e    measured | flat_punch 12 mm  | 15 MPa             0.1    150 N | 60 N  10 N  3 s  2  5 mm  1 mm   | pointless | 6 times K_max |
cork-stvf           | stvf     profile  | flat_punch 15 mm  | 15 MPa             0.1    150 N | 60 N  10 N  3 s  2  5 mm  0.5 mm | press     | 0.13 mm, 0.3 of K_max |
cork-gauge-ur10e    | ur10e    profile  | flat_punch 12 mm  | 15 MPa             0.1    150 N | 60 N  10 N  3 s  2  5 mm  1 mm   | press     | gauge of 1 µm takes the arm out | gauge 1 µm
pu-80a-machine      | one-axis profile  | sphere     18 mm  | 11 MPa             0.48   150 N | 60 N  10 N  2 s  2  5 mm  1 mm   | press     | 0.8 mm on a stiff machine |
tpu-dome-stvf       | stvf     profile  | sphere     12 mm  | 26 MPa             0.45   140 N | 60 N  10 N  2 s  2  3 mm  0.5 mm | press     | 0.5 mm on STVF |
tpu-dome-ur5e       | ur5e     measured | sphere     8 mm   | 12 MPa             0.45   70 N  | 30 N  5 N   3 s  2  6 mm  1 mm   | care      | 0.45 of K_s and friction unknown |
tpu-block-machine   | one-axis profile  | flat_punch 10 mm  | 5 MPa              0.3    200 N | 80 N  10 N  5 s  3  4 mm  1 mm   | press     | 0.7 mm on a stiff machine |
pla-dome-machine    | one-axis profile  | sphere     12 mm  | 2 GPa ± 10 %       0.35   150 N | 60 N  10 N  2 s  2  3 mm  0.5 mm | press     | 33 µm, 0.6 of K_max |
pla-dome-too-far    | one-axis profile  | sphere     12 mm  | 2 GPa              0.35   -     | 300 N 50 N  2 s  2  3 mm  0.5 mm | pointless | yields at 78 N | yield 50 MPa
pla-dome-stvf       | stvf     profile  | sphere     15 mm  | 2.5 GPa            0.35   120 N | 60 N  10 N  3 s  2  5 mm  1 mm   | pointless | 1.5 times K_max at 60 N |
wood-ball-machine   | one-axis profile  | sphere     25 mm  | 0.8 GPa            0.3    400 N | 150 N 25 N  3 s  2  4 mm  1 mm   | press     | 85 µm, across the grain |
wood-post-stvf      | stvf     profile  | flat_punch 15 mm  | 10 GPa             0.3    900 N | 300 N 50 N  3 s  2  4 mm  1 mm   | pointless | over 10 times K_max |
acetal-machine      | one-axis profile  | sphere     20 mm  | 2.75 GPa           0.35   -     | 100 N 20 N  3 s  2  5 mm  1 mm   | press     | 100 N of 320 N, 32 µm | yield 70 MPa
acetal-stvf         | stvf     profile  | sphere     30 mm  | 2.75 GPa ± 5 %     0.35   -     | 250 N 50 N  3 s  2  5 mm  1 mm   | press     | 250 N of 720 N, 0.7 of K_max | yield 70 MPa
acetal-ur5e         | ur5e     measured | sphere     10 mm  | 2.75 GPa           0.35   150 N | 80 N  10 N  3 s  2  5 mm  1 mm   | pointless | 17 times K_max |
acetal-cone-machine | one-axis profile  | cone_tip   6 mm   | 2.75 GPa           0.35   120 N | 40 N  8 N   2 s  2  3 mm  0.5 mm | press     | limit stated by who answers, 26 µm |
rubber-cone-ur3e    | ur3e     measured | cone_tip   5 mm   | 1.2 MPa            0.49   30 N  | 6 N   1.5 N 3 s  2  5 mm  1 mm   | press     | limit stated, over 1 mm at 6 N |
rubber-pyramid      | one-axis profile  | pyramid_tip 8 mm  | 10 MPa             0.45   70 N  | 25 N  5 N   2 s  2  5 mm  1 mm   | press     | limit stated, 0.65 mm |
steel-ball-gauge    | one-axis profile  | sphere     30 mm  | 210 GPa            0.3    -     | 500 N 100 N 3 s  2  3 mm  0.5 mm | press     | gauge of 20 nm; 500 N of 770 N | yield 900 MPa, gauge 0.02 µm, plate steel
aluminium-gauge     | stvf     profile  | sphere     40 mm  | 70 GPa             0.33   -     | 150 N 25 N  3 s  2  5 mm  1 mm   | press     | gauge of 50 nm: 6 µm are 110 steps | yield 276 MPa, gauge 0.05 µm
steel-post-machine  | one-axis profile  | flat_punch 8 mm   | 210 GPa            0.3    10 kN | 1 kN  200 N 3 s  2  3 mm  0.5 mm | pointless | 24 times K_max |
unknown-machine     | one-axis profile  | flat_punch 15 mm  | 2 MPa to 15 MPa    0.3 to 0.5 120 N | 50 N  10 N  3 s  2  5 mm  1 mm   | press     | anything in that range is identifiable |
unknown-ur5e        | ur5e     measured | sphere     25 mm  | 1 MPa to 4 MPa     0.4 to 0.5 80 N  | 30 N  6 N   3 s  2  5 mm  1 mm   | press     | even the stiffest stays at 0.9 mm |
rubber-pad-ur10e    | ur10e    measured | flat_punch 20 mm  | 0.8 MPa            0.3    110 N | 50 N  10 N  4 s  2  8 mm  1 mm   | press     | 1.4 mm, greased | friction: 0.1
"""  # noqa: E501

_K_S = {"ur3e": 6e4, "ur5e": 1.2e5, "ur10e": 1e5, "ur16e": 2.6e5, "ur20": 1.8e5, "ur30": 2.8e5}
_STEEL = "{name: steel, youngs_modulus: 210 GPa, poisson_ratio: 0.3, yield_strength: 900 MPa}"
_ALUMINIUM = (
    "{name: aluminium, youngs_modulus: 70 GPa, poisson_ratio: 0.33, yield_strength: 276 MPa}"
)


def rows() -> list[tuple[str, str, str, str]]:
    """Name, expert's word, reason, and the plan as YAML, of each."""
    return [_row(line) for line in TABLE.splitlines() if line and not line.startswith("#")]


def plan_of(text: str, name: str, folder: Path) -> Plan:
    """The plan of such a text, read as a file."""
    path = folder / f"{name}.yaml"
    path.write_text(text)
    return load_plan(path)


def _row(line: str) -> tuple[str, str, str, str]:
    name, rig, shape, body, forces, word, why, more = (part.strip() for part in line.split("|"))
    profile, stiffness = rig.split()
    geometry, radius = shape.split(maxsplit=1)
    *modulus, ratio, limit = _columns(body)
    top, step, hold, cycles, distance, near = _columns(forces)
    extra = [each.strip() for each in more.split(",") if each.strip()]
    keys = [f"youngs_modulus: {modulus[0]}", f"poisson_ratio: {ratio}"]
    keys += [f"yield_strength: {each[6:]}" for each in extra if each.startswith("yield ")]
    payload = [
        f"name: {name}",
        f"geometry: {{shape: {geometry}, radius: {radius}}}",
        f"material: {{name: {name}, {', '.join(keys)}}}",
        f"plate: {_STEEL if 'plate steel' in extra else _ALUMINIUM}",
        *([] if limit == "-" else [f"force_limit: {limit}"]),
        *(each for each in extra if each.startswith("friction")),
    ]
    rigged = [f"profile: {profile}"]
    if stiffness == "measured":
        value = _K_S[profile]
        rigged.append(
            f"system_stiffness: {{value: {value} N/m, sigma: {0.02 * value} N/m, damping: 100 "
            "N s/m, msde: 20 µm, provenance: measured}"
        )
    rigged += [
        f"displacement: {{driver: sim, rate: 1 kHz, resolution: {each[6:]}}}"
        for each in extra
        if each.startswith("gauge ")
    ]
    procedure = [
        f"top_force: {top}", f"step: {step}", f"hold: {hold}", f"cycles: {cycles}",
        f"surface_distance: {distance}", f"surface_uncertainty: {near}",
    ]  # fmt: skip
    blocks = {"payload": payload, "rig": rigged, "procedure": procedure}
    text = "stepload: 1\n" + "".join(
        f"{block}:\n" + "".join(f"  {key}\n" for key in keys) for block, keys in blocks.items()
    )
    return name, word, why, text


def _columns(text: str) -> list[str]:
    """Quantities of a cell: numbers with their units, ranges and uncertainties kept whole."""
    out: list[str] = []
    for word in text.split():
        glue = word in ("to", "±", "%") or not (word[0].isdigit() or word == "-")
        if out and (glue or out[-1].endswith((" to", " ±"))):
            out[-1] += f" {word}"
        else:
            out.append(word)
    return out
