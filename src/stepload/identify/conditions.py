"""What identification must be told beside the data."""

from __future__ import annotations

from dataclasses import dataclass

from stepload.identify.sources import Sources


@dataclass(frozen=True, slots=True)
class Conditions:
    """What identification must be told beside the data; SI units.

    Attributes:
        sources: the uncertainty sources; `system_stiffness_n_per_m` None where the travel is the
            payload's deformation already.
        secant_force_n: force the secants are taken at.
        touch_force_n: the contact threshold that found the zero; 0 where the zero is given.
        position_resolution_m: δ_Δ for (34).
        elastic_limit_n: F_c, None where it is not known.
        roughness_m: σ_eq, None where the payload is smooth or not known.
        p, s, t: those of (29)–(32).
        kind: "payload" or "system".
        theory_k, theory_n: the payload's contact law by theory (3), in N/m^n.
        modulus_pa: equivalent modulus (4) of payload and plate.
        plate_pa: E/(1 − ν²) of the plate alone.
        pose, temperature_c: of the run; "" and None where the plan does not tell.
    """

    sources: Sources
    secant_force_n: float
    touch_force_n: float
    position_resolution_m: float
    elastic_limit_n: float | None = None
    roughness_m: float | None = None
    p: float = 2.0
    s: float = 20.0
    t: float = 5.0
    kind: str = "payload"
    theory_k: float | None = None
    theory_n: float | None = None
    modulus_pa: float | None = None
    plate_pa: float | None = None
    pose: str = ""
    temperature_c: float | None = None
