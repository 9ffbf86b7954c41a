"""Teams: people and drones that belong together."""
