"""Precision landing: LANDING_TARGET for the autopilot from what a camera sees of a landing pad."""
