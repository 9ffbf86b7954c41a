"""What anybody may cost the tower before they have signed in: `limits` is the table (docs/anonymous-budget.md).

Cores take `now` and do no I/O: `limits`, `networks`, `known_addresses`, `fair_line`, `connections`, `hashing`,
`log_lines`, `slices`. Adapters: `acceptor` (listening socket), `read_turns` (bytes), `request_gate` (requests), and the
Argon2 threads in `server.accounts.passwords`.
"""
