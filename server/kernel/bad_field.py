"""The exception of our own rules for a field of a request. `field_errors.py` shows its message to people."""


class BadField(ValueError):
    """The message is for people and repeats nothing of the value. A validator of pydantic may raise it."""
