"""How urgent an alert is."""

from enum import StrEnum


class Severity(StrEnum):
    """From the worst to the mildest."""

    CRITICAL = "critical"
    """Somebody has to act now. It stays in the list until a person acknowledges it."""
    WARNING = "warning"
    """Somebody has to look."""
    NOTICE = "notice"
    """To be known; makes no sound."""
