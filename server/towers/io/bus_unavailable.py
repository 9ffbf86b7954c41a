"""The error of a tower whose bus does not answer when it starts."""


class BusUnavailable(Exception):
    """The message says what to look at."""
