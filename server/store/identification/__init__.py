"""System identification of a recorded flight in a process of its own."""
