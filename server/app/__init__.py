"""Assembles the tower; the command line."""
