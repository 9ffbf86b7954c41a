"""What a flight controller knows of its motion: attitude, velocity and position from its sensors, never the truth."""
