"""The agent process on the drone: the link to the tower, the autopilot port, and the failsafe between them."""

from typing import Final

VERSION: Final = "0.3.0.dev0"
"""Sent to the tower in the hello message."""
