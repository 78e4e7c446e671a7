"""The simulated rig: contact physics on which plans are rehearsed and faults are tried.

From the truth outwards: `laws` (force over deformation, with memory) → `plant` (drive, tip,
contact) → `channels` (noise, quantum, delay, `faults`) → `simulation` (one world) → `stream`,
`arm`, `sensors` (the devices) → `world` (virtual time), `live` and `devices` (real time).

It is one axis: no lateral slip, no tilt, no temperature, a plate that does not move, no friction in
the contact, and a drive that has limits but no control loop of its own to go unstable.
"""
