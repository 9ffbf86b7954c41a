"""The PX4 1.15 flavour of the simulated autopilot: its modes, sticks, failsafes, commands, parameters and telemetry."""
