"""What is decided about a controller's flight. No I/O: the time, frames and reports come in, frames go out."""
