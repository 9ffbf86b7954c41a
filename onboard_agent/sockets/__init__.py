"""Connections to the tower: thin shells around `link`."""
