"""What makes units of pictures."""
