"""What the product knows of each autopilot: one profile per autopilot and kind of vehicle, one file each.

`registry.of` finds the profile of a vehicle. `profile` has the types. `commands` has the commands of a pilot and their
MAVLink equivalents. To add an autopilot, add one file with a `PROFILE` (docs/autopilots.md).
"""
