"""Signing in, and staying linked to the tower. No I/O but for the identity file."""
