"""What the agent knows about its autopilot, and what it requests from it. No I/O."""
