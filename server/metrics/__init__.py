"""What the tower counts about itself, as Prometheus reads it."""
