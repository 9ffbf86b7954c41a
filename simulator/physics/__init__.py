"""The physics of airframes, for many vehicles at once: forces and torques in, motion out.

Every array has the vehicles in its last axis: a position is (3, vehicles), a quaternion (4, vehicles). World axes are
north, east, down; body axes forward, right, down. NumPy is needed; nothing here knows sensors, control or MAVLink.
"""
