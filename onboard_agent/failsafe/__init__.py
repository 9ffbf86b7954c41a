"""Holds, loss detection and lost actions. No I/O."""
