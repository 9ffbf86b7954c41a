"""Experiments with the flight controller whose results are in the documentation."""
