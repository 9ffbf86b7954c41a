"""Encoders, which turn pictures into units."""
