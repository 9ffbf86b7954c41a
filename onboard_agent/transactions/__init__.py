"""The chatty protocols of MAVLink, carried out beside the autopilot: client halves without I/O (docs/missions.md)."""
