"""What the video process decides: rates, shapes, who gets what. No I/O."""
