"""The flight controller: states and checks, what it watches, and the loop that runs sensors, filter and control."""
