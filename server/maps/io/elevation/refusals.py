"""Why a file does not become elevation."""


class BadElevationFile(Exception):
    """The message completes "the file ..."."""
