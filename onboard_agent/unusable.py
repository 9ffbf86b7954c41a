"""The one error that ends the agent for good. Nothing else may be added here."""


class Unusable(Exception):
    """An error that no restart cures: a setting is wrong, or names a resource that the agent may not use.

    The text is one line for a person. The process ends with exit code 2, and systemd does not restart it.
    """
