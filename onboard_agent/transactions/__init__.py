"""MAVLink's transactional protocols, client halves without I/O (docs/missions.md)."""
