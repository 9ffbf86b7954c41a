"""Systems that our relay is compared with: other ways to get MAVLink frames from drones to viewers."""
