"""Towers: this one, several that share drones, the bus between them."""
