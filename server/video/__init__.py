"""Live video and its recordings."""
