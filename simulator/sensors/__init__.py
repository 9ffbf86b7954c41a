"""Sensors of many vehicles at once, with their errors: what a flight controller sees instead of the truth.

Arrays have the vehicles in their last axis. Nothing here knows control, modes or MAVLink.
"""
