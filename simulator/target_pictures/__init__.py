"""Pictures of landing targets with known truth, for tests and benchmarks of target finding. The flight loads nothing of
it."""
