"""What the companion computer carries beside the camera: servos on its own pins, and sensors on a line."""
