"""The one constant that the flight code and its modes must agree on."""

TICK_S = 0.005
"""Simulated time between two ticks: 200 a second, four times what the fastest loop needs."""
