"""`tower connect`: a drone of the tower as a local MAVLink endpoint, for ordinary ground stations and programs.

Runs on the user's machine. It depends only on the tower's wire formats, so of the product it imports only `wire`.
"""
