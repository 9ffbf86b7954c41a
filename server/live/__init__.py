"""What lives while drones fly: the hub, its drones and browsers, and the messages of the live channel."""
