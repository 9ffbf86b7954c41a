"""The video process: camera, encoders, and the WebSocket that carries the units."""
