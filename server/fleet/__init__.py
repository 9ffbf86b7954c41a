"""Drones: the squad, enrolment, loans, updates of their agents."""
