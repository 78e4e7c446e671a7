"""stepload: press a stiff payload in load steps and identify its contact law F = K delta^n."""

__version__ = "0.1.0"
