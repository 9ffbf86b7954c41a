"""Maps and the height of the ground."""
