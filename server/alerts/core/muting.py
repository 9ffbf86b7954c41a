"""Which alerts of a muted drone reach only whoever flies it. Pure."""

from server.alerts.core import text_alerts
from server.alerts.core.alert import Alert
from server.alerts.core.rules import NOISY
from server.alerts.core.severity import Severity
from server.live.live_drone import LiveDrone


def is_muted(drone: LiveDrone, alert: Alert) -> bool:
    """Critical alerts that the tower finds by itself, and those of a pair of drones, concern others: they are never
    muted. Those that the drone's own texts open are."""
    if not drone.is_muted or alert.rule is NOISY or alert.other_id is not None:
        return False
    return alert.rule.severity is not Severity.CRITICAL or text_alerts.is_of_text(alert.rule.name, alert.subject)
