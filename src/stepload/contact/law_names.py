"""The contact laws that a user may choose, by the names that select them."""

from __future__ import annotations

LAW_NAMES = {
    "power": "power law",
    "linear": "power law, linear (n = 1)",
    "hertz": "power law, Hertz (n = 1.5)",
    "cone": "power law, cone (n = 2)",
    "hertz-linear": "Hertz and a linear part",
    "two-springs": "two springs",
    "stop": "Hertz against a stop",
    "elastic-plastic": "elastic-plastic (15)",
    "rough": "rough sphere (10)",
    "adhesive": "Hertz with adhesion",
}
"""Common name of each law."""
