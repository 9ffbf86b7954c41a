"""MAVLink signing on the line to the autopilot."""
