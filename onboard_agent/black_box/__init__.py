"""The black box: every frame of the autopilot on the drone's own disk, whatever the link does."""
