"""Plain values and rules: people, access, relations, refusals. Imports nothing else of `server`, and no library."""
