"""Which telemetry goes to the tower. No I/O."""
