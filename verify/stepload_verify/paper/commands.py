"""The paper's experiments as commands that a user can type."""

from __future__ import annotations

from stepload.contact.elastic import equivalent_modulus
from stepload_verify.paper.printed import ALUMINIUM, SPHERE
from stepload_verify.paper.rows import Section

_OTHER_MEANS = """\
Leave out `--dry-run` on your own rig. Dry runs show no agreement with the paper. The system \
stiffness (26) comes first.

```console
$ stepload paper --out paper.md                  # this page, figures and curves in paper/
$ stepload plans copy system-stiffness
$ stepload plans copy plastic-sphere
$ stepload calibrate system-stiffness.yaml --dry-run --seed 1 --record calibration/stvf.json
```

A plan with that record, `sphere.yaml`:

```yaml
stepload: 1
payload: payloads/plastic-sphere.yaml
rig:
  profile: stvf
  system_stiffness: {record: calibration/stvf.json, policy: warn}
procedure:
  step: 50 N
  top_force: 300 N
  hold: 3 s
  surface_distance: 5 mm
identify: {temperature: 23 degC}
```

```console
$ stepload run sphere.yaml --dry-run --seed 2 --out test-1
$ stepload identify test-1/run.mcap
```

Finite elements with (10) and the product's own hardness, then the curve of this page. Its zero is \
the mean plane: secants differ, the chord does not.

```console
$ stepload predict payloads/plastic-sphere.yaml --to "300 N" --rough --csv elements.csv
$ stepload identify elements.csv --secant-force "300 N"
$ stepload compare test-1 --curve paper/elements-plastic-sphere.csv --curve-modulus "MODULUS"
```

Another machine and counter body, `instron.yaml`:

```yaml
stepload: 1
payload:
  name: plastic sphere on steel
  geometry: {shape: sphere, radius: 28.7 mm}
  material: {name: acetal, youngs_modulus: 2.75 GPa, poisson_ratio: 0.3, yield_strength: 70 MPa}
  plate: {name: steel, youngs_modulus: 200 GPa, poisson_ratio: 0.29}
  roughness: 7.5 µm
rig: one-axis                                    # K_s, resolutions and misfit of the Instron
procedure: {step: 50 N, top_force: 300 N, hold: 3 s, surface_distance: 5 mm}
```

```console
$ stepload run instron.yaml --dry-run --seed 3 --out instron
$ stepload identify paper/instron-plastic-sphere.csv --secant-force "300 N" --msde "1.31 um"
$ stepload compare test-1 --curve paper/instron-plastic-sphere.csv --curve-plate "200 GPa, 0.29"
```"""

_ROBOT_RIG = """\
Test 1 against test 2; the other payloads are refused at 300 N:

```console
$ stepload run sphere.yaml --dry-run --seed 4 --out test-2
$ stepload compare test-1 test-2 --out tests
$ stepload plans copy plastic-cone
$ stepload plans copy plastic-pyramid
$ stepload plans copy aluminium-sphere
$ stepload plans copy plastic-cube
$ stepload plans copy plastic-prism
$ stepload preflight plastic-cone.yaml           # refused: 300 N is 31 F_c
$ stepload preflight plastic-pyramid.yaml        # refused: 257 F_c
$ stepload preflight aluminium-sphere.yaml       # refused: above F_c and beyond K_max
$ stepload preflight plastic-cube.yaml           # refused: beyond K_max
$ stepload preflight plastic-prism.yaml          # refused: beyond K_max
```

Below F_c the tips leave little above the touch of 4 N; the aluminium sphere is beyond K_max there \
too."""


def sections() -> tuple[Section, ...]:
    """V-A: other means for the same payload; V-B: the payloads twice, and what is refused."""
    modulus = f"{equivalent_modulus(SPHERE.material, ALUMINIUM) / 1e9:.2f} GPa"
    other_means = _OTHER_MEANS.replace("MODULUS", modulus)
    return (
        Section("V-A: other means for the same payload", (other_means,)),
        Section("V-B: the payloads on the robot rig", (_ROBOT_RIG,)),
    )
