"""Benchmarks, run on demand: `python -m bench NAME`. May import every package of the product; none imports this one."""
