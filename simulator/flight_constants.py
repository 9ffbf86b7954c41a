"""The grid of simulated time, which the flight code and its modes share."""

TICK_S = 0.005
"""Simulated time between two ticks: 200 per second, four times the rate of the fastest loop."""


def ticks_until(now_s: float) -> int:
    """Returns how many have passed."""
    return int(now_s / TICK_S + 1e-6)
