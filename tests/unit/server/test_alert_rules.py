"""Every rule of the table opens once and clears, and says nothing while nothing is known."""

from dataclasses import replace
from datetime import UTC, datetime

import pytest

from server.alerts.core.facts import Facts
from server.alerts.core.finding import Not
from server.alerts.core.lasting import Change, Lasting
from server.alerts.core.rules import BY_NAME, EVALUATED, RULES, Rule
from server.alerts.core.severity import Severity
from server.fleet.core.views import HoldView
from wire.autopilots.profile import FlightTask
from wire.open_holds import AfterSticks, HoldStage, Lost, LostAction, LostPhase
from wire.signing_key import Signing

FLYING = Facts(name="Merlin", armed=True, airborne=True, held_by="alice", height_m=20.0)
PARKED = Facts(name="Merlin", armed=False, airborne=False, held_by="alice")
HOLD = HoldView(
    open=True,
    stage=HoldStage.STAY,
    mode="BRAKE",
    sticks=False,
    after_sticks=AfterSticks.STAYS,
    waiting_for="",
    lost=Lost.PERSON,
    nobody_because="alice released the controls",
    phase=LostPhase.COUNTING,
    action=LostAction.RETURN,
    due_at=datetime(2026, 1, 1, 12, 30, tzinfo=UTC),
    detail="",
    as_of=datetime(2026, 1, 1, 12, 29, tzinfo=UTC),
    stale=False,
)
LOST = replace(FLYING, silence="link", mode="AUTO", task=FlightTask.MISSION)

# What opens the rule, what closes it again, and a part of the words.
SCENES: dict[str, tuple[Facts, Facts, str]] = {
    "link-lost": (LOST, FLYING, "Merlin lost its link in the air at 20 m. It flew its mission; it returns after 30 s"),
    "silent": (replace(FLYING, silence="autopilot"), FLYING, "The autopilot of Merlin is silent in the air"),
    "battery-critical": (replace(FLYING, battery_charge=3), replace(FLYING, battery_charge=1), "Merlin is critical"),
    "hold-unconfirmed": (replace(FLYING, hold_unconfirmed="no answer"), FLYING, "did not confirm its hold: no answer"),
    "fence-breached": (
        replace(FLYING, fence_breach="its boundary"),
        replace(FLYING, fence_breach=""),
        "Merlin broke its boundary",
    ),
    "aircraft-near": (
        replace(FLYING, aircraft_near="an aircraft (HELI1) comes near: 800 m to the east, at the same height"),
        FLYING,
        "Merlin: an aircraft (HELI1) comes near",
    ),
    "foreign-drone-near": (
        replace(FLYING, foreign_drone_near="a drone of somebody else comes near: 40 m to the east, 10 m lower"),
        FLYING,
        "Merlin: a drone of somebody else comes near",
    ),
    "zone-breached": (
        replace(FLYING, zone_breach="is in the no-fly zone Airport"),
        FLYING,
        "Merlin is in the no-fly zone Airport.",
    ),
    "zone-near": (
        replace(FLYING, zone_near="reaches the no-fly zone Airport in about 10 s, 80 m ahead"),
        FLYING,
        "Merlin reaches the no-fly zone Airport in about 10 s",
    ),
    "estimator": (
        replace(FLYING, estimator_fault="bad compass"),
        replace(FLYING, estimator_fault=""),
        "position estimate (EKF): bad compass",
    ),
    "emergency": (replace(FLYING, system_status=6), replace(FLYING, system_status=4), "reports an emergency"),
    "battery-low": (
        replace(FLYING, battery_percent=28, battery_charge=2),
        replace(FLYING, battery_percent=28, battery_charge=1),
        "The battery of Merlin is low by its autopilot's threshold: 28 %",
    ),
    "gps": (replace(FLYING, gps_lost=True), replace(FLYING, gps_lost=False), "Merlin has no GPS fix"),
    "sensor": (
        replace(FLYING, sensor_fault="its compass"),
        replace(FLYING, sensor_fault=""),
        "Merlin flies with a sensor that fails: its compass.",
    ),
    "link-lost-on-ground": (
        Facts(name="Merlin", silence="link", armed=True, airborne=False),
        PARKED,
        "on the ground with its motors armed",
    ),
    "lost-action-counting": (
        replace(FLYING, hold=HOLD),
        FLYING,
        "Nobody flies Merlin (alice released the controls). It returns at 12:30:00 UTC, unless somebody flies it or "
        'says "stay".',
    ),
    "lost-action": (
        replace(FLYING, hold=HOLD.model_copy(update={"phase": LostPhase.DONE, "lost": Lost.TOWER})),
        FLYING,
        "Merlin acts by itself. It returns: it had lost the tower",
    ),
    "height-limit": (
        replace(FLYING, height_m=121.0, height_limit_m=120.0),
        replace(FLYING, height_m=117.0, height_limit_m=120.0),
        "Merlin is at 121 m, above the limit of 120 m",
    ),
    "vibration": (
        replace(FLYING, vibration_m_s2=61.0),
        replace(FLYING, vibration_m_s2=20.0),
        "Merlin vibrates too much: 61 m/s²",
    ),
    "motion": (replace(FLYING, motion="jump"), FLYING, "Do not trust the position of Merlin. Its position jumped"),
    "unattended": (replace(FLYING, held_by=None), FLYING, "Merlin is in the air, and nobody has the controls"),
    "armed-unattended": (
        replace(PARKED, armed=True, held_by=None),
        PARKED,
        "Merlin stands on the ground with its motors armed, and nobody flies it",
    ),
    "deaf-autopilot": (
        replace(PARKED, hears_agent=False),
        replace(PARKED, hears_agent=True),
        "The autopilot of Merlin does not answer its agent",
    ),
    "falls": (
        replace(FLYING, falls="12 m/s, 20 m above home"),
        FLYING,
        "Merlin falls: 12 m/s, 20 m above home",
    ),
    "motors-stopped": (
        replace(FLYING, motors_stopped="61 m above home"),
        FLYING,
        "The motors of Merlin stopped in the air, 61 m above home",
    ),
    "sinks": (
        replace(FLYING, hold=HOLD, sinks="1.2 m/s, 18 m above home"),
        replace(FLYING, hold=HOLD),
        "Merlin sinks although it holds: 1.2 m/s, 18 m above home",
    ),
    "crashed": (
        replace(FLYING, crashed="it fell about 28 m to the ground"),
        FLYING,
        "Merlin has crashed: it fell about 28 m to the ground",
    ),
    "other-autopilot": (
        replace(PARKED, other_systems=(2,)),
        PARKED,
        "Another autopilot, system 2, is on the line of Merlin",
    ),
    "wrong-signing-key": (
        replace(PARKED, signing=Signing.WRONG_KEY),
        PARKED,
        "The autopilot of Merlin does not sign with the key of its agent",
    ),
    "noisy-drone": (replace(PARKED, noise="9 texts a second: muted"), PARKED, "Merlin sends 9 texts a second: muted."),
    "battery-on-ground": (replace(PARKED, battery_percent=10), replace(PARKED, battery_percent=90), "critical: 10 %"),
    "on-hold": (replace(FLYING, hold=HOLD, hold_reason="airspace closed"), FLYING, "Merlin is on hold: airspace"),
    "black-box": (
        replace(FLYING, black_box_problem="the disk is full"),
        FLYING,
        "The black box of Merlin records nothing: the disk is full",
    ),
}
UNKNOWN = Facts(name="Merlin", silence="link")
BY_OTHERS = {"near", "too-near", "failsafe", "autopilot-error"}
"""Found in pairs and texts: see the tests of those."""


def test_one_danger_is_one_alert() -> None:
    """The countdown says that nobody flies it. Once somebody said "stay", only `unattended` does."""
    rule = BY_NAME["unattended"]
    assert rule.condition is not None
    for phase in LostPhase:
        hold = HOLD.model_copy(update={"phase": phase})
        found = rule.condition(replace(FLYING, held_by=None, hold=hold), False)
        told = phase in (LostPhase.QUIET, LostPhase.STAYED)
        assert (found is not Not.SO) == told, phase


def test_every_rule_has_a_scene_and_all_its_words() -> None:
    of_tower = {rule.name for rule in RULES if rule.tower_condition is not None}  # test_tower_alerts.py
    assert SCENES.keys() | BY_OTHERS | of_tower == BY_NAME.keys()
    assert {rule.name for rule, _, _ in EVALUATED} == SCENES.keys()
    assert len(BY_NAME) == len(RULES)
    for rule in RULES:
        assert rule.badge and rule.when and rule.advice.endswith("."), rule.name
        assert len(rule.badge) <= 20
    ranks = [list(Severity).index(rule.severity) for rule in RULES]
    assert ranks == sorted(ranks), "the table goes from the worst to the mildest"


@pytest.mark.parametrize("rule", [rule for rule, _, _ in EVALUATED], ids=lambda rule: rule.name)
def test_a_rule_opens_once_and_clears(rule: Rule) -> None:
    assert rule.condition is not None
    bad, good, words = SCENES[rule.name]
    lasting, changes = Lasting(), []
    steps = [(good, 5.0), (bad, 30.0), (UNKNOWN, 30.0), (bad, 5.0), (good, 30.0)]
    now, began = 0.0, 0.0
    for facts, for_s in steps:
        began, end = now, now + for_s
        while now < end:
            found = rule.condition(facts, (rule.name, "") in lasting.open)
            changed = lasting.take(rule, "", found, now)
            if changed is not None:
                changes.append((changed, now - began))
            now += 0.5
    assert [one.change for one, _ in changes] == [Change.OPENED, Change.CLOSED]
    (opened, open_after_s), (_, closed_after_s) = changes
    assert words in opened.words
    assert opened.words.count("Merlin") >= 1
    assert open_after_s == pytest.approx(rule.opens_after_s, abs=0.5)
    assert closed_after_s == pytest.approx(rule.closes_after_s, abs=0.5)


@pytest.mark.parametrize("rule", [rule for rule, _, _ in EVALUATED], ids=lambda rule: rule.name)
def test_a_moment_is_no_alert_where_the_rule_waits(rule: Rule) -> None:
    assert rule.condition is not None
    bad, good, _ = SCENES[rule.name]
    lasting = Lasting()
    taken = [lasting.take(rule, "", rule.condition(facts, False), now) for facts, now in ((bad, 0.0), (good, 0.5))]
    assert (taken[0] is None) is (rule.opens_after_s > 0)


def test_what_is_only_a_worry_in_the_air_is_none_on_the_ground() -> None:
    worse = replace(
        PARKED,
        gps_fix=0,
        estimator_fault="bad position",
        vibration_m_s2=99.0,
        fence_breach="its boundary",
        height_m=500.0,
        height_limit_m=120.0,
        held_by=None,
    )
    found = {rule.name for rule, condition, _ in EVALUATED if isinstance(condition(worse, False), str)}
    assert found == set()


def test_a_drone_that_was_switched_off_on_the_ground_is_no_news() -> None:
    off = Facts(name="Merlin", silence="link", armed=False, airborne=False)
    assert all(not isinstance(condition(off, False), str) for _, condition, _ in EVALUATED)


@pytest.mark.parametrize(
    ("percent", "charge", "expected"),
    [
        (31, None, {}),
        (30, None, {"battery-low"}),
        (16, None, {"battery-low"}),
        (15, None, {"battery-critical"}),
        (50, 2, {"battery-low"}),
        (50, 3, {"battery-critical"}),
        (50, 6, {"battery-critical"}),
        (20, 1, {}),
        (15, 1, {"battery-low"}),
        (None, 1, {}),
        (None, None, {}),
    ],
)
def test_the_battery_by_the_autopilots_thresholds_or_ours(
    percent: int | None, charge: int | None, expected: set[str]
) -> None:
    facts = replace(FLYING, battery_percent=percent, battery_charge=charge)
    found = {rule.name for rule, condition, _ in EVALUATED if isinstance(condition(facts, False), str)}
    assert found == set(expected)


def test_a_percentage_that_jitters_at_a_limit_is_one_alert() -> None:
    rule = BY_NAME["battery-low"]
    assert rule.condition is not None
    lasting, changes = Lasting(), []
    for second in range(120):
        facts = replace(FLYING, battery_percent=30 + second % 3)
        changes.append(lasting.take(rule, "", rule.condition(facts, bool(lasting.open)), float(second)))
    assert [one.change for one in changes if one is not None] == []
    for second in range(120, 240):
        facts = replace(FLYING, battery_percent=30 + max(0, second % 3 - 1))
        facts = replace(facts, battery_percent=29) if second < 126 else facts
        changes.append(lasting.take(rule, "", rule.condition(facts, bool(lasting.open)), float(second)))
    assert [one.change for one in changes if one is not None] == [Change.OPENED]


@pytest.mark.parametrize(
    ("facts", "words"),
    [
        (replace(LOST, task=FlightTask.BY_HAND), "It was flown by hand; it holds, then it returns after 30 s"),
        (replace(LOST, task=FlightTask.RETURN), "It was returning, and should go on with that."),
        (replace(LOST, lost_action=LostAction.STAY), "It flew its mission; it stays until the battery is needed"),
        (replace(LOST, lost_action=LostAction.LAND, lost_action_s=12.0), "it lands after 12 s without the tower"),
        (
            replace(LOST, lost_action=None),
            "It flew its mission. It is watched only: what comes next is up to its autop",
        ),
        (replace(LOST, task=None, mode="GUIDED"), "It was in GUIDED; it returns"),
        (replace(LOST, hold=HOLD), "It held in BRAKE; it returns"),
        (replace(LOST, task=None, mode=""), "It is not known what it did; it returns"),
    ],
)
def test_the_words_of_a_lost_drone_say_what_it_does(facts: Facts, words: str) -> None:
    condition = BY_NAME["link-lost"].condition
    assert condition is not None
    assert words in str(condition(facts, False))


def test_nothing_known_opens_and_closes_nothing() -> None:
    assert {rule.name for rule, condition, _ in EVALUATED if condition(UNKNOWN, True) is not Not.KNOWN} == set()
