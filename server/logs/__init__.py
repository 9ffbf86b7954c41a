"""Logs of autopilots, fetched from drones."""
