"""The camera of a simulated vehicle: pictures of a generated landscape from the vehicle's position, over HTTP.

`simulator.photographs` is separate: it reports the photographs that a mission takes.
"""
