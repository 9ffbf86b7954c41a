"""The air around drones: zones, aircraft nearby, separation."""
