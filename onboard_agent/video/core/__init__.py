"""Decisions of the video process: rates, shapes, and the share of each stream. No I/O."""
