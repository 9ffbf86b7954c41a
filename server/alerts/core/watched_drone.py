"""One drone as the alert service follows it: what lasts, and its alerts that are open or wait for a person."""

from collections.abc import Iterator

from server.alerts.core import text_alerts
from server.alerts.core.alert import Alert
from server.alerts.core.facts import Facts
from server.alerts.core.lasting import Changed, Key, Lasting
from server.alerts.core.rules import EVALUATED
from server.alerts.core.text_alerts import TextAlerts
from server.live.live_drone import LiveDrone


class WatchedDrone:
    """Mutable; touched by the alert service only."""

    def __init__(self) -> None:
        self.lasting = Lasting()
        self.texts = TextAlerts()
        self.open: dict[Key, Alert] = {}
        self._awaiting: dict[int, Alert] = {}
        """Over, and not acknowledged; oldest first."""
        self._settled = False
        self.blank = True
        """Nothing is known of it, and nothing waits: there is nothing to leave to another tower."""
        self._has_texts = False
        """The end of a text is still to be found."""
        self._judged: Facts | None = None
        """Facts that the rules have judged, with no delay left and nothing changed: the same ones change nothing."""

    def alerts(self) -> Iterator[Alert]:
        yield from self.open.values()
        yield from self._awaiting.values()

    @property
    def has_alerts(self) -> bool:
        return bool(self.open or self._awaiting)

    def forget_conditions(self) -> None:
        """Another tower watches it now. What waits for a person stays."""
        self.lasting, self.texts = Lasting(), TextAlerts()
        self._judged, self._has_texts, self.blank = None, False, not self.has_alerts

    def restore(self, alert: Alert, now: float) -> None:
        """It was open before the tower restarted, or at another one."""
        self._judged, self.blank = None, False
        self.lasting.restore(alert.key, alert.words)
        if alert.rule.name in text_alerts.RULES:
            self._has_texts = True
            self.texts.restore(alert.key, alert.words, now)

    def forget(self, alert: Alert) -> None:
        """Whether its condition lasts is not known any more: the rules judge it anew."""
        self._judged = None
        self.lasting.forget(alert.key)
        if alert.rule.name in text_alerts.RULES:
            self.texts = TextAlerts()

    def add(self, alert: Alert) -> None:
        self.blank = False
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

    def conditions_found(self, facts: Facts, now: float) -> list[Changed]:
        """What the rules find. They are pure, so they need not run again while neither a fact changes nor a delay
        runs."""
        if facts == self._judged:
            return []
        self.blank = False
        lasting, found = self.lasting, list[Changed]()
        for rule, condition, key in EVALUATED:
            is_open = key in lasting.open
            finding = condition(facts, is_open)
            if finding.__class__ is not str and not is_open and key not in lasting.waiting:
                continue  # nothing is found and nothing was: nearly all of them, nearly every time
            changed = lasting.take(rule, "", finding, now)
            if changed is not None:
                found.append(changed)
        # An alert that has just opened or closed may be judged by another limit: once more.
        self._judged = facts if lasting.steady and not found else None
        return found

    def texts_found(self, drone: LiveDrone, facts: Facts, now: float) -> list[Changed]:
        """What the autopilot's own texts tell."""
        texts, arrived = self.texts, drone.telemetry.texts
        if facts.silence or not (arrived or facts.failsafe or self._has_texts or not texts.idle):
            return []
        shows_failsafe = facts.failsafe is not None
        while arrived:
            texts.take(facts.name, arrived.popleft(), now, shows_failsafe=shows_failsafe)
        if facts.failsafe is not None:
            texts.acts(facts.name, facts.failsafe, facts.failsafe_cause, now)
        if facts.armed is False:
            texts.disarmed(now)
        changed = self.lasting.take_all(text_alerts.RULES, texts.found(now), now)
        known = (*self.lasting.open, *self.lasting.waiting)
        self._has_texts = any(key[0] in text_alerts.RULES for key in known)
        return changed
