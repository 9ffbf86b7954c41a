"""Refusals about the towers of one database."""

from server.kernel.refusal import Refusal


class UnknownTower(Refusal):
    """No running tower, or several, have this name."""


class LastTower(Refusal):
    """No other tower would take the drones."""


class TowerDraining(Refusal):
    """The tower ends its work."""
