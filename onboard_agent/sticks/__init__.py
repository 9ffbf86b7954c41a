"""Which sticks reach the autopilot. No I/O."""
