"""`python -m bench video`: live video from the camera to the canvas of a browser, beside JSMpeg's documented set-up."""
