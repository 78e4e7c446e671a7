"""Faults of the emulated controller, switched by lines of text, from the start or while it runs."""

from __future__ import annotations

from dataclasses import dataclass

HELP = """\
drop [rst]            close every connection (FIN, or RST)
refuse on|off         close every connection and refuse new ones
freeze on|off         send no more data packages; TCP stays up
repeat on|off         send the same data package for ever
blackhole on|off      read and send nothing on any port (cable out)
protective-stop       as after a collision; `unlock` releases it
emergency-stop        `release` lets go, the arm stays powered off
safeguard on|off      safeguard stop; releasing resumes the program
kill-program          stop the program as from the pendant
load NAME             another program is loaded at the pendant
ignore-inputs on|off  what clients write gets lost, so that the watchdog trips
local on|off          local control: scripts are ignored
slider FRACTION       speed slider of the pendant, 0 to 1
payload KG [X Y Z]    payload mass, and its centre of gravity in m
tcp X Y Z             TCP from the flange in m
nan on|off            NaN in every floating-point value
random on|off         random bytes as values
wrong-type on|off     data packages under an unknown type
wrong-recipe on|off   data packages with another recipe id
short on|off          data packages cut in half, size field correct
wrong-size receive|control
                      one data package to clients that only receive, or that control as well, whose
                      size field lies
rate HZ               send at most HZ packages a second; 0: every period
jitter SECONDS        delay each package by a random time up to SECONDS
gap SECONDS           send to each RTDE client so long after the one before, in drawn order
gap-jitter SECONDS    and longer by a random time up to SECONDS
control-late SECONDS  delay each package to clients that control by so much
push X Y Z            a hand pushes the tool with so many N, base frame; 0 0 0: lets go
lead RX RY RZ         the tool is turned by hand to this rotation vector; no program may run
claim FIRST LAST      another client owns these input registers
state                 print the truth as one line of JSON
quit                  end"""

SWITCHES = (
    "refuse", "freeze", "repeat", "blackhole", "local", "ignore-inputs",
    "nan", "random", "wrong-type", "wrong-recipe", "short",
)  # fmt: skip


@dataclass(slots=True)
class Faults:
    """Faults in force. Switch names as in `HELP`, with underscores."""

    refuse: bool = False
    freeze: bool = False
    repeat: bool = False
    blackhole: bool = False
    local: bool = False
    ignore_inputs: bool = False
    nan: bool = False
    random: bool = False
    wrong_type: bool = False
    wrong_recipe: bool = False
    short: bool = False
    wrong_size: str = ""
    rate_hz: float = 0.0
    jitter_s: float = 0.0
    gap_s: float = 0.0
    gap_jitter_s: float = 0.0
    control_late_s: float = 0.0
    claimed: tuple[int, int] = (0, -1)

    def switch(self, words: list[str]) -> bool:
        """Apply one command; False when it is none of these.

        Raises:
            ValueError: a known command with an argument it does not take.
        """
        match words:
            case [name, "on" | "off" as value] if name in SWITCHES:
                setattr(self, name.replace("-", "_"), value == "on")
            case [name, *_] if name in SWITCHES:
                raise ValueError(f"{name}: on or off expected")
            case ["wrong-size", "receive" | "control" as to]:
                self.wrong_size = to
            case ["rate", hz]:
                self.rate_hz = float(hz)
            case ["jitter", seconds]:
                self.jitter_s = float(seconds)
            case ["gap", seconds]:
                self.gap_s = float(seconds)
            case ["gap-jitter", seconds]:
                self.gap_jitter_s = float(seconds)
            case ["control-late", seconds]:
                self.control_late_s = float(seconds)
            case ["claim", first, last]:
                self.claimed = (int(first), int(last))
            case _:
                return False
        return True
