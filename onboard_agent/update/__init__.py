"""The agent's own update: fetched from the tower, believed for its signature, tried for a minute, and taken back."""
