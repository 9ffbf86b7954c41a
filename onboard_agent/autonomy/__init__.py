"""Controllers on board: programs in a process of their own that fly the drone by high-level directions."""
