"""Live video: from the agent's video process to whoever watches or records (docs/video.md)."""
