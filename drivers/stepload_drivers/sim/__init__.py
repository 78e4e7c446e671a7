"""The simulated rig: contact physics on which plans are rehearsed and faults are tried.

From the truth outwards: `laws` (force over deformation, with memory), `layers`, `adhesion` and
`creep` around them, put together by `contact` → `plant` (drive, tip, contact), `slow` (creep and
drift) → `channels` (noise, quantum, delay, `faults`) and `sensor_errors` → `simulation` (one world)
→ `stream`, `arm`, `sensors` (the devices) → `world` (virtual time), `live`, `devices` (real time).

It is one axis: no lateral slip, no tilt, no temperature but a drift, a plate that does not move, no
friction in the contact, and a drive that has limits but no control loop of its own to go unstable.
"""
