"""Recorded flights: recorder, replay, statistics, imports, display videos."""
