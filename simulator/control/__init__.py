"""From where a vehicle is to be, to motor commands: trajectories and the cascade that follows them."""
