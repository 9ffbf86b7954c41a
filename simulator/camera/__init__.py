"""The camera that a simulated vehicle carries: pictures of a made-up land, as it lies before the vehicle, over HTTP.

The photographs that a mission takes are another thing (`simulator.photographs`).
"""
