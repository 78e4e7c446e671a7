"""The simulated rig: contact physics on which plans are rehearsed and faults are tried.

From the truth outwards: `laws` (force over deformation, with memory) and `layers` around them, put
together by `contact` → `plant` (`drive`, tip, plate that moves, creep) → `channels` and
`force_channels` (noise, quantum, delay, `faults`) → `simulation` (one world) → `sensors`, `arm`
(the devices) → `world` (virtual time), `live`, `devices` (real time).

`plant` presses along one axis. `six_plant` adds the axes across it to the same drive, plate and
contact: a tip (`six_tip`) on `springs` with `friction`. No axis has a temperature but a drift, nor
a control loop of its own to go unstable.
"""
