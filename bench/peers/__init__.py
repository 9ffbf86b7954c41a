"""What our relay is measured against: the other ways to get MAVLink frames from drones to whoever watches."""
