"""Where the autopilot is attached: one small class for each transport, behind one interface."""
