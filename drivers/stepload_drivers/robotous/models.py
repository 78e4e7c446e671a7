"""ROBOTOUS RFT models: dividers and rated loads (RFT Series Manual 1.82, section 3.7)."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Model:
    """What turns counts into N and N·m: force = raw / `force_divider`, torque likewise.

    Rated loads: `rated_xy_n` of Fx and Fy, `rated_z_n` of Fz, `rated_nm` of all torques.
    """

    name: str
    force_divider: float
    torque_divider: float
    rated_xy_n: float
    rated_z_n: float
    rated_nm: float


MODELS = (
    Model("RFT80-6A03", 25.0, 500.0, 1000.0, 1000.0, 50.0),
    Model("RFT80-6A02", 50.0, 1000.0, 400.0, 400.0, 20.0),
    Model("RFT80-6A01", 50.0, 1000.0, 400.0, 400.0, 20.0),
    Model("RFT64-6A01", 50.0, 1000.0, 200.0, 200.0, 10.0),
    Model("RFT64-SB01", 50.0, 2000.0, 150.0, 200.0, 4.0),
    Model("RFT60-HA01", 50.0, 2000.0, 150.0, 200.0, 4.0),
    Model("RFT44", 50.0, 2000.0, 100.0, 150.0, 2.5),
    Model("RFT40", 50.0, 2000.0, 100.0, 150.0, 2.5),
)


def model_named(name: str) -> Model | None:
    """The model whose name the sensor's own name begins with; None for an unknown one.

    A wrong torque divider is silent, so it is never assumed.
    """
    return next((model for model in MODELS if name.upper().startswith(model.name)), None)
