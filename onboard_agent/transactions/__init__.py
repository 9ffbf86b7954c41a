"""Client halves of MAVLink's transactional protocols, without I/O (docs/missions.md)."""
