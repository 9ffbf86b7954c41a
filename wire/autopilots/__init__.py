"""What the product knows of each autopilot: one profile per autopilot and kind of vehicle, one file each.

`registry.of` finds the profile of a vehicle. `profile` has the types, `commands` what a pilot can ask for and what it
becomes. To add an autopilot, add one file with a `PROFILE` (docs/autopilots.md).
"""
