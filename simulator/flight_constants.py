"""The one constant that the flight code and its modes share."""

TICK_S = 0.005
"""Simulated time between two ticks: 200 per second, four times the rate of the fastest loop."""
