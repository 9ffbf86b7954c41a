"""Plain values and rules: people, fleet, leases, access, refusals. Imports nothing of `server`, and no library."""
