"""Plans on board of a drone, and the library of missions."""
