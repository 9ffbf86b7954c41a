"""One drone as the alert service follows it: what lasts, and its alerts that are open or wait for a person."""

from collections.abc import Iterator

from server.live.alerts import text_alerts
from server.live.alerts.alert import Alert
from server.live.alerts.facts import Facts
from server.live.alerts.lasting import Changed, Key, Lasting
from server.live.alerts.text_alerts import TextAlerts
from server.live.relay.live_drone import LiveDrone


class WatchedDrone:
    """Mutable; touched by the alert service only."""

    def __init__(self) -> None:
        self.lasting = Lasting()
        self.texts = TextAlerts()
        self.open: dict[Key, Alert] = {}
        self._awaiting: dict[int, Alert] = {}
        """Over, and not acknowledged; oldest first."""
        self._settled = False

    def alerts(self) -> Iterator[Alert]:
        yield from self.open.values()
        yield from self._awaiting.values()

    def forget_conditions(self) -> None:
        """Another tower watches it now. What waits for a person stays."""
        self.lasting, self.texts = Lasting(), TextAlerts()

    def forget(self, alert: Alert) -> None:
        """Whether its condition lasts is not known any more."""
        self.lasting.forget(alert.key)
        if alert.rule.name in text_alerts.RULES:
            self.texts = TextAlerts()

    def add(self, alert: Alert) -> None:
        if alert.closed_at is None:
            self.open[alert.key] = alert
        else:
            self._awaiting[alert.id] = alert

    def drop(self, alert: Alert) -> None:
        """It is no part of the present picture any more."""
        if self.open.get(alert.key) is alert:
            del self.open[alert.key]
        self._awaiting.pop(alert.id, None)

    def closed(self, alert: Alert, most: int) -> Alert | None:
        """It is over, and may wait for a person. Returns the one that has to make room."""
        if self.open.get(alert.key) is alert:
            del self.open[alert.key]
        if not alert.is_live:
            return None
        self._awaiting[alert.id] = alert
        return self._awaiting.pop(next(iter(self._awaiting))) if len(self._awaiting) > most else None

    def needs_look(self, drone: LiveDrone) -> bool:
        """Whether the rules can find anything new. Nothing changes with a drone that is offline and was looked at."""
        if drone.online:
            self._settled = False
            return True
        settled, self._settled = self._settled, self.lasting.idle
        return not settled

    def texts_found(self, drone: LiveDrone, facts: Facts, now: float) -> list[Changed]:
        """What the autopilot's own texts tell."""
        texts, arrived = self.texts, drone.telemetry.texts
        if facts.silence or (not arrived and texts.idle and self.lasting.idle):
            return []
        while arrived:
            texts.take(facts.name, arrived.popleft(), now)
        if facts.armed is False:
            texts.disarmed(now)
        return self.lasting.take_all(text_alerts.RULES, texts.found(now), now)
