"""The connection to the autopilot: one small class for each transport, behind one interface."""
