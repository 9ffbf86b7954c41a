"""What the agent knows of its autopilot, and what it asks of it. No I/O."""
