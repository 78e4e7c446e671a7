"""stepload: press a stiff payload in load steps and identify its contact law F = K delta^n.

The functions below do what the commands do, print nothing, and raise what is wrong. They are
loaded when they are first used: `import stepload` alone costs next to nothing.
"""

from importlib import import_module

__version__ = "1.0.0"

_FROM = {
    "Identified": "stepload.calls",
    "Run": "stepload.data.run",
    "Table": "stepload.data.table",
    "catalog": "stepload.data.catalog",
    "identify": "stepload.calls",
    "load_plan": "stepload.plan.load",
    "open": "stepload.data.run",
    "preflight": "stepload.calls",
    "run": "stepload.calls",
}
_NAMED_OTHERWISE = {"open": "open_run"}

__all__ = ["__version__", *sorted(_FROM)]


def __getattr__(name: str) -> object:
    try:
        module = import_module(_FROM[name])
    except KeyError:
        raise AttributeError(f"module 'stepload' has no attribute {name!r}") from None
    globals()[name] = found = getattr(module, _NAMED_OTHERWISE.get(name, name))
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *_FROM})
