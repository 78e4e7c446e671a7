"""The values of a driver's options, as its table declares them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from stepload.rig.options import Option


def values(options: Mapping[str, Option], given: Mapping[str, Any]) -> dict[str, Any]:
    """The values of all options, defaults filled in.

    Raises:
        TypeError: there is no such option, or a required one is missing.
    """
    if unknown := given.keys() - options.keys():
        raise TypeError(f"no option is called {min(unknown)!r}")
    if missing := [name for name in options if options[name].required and name not in given]:
        raise TypeError(f"the option {missing[0]!r} is missing")
    return {name: given.get(name, option.default) for name, option in options.items()}
