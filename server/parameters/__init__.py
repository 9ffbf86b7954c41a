"""Parameters of autopilots."""
