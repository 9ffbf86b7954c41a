"""The rules run when a fact changes or a delay runs, and find what they would find at every look, at the same look."""

import random
from collections import Counter, deque
from dataclasses import fields, replace
from datetime import timedelta
from typing import Any, Final, get_args

import pytest
from hub_world import NOW

from server.alerts.core import text_alerts
from server.alerts.core.alert import Alert
from server.alerts.core.facts import Facts, Silence
from server.alerts.core.lasting import Change, Changed, Lasting
from server.alerts.core.rules import BY_NAME, EVALUATED
from server.alerts.core.service import LOOK_S
from server.alerts.core.status_texts import StatusText
from server.alerts.core.text_alerts import TextAlerts
from server.alerts.core.watched_drone import WatchedDrone
from server.fleet.core.views import HoldView
from wire.autopilots.profile import FlightTask
from wire.ids import DroneId
from wire.open_holds import AfterSticks, HoldStage, Lost, LostAction, LostPhase
from wire.signing_key import Signing

SEEDS: Final = range(25)
LOOKS: Final = 400
CHANGES: Final = (0, 0, 0, 0, 0, 0, 1, 1, 2, 5)
"""How many facts change from one look to the next: mostly none, so that delays run out over facts that stay."""
STEADY: Final = (0,) * 60 + (1,)


def hold(phase: LostPhase, lost: Lost | None, *, is_open: bool = True) -> HoldView:
    return HoldView(
        open=is_open,
        stage=HoldStage.STAY,
        mode="LOITER",
        sticks=False,
        after_sticks=AfterSticks.STAYS,
        waiting_for="",
        lost=lost,
        phase=phase,
        action=LostAction.RETURN,
        due_at=NOW + timedelta(seconds=20),
        detail="",
        as_of=NOW,
        stale=False,
    )


HOLDS: Final = (
    None,
    hold(LostPhase.QUIET, None),
    hold(LostPhase.QUIET, Lost.PERSON, is_open=False),
    hold(LostPhase.COUNTING, Lost.PERSON),
    hold(LostPhase.COUNTING, Lost.TOWER),
    hold(LostPhase.DONE, Lost.TOWER, is_open=False),
)
VALUES: Final[dict[str, tuple[Any, ...]]] = {
    "name": ("Merlin", "Kestrel"),
    "known": (True,),
    "silence": ("", "", "", *get_args(Silence)),
    "armed": (None, False, True, True),
    "airborne": (None, False, True, True),
    "held_by": (None, "alice"),
    "mode": ("", "AUTO"),
    "task": (None, *FlightTask),
    "height_m": (None, 20.0, 119.0, 121.0),
    "height_limit_m": (None, 120.0),
    "lost_action": tuple(LostAction),
    "lost_action_s": (30.0, 60.0),
    "hold": HOLDS,
    "hold_unconfirmed": (None, None, "", "no answer"),
    "hold_reason": ("", "the pilot has gone"),
    "system_status": (None, 3, 4, 5, 6),
    "failsafe": (None, "", "its failsafe returns", "its failsafe lands"),
    "failsafe_cause": ("", "low_battery"),
    "battery_percent": (None, 14, 16, 20, 29, 32, 34, 80),
    "battery_number": (None, 2),
    "battery_charge": (None, None, 1, 2, 3),
    "gps_lost": (None, True, False),
    "gps_fix": (None, 1, 3),
    "gps_number": (None, 2),
    "sensor_fault": (None, "", "its compass"),
    "estimator_fault": (None, "", "bad height"),
    "vibration_m_s2": (None, 10.0, 50.0, 61.0),
    "fence_breach": (None, "", "its fence"),
    "black_box_problem": ("", "the disk is full"),
    "aircraft_near": ("", "an aircraft comes near"),
    "foreign_drone_near": ("", "a drone comes near"),
    "zone_near": ("", "reaches a zone"),
    "zone_breach": ("", "is in a zone"),
    "motion": (None, "jump"),
    "other_systems": ((), (2,)),
    "hears_agent": (None, True, False),
    "signing": (Signing.OFF, Signing.ON, Signing.WRONG_KEY, Signing.NO_KEY),
    "noise": ("", "9 texts a second"),
    "falls": ("", "9 m/s"),
    "sinks": ("", "1 m/s"),
    "motors_stopped": ("", "61 m above home"),
    "crashed": ("", "it fell"),
}
TEXTS: Final = ("Radio failsafe on", "Radio failsafe cleared", "Compass error", "Crash: disarming", "hello")


class EveryLook:
    """All rules at each look, as long as the drone is watched here: what the other one is compared with."""

    def __init__(self) -> None:
        self.forget()

    def forget(self) -> None:
        self.lasting, self.texts = Lasting(), TextAlerts()

    def restore(self, alert: Alert, now: float) -> None:
        self.lasting.restore(alert.key, alert.words)
        if alert.rule.name in text_alerts.RULES:
            self.texts.restore(alert.key, alert.words, now)

    def forget_one(self, alert: Alert) -> None:
        self.lasting.forget(alert.key)
        if alert.rule.name in text_alerts.RULES:
            self.texts = TextAlerts()

    def conditions(self, facts: Facts, now: float) -> list[Changed]:
        taken = [
            self.lasting.take(rule, "", condition(facts, key in self.lasting.open), now)
            for rule, condition, key in EVALUATED
        ]
        return [one for one in taken if one is not None]

    def heard(self, facts: Facts, arrived: list[StatusText], now: float) -> list[Changed]:
        if facts.silence:
            return []
        for one in arrived:
            self.texts.take(facts.name, one, now, shows_failsafe=facts.failsafe is not None)
        if facts.failsafe is not None:
            self.texts.acts(facts.name, facts.failsafe, facts.failsafe_cause, now)
        if facts.armed is False:
            self.texts.disarmed(now)
        return self.lasting.take_all(text_alerts.RULES, self.texts.found(now), now)


class FakeTelemetry:
    def __init__(self) -> None:
        self.texts: deque[StatusText] = deque()


class FakeDrone:
    def __init__(self) -> None:
        self.telemetry = FakeTelemetry()


def stored(rule_name: str, number: int) -> Alert:
    subject = "radio failsafe" if rule_name in text_alerts.RULES else ""
    words = f"{rule_name} of before"
    return Alert(number, BY_NAME[rule_name], subject, DroneId(1), words, NOW)


def run(seed: int, changes: tuple[int, ...], seen: Counter[tuple[str, Change]]) -> None:
    chance = random.Random(seed)
    every, watched, drone = EveryLook(), WatchedDrone(), FakeDrone()
    values = {name: chance.choice(options) for name, options in VALUES.items()}
    now = 0.0
    for look in range(LOOKS):
        now += LOOK_S * chance.choice((1.0, 1.0, 1.0, 1.02, 4.0))
        for _ in range(chance.choice(changes)):
            name = chance.choice(list(VALUES))
            values[name] = chance.choice(VALUES[name])
        if chance.random() < 0.01:
            every.forget()
            watched.forget_conditions()
        if chance.random() < 0.01:
            alert = stored(chance.choice([rule.name for rule, _, _ in EVALUATED] + sorted(text_alerts.RULES)), look)
            if alert.key not in every.lasting.open:
                every.restore(alert, now)
                watched.restore(alert, now)
        if every.lasting.open and chance.random() < 0.02:
            rule_name, subject = chance.choice(sorted(every.lasting.open))
            left = Alert(look, BY_NAME[rule_name], subject, DroneId(1), "", NOW)
            every.forget_one(left)
            watched.forget(left)
        arrived = [StatusText(2, chance.choice(TEXTS))] if chance.random() < 0.05 else []
        drone.telemetry.texts.extend(arrived)
        expected = every.conditions(Facts(**values), now) + every.heard(Facts(**values), arrived, now)
        facts = Facts(**values)
        found = watched.conditions_found(facts, now)
        found += watched.texts_found(drone, facts, now)  # type: ignore[arg-type]
        if facts.silence:
            drone.telemetry.texts.clear()
        assert found == expected, (seed, look, now)
        assert watched.lasting.open == every.lasting.open, (seed, look)
        seen.update((one.key[0], one.change) for one in found)


def test_every_alert_opens_and_closes_at_the_same_look() -> None:
    seen: Counter[tuple[str, Change]] = Counter()
    for seed in SEEDS:
        run(seed, CHANGES, seen)
        run(seed, STEADY, seen)
    rules = {rule.name for rule, _, _ in EVALUATED} | text_alerts.RULES
    for change in (Change.OPENED, Change.CLOSED):
        assert {name for name, one in seen if one is change} == rules, "the sequences reach every rule"


def test_the_sequences_reach_every_fact() -> None:
    assert VALUES.keys() == {one.name for one in fields(Facts)}


def test_rules_do_not_run_while_nothing_changes(monkeypatch: pytest.MonkeyPatch) -> None:
    ran: Counter[str] = Counter()

    def counted(rule: Any, condition: Any) -> Any:
        def run_it(facts: Facts, is_open: bool) -> object:
            ran[rule.name] += 1
            return condition(facts, is_open)

        return run_it

    rules = tuple((rule, counted(rule, condition), key) for rule, condition, key in EVALUATED)
    monkeypatch.setattr("server.alerts.core.watched_drone.EVALUATED", rules)
    watched = WatchedDrone()
    facts = Facts(name="Merlin", armed=True, airborne=True, battery_percent=80)
    opened = [one.key[0] for look in range(40) for one in watched.conditions_found(replace(facts), look * LOOK_S)]
    assert opened == ["unattended"]
    assert ran["unattended"] == 4, "found, waited for 1 s, opened, and once more as open"
    watched.conditions_found(replace(facts, held_by="alice"), 20.0)
    assert ran["unattended"] == 5
