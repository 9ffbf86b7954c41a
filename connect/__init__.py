"""`tower connect`: a drone of the tower as a local MAVLink endpoint, for ordinary ground stations and programs.

Runs on the user's machine; knows the tower by its wires only, so it imports nothing of ours but `wire`.
"""
