"""Zones: what one is, its ground, and which straight ways enter it. Tower and agent judge ways alike with it."""
