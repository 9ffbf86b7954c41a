"""The one error that ends the agent for good. Nothing else may be added here."""


class Unusable(Exception):
    """Something that no restart cures: a setting is wrong, or what it names is not ours to use.

    The text is one line for a person; the process ends with exit code 2, at which systemd does not restart it.
    """
