"""The video of a flight with a burnt-in flight display: what is shown at which moment."""
