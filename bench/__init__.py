"""Benchmarks, run on demand: `python -m bench NAME`. May import everything of ours; nothing of ours imports it."""
