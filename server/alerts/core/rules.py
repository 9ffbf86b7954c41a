"""The table of rules: every condition that people are alerted to. The only place that lists them.

Its order is that of urgency: list, map and flight bar show the first open rule of a drone. docs/alerts.md has the same
table.
"""

from dataclasses import dataclass
from typing import Final

from server.alerts.core import flight_conditions as flight
from server.alerts.core import link_conditions as link
from server.alerts.core import tower_conditions as tower
from server.alerts.core.finding import Condition
from server.alerts.core.severity import Severity
from server.alerts.core.tower_facts import TowerCondition


@dataclass(frozen=True, kw_only=True)
class Rule:
    """`condition`: None where another part finds it (texts of the autopilot, pairs of drones)."""

    name: str
    severity: Severity
    badge: str
    """A few words for a row."""
    when: str
    """The condition in words, for the documentation."""
    advice: str
    """What to do."""
    condition: Condition | None = None
    tower_condition: TowerCondition | None = None
    """Of the tower itself: no drone is concerned, and admins are told."""
    opens_after_s: float = 0.0
    """How long the condition must last before the alert opens."""
    closes_after_s: float = 0.0
    """How long it must be over before the alert closes."""
    follows: bool = False
    """The words of an open alert follow the condition; otherwise they stay those of its beginning."""


_CRITICAL, _WARNING, _NOTICE = Severity.CRITICAL, Severity.WARNING, Severity.NOTICE

TOO_NEAR: Final = Rule(
    name="too-near",
    severity=_CRITICAL,
    badge="Too near",
    when="the separation watch warns: two drones are, or are about to be, nearer than the minimum",
    advice="Hold one of the two, then change its height.",
)
NEAR: Final = Rule(
    name="near",
    severity=_WARNING,
    badge="Near a drone",
    when="the separation watch cautions: two drones will come nearer than the minimum",
    advice="Watch both. Change the height or the course of one.",
)
FAILSAFE: Final = Rule(
    name="failsafe",
    severity=_CRITICAL,
    badge="Failsafe",
    when="the armed autopilot announces a failsafe, a crash or the like, until it reports the end or is disarmed; or "
    "its state shows that its failsafe has chosen the flight mode, as long as it does",
    advice="Read what the autopilot does now. Take over only if that is safer.",
    closes_after_s=1.0,
    follows=True,
)
MOTORS_STOPPED: Final = Rule(
    name="motors-stopped",
    severity=_CRITICAL,
    badge="Motors stopped",
    when="a multicopter was disarmed in the air and drops, whoever did it; until it is armed again",
    advice="Warn the people below. Look after people first, then at its battery.",
    condition=flight.motors_stopped,
)
AUTOPILOT_ERROR: Final = Rule(
    name="autopilot-error",
    severity=_WARNING,
    badge="Autopilot error",
    when="the armed autopilot sends an error or worse, for 60 s after the last one",
    advice="Read the message. Land if its cause is not clear.",
    follows=True,
)

NOISY: Final = Rule(
    name="noisy-drone",
    severity=_WARNING,
    badge="Sends too much",
    when="for 10 s more than 5 texts, 2 alerts, 2,000 frames or 20 reports a second; until it was quiet for 60 s",
    advice="Look at its autopilot and its agent. An admin may mute, limit or quarantine it.",
    condition=link.noisy,
    follows=True,
)

RULES: Final[tuple[Rule, ...]] = (
    Rule(
        name="link-lost",
        severity=_CRITICAL,
        badge="Lost in the air",
        when="the tower does not hear a drone that was in the air",
        advice="Keep its area clear and watch its way home. It acts by its own settings; the words say which.",
        condition=link.link_lost_in_air,
        closes_after_s=2.0,
    ),
    Rule(
        name="falls",
        severity=_CRITICAL,
        badge="Falls",
        when="a multicopter descends at 6 m/s or more; at 15, if flown by hand in a mode that keeps no height",
        advice="Warn the people below. Keep its area clear.",
        condition=flight.falls,
        follows=True,
    ),
    MOTORS_STOPPED,
    Rule(
        name="sinks",
        severity=_CRITICAL,
        badge="Sinks",
        when="a multicopter descends at 0.8 m/s or more in a hold that is confirmed",
        advice="Take control and climb, or land it where it is.",
        condition=flight.sinks_in_hold,
        opens_after_s=2.0,  # a hold out of a full descent needs nearly two seconds to end it
        closes_after_s=2.0,
        follows=True,
    ),
    Rule(
        name="crashed",
        severity=_CRITICAL,
        badge="Crashed",
        when="a fall ended on the ground, or it lies on its side with its motors armed; until it flies again",
        advice="Disarm it before anybody goes near. Look after people first, then at its battery.",
        condition=flight.crashed,
    ),
    Rule(
        name="silent",
        severity=_CRITICAL,
        badge="Autopilot silent",
        when="the agent of a drone in the air does not hear its autopilot",
        advice="Look at the drone if you can. Commands do not reach the autopilot.",
        condition=link.autopilot_silent,
        opens_after_s=3.0,
        closes_after_s=2.0,
    ),
    Rule(
        name="deaf-autopilot",
        severity=_CRITICAL,
        badge="Hears no command",
        when="the autopilot is heard, and has answered nothing that its agent asked for 10 s",
        advice="Fly by transmitter. On the ground: look at the line to the autopilot, and whether it asks for signing.",
        condition=link.deaf_autopilot,
    ),
    Rule(
        name="aircraft-near",
        severity=_CRITICAL,
        badge="Aircraft near",
        when="a manned aircraft is or will be nearer than 600 m, and 150 m in height, within 60 s; in the air",
        advice="Go down and land, or fly away from its way. A manned aircraft has the right of way.",
        condition=flight.aircraft_near,
        closes_after_s=5.0,
        follows=True,
    ),
    TOO_NEAR,
    Rule(
        name="battery-critical",
        severity=_CRITICAL,
        badge="Battery critical",
        when="by the autopilot's threshold; at 15 % if it has none. Armed or in the air",
        advice="Land now, at the nearest safe place.",
        condition=flight.battery_critical,
        opens_after_s=2.0,
        closes_after_s=10.0,
    ),
    Rule(
        name="hold-unconfirmed",
        severity=_CRITICAL,
        badge="Hold unconfirmed",
        when="the agent gave up a hold that the autopilot did not confirm, until a later one is confirmed",
        advice="Treat the drone as uncontrolled. Order the hold again or take over.",
        condition=link.hold_unconfirmed,
    ),
    FAILSAFE,
    Rule(
        name="fence-breached",
        severity=_CRITICAL,
        badge="Fence breached",
        when="the autopilot reports a breach of its fence, in the air",
        advice="Bring it back inside. The autopilot acts by its fence action.",
        condition=flight.fence_breached,
        closes_after_s=3.0,
    ),
    Rule(
        name="zone-breached",
        severity=_CRITICAL,
        badge="In a zone",
        when="in a zone that refuses it, above its height, or outside of its corridors, in the air",
        advice="Leave by the shortest way. The way out is free; flown by hand it holds when it goes deeper.",
        condition=flight.zone_breached,
        closes_after_s=2.0,
        follows=True,
    ),
    Rule(
        name="estimator",
        severity=_CRITICAL,
        badge="Position not trusted",
        when="the position estimator (EKF) is beyond its limits, in the air",
        advice="Fly by hand in a mode that needs no position, and land.",
        condition=flight.estimator,
        opens_after_s=1.0,
        closes_after_s=5.0,
    ),
    Rule(
        name="emergency",
        severity=_CRITICAL,
        badge="Emergency",
        when="the heartbeat reports the state critical or emergency",
        advice="Read the autopilot's messages. Land as soon as it is safe.",
        condition=flight.autopilot_emergency,
        opens_after_s=1.0,
        closes_after_s=3.0,
    ),
    Rule(
        name="tower-database-damaged",
        severity=_CRITICAL,
        badge="Database damaged",
        when="the file of the database is not whole; looked at once at the start of the tower, and every day",
        advice="Stop the tower and restore the newest backup. Look at the disk: it has lost what was written.",
        tower_condition=tower.database_damaged,
        follows=True,
    ),
    Rule(
        name="tower-disk-full",
        severity=_CRITICAL,
        badge="Tower's disk full",
        when="less than 268 MB are free on a disk of the tower",
        advice="Free space on the tower. Until then it records no flights, videos and logs.",
        tower_condition=tower.disk_full,
        opens_after_s=10.0,
        closes_after_s=60.0,
    ),
    Rule(
        name="tower-certificate-ends",
        severity=_CRITICAL,
        badge="Certificate ends",
        when="the TLS certificate of the tower expires within 3 days, or has expired",
        advice="Renew the certificate now. When it has expired, browsers and agents refuse the tower.",
        tower_condition=tower.certificate_ends,
        follows=True,
    ),
    Rule(
        name="battery-low",
        severity=_WARNING,
        badge="Battery low",
        when="by the autopilot's threshold; at 30 % if it has none. Armed or in the air",
        advice="Return while the battery is enough for the way home.",
        condition=flight.battery_low,
        opens_after_s=2.0,
        closes_after_s=10.0,
    ),
    Rule(
        name="gps",
        severity=_WARNING,
        badge="No GPS",
        when="no 3D fix, in the air",
        advice="Fly by hand in a mode that needs no position, and wait for satellites.",
        condition=flight.gps,
        opens_after_s=2.0,
        closes_after_s=5.0,
    ),
    Rule(
        name="sensor",
        severity=_WARNING,
        badge="Sensor",
        when="a gyroscope, accelerometer, compass or barometer is ill, or one of several GPS has no fix, in the air",
        advice="It flies on what is left. Land soon, and find the cause.",
        condition=flight.sensor,
        opens_after_s=1.0,
        closes_after_s=5.0,
    ),
    NEAR,
    Rule(
        name="foreign-drone-near",
        severity=_WARNING,
        badge="Foreign drone near",
        when="a drone with Remote ID is or will be nearer than 60 m, and 30 m in height, within 20 s; in the air",
        advice="Look for it. Change the height or the course.",
        condition=flight.foreign_drone_near,
        closes_after_s=5.0,
        follows=True,
    ),
    Rule(
        name="zone-near",
        severity=_WARNING,
        badge="Near a zone",
        when="15 s from a zone as it flies now, or 10 m from its edge; or in one that only warns; in the air",
        advice="Turn away or stop. Flown by hand it holds in front of the edge of a zone that refuses it.",
        condition=flight.zone_near,
        closes_after_s=2.0,
        follows=True,
    ),
    Rule(
        name="link-lost-on-ground",
        severity=_WARNING,
        badge="Lost while armed",
        when="the tower does not hear a drone that was armed on the ground; one that is switched off is no news",
        advice="Keep away from it: its motors may turn.",
        condition=link.link_lost_on_ground,
        opens_after_s=2.0,
        closes_after_s=2.0,
    ),
    Rule(
        name="lost-action-counting",
        severity=_WARNING,
        badge="Acts by itself soon",
        when="the agent counts down to the lost action: nobody flies the drone, or the tower is lost",
        advice='Take control and fly it, or say "stay".',
        condition=link.lost_action_counting,
        closes_after_s=1.0,
        follows=True,
    ),
    Rule(
        name="lost-action",
        severity=_WARNING,
        badge="Acts by itself",
        when="the agent carries out the lost action, or has done so",
        advice="Let it finish, or take control.",
        condition=link.lost_action,
        closes_after_s=1.0,
        follows=True,
    ),
    Rule(
        name="height-limit",
        severity=_WARNING,
        badge="Too high",
        when="above the lowest of TOWER_HEIGHT_LIMIT_M and the limit of the holder's loan, in the air",
        advice="Descend.",
        condition=flight.height_limit,
        opens_after_s=2.0,
        closes_after_s=3.0,
    ),
    Rule(
        name="vibration",
        severity=_WARNING,
        badge="Vibration",
        when="60 m/s² or more on one axis, in the air",
        advice="Slow down and land. Look at propellers and mounts.",
        condition=flight.vibration,
        opens_after_s=5.0,
        closes_after_s=10.0,
    ),
    AUTOPILOT_ERROR,
    Rule(
        name="motion",
        severity=_WARNING,
        badge="Position doubtful",
        when="an armed drone moves as no machine can",
        advice="Do not rely on the map. Keep other drones away.",
        condition=flight.suspicious_motion,
    ),
    Rule(
        name="unattended",
        severity=_WARNING,
        badge="Unattended",
        when="in the air, nobody has the controls, and no countdown or lost action says so",
        advice="Somebody should take control.",
        condition=link.unattended,
        opens_after_s=1.0,
    ),
    Rule(
        name="armed-unattended",
        severity=_WARNING,
        badge="Armed, unattended",
        when="armed on the ground, and nobody has the controls, or a hold is open",
        advice="Keep away from it: its motors may turn. Disarm it.",
        condition=link.armed_unattended,
        opens_after_s=5.0,
    ),
    Rule(
        name="wrong-signing-key",
        severity=_WARNING,
        badge="Wrong key",
        when="what the agent hears of its autopilot is not signed with its key",
        advice="Was the autopilot changed or erased? Remove the key on the page Setup, and set up signing again.",
        condition=link.wrong_signing_key,
        closes_after_s=2.0,
    ),
    Rule(
        name="other-autopilot",
        severity=_WARNING,
        badge="Two on one line",
        when="the agent hears another autopilot on the line of its own",
        advice="Make the other vehicle a drone of its own, or give it a line of its own. Nobody can fly or hold it.",
        condition=link.other_autopilot,
        closes_after_s=2.0,
        follows=True,
    ),
    NOISY,
    Rule(
        name="battery-on-ground",
        severity=_WARNING,
        badge="Battery low",
        when="the battery of a disarmed drone is low or critical",
        advice="Charge or change the battery before take-off.",
        condition=flight.battery_on_ground,
        opens_after_s=5.0,
        closes_after_s=5.0,
    ),
    Rule(
        name="tower-disk-low",
        severity=_WARNING,
        badge="Tower's disk low",
        when="less than TOWER_DISK_LOW_MB are free on a disk of the tower",
        advice="Free space on the tower, or lower the budgets of stored files.",
        tower_condition=tower.disk_low,
        opens_after_s=60.0,
        closes_after_s=60.0,
    ),
    Rule(
        name="tower-stands-still",
        severity=_WARNING,
        badge="Tower too busy",
        when="a piece of the tower's own work has kept all sticks and frames waiting for 250 ms or more",
        advice="Look in the tower's log for loop_held: it has the time and the place. Tell us, with that line.",
        tower_condition=tower.stands_still,
        follows=True,
    ),
    Rule(
        name="tower-part-fails",
        severity=_WARNING,
        badge="Tower has an error",
        when="a part of the tower had an error in the last ten minutes, which cost one drone one look or one message",
        advice="Look in the tower's log for part_failed: it has the stack. Tell us, with that line.",
        tower_condition=tower.part_fails,
        follows=True,
    ),
    Rule(
        name="tower-certificate",
        severity=_WARNING,
        badge="Certificate expiring",
        when="the TLS certificate of the tower expires within 14 days",
        advice="Renew the certificate, and see why it was not renewed by itself.",
        tower_condition=tower.certificate_ends_soon,
        follows=True,
    ),
    Rule(
        name="on-hold",
        severity=_NOTICE,
        badge="On hold",
        when="a hold is open",
        advice="Take control to fly on.",
        condition=link.on_hold,
        closes_after_s=1.0,
    ),
    Rule(
        name="black-box",
        severity=_NOTICE,
        badge="No black box",
        when="the drone's own disk is full, broken or too slow for the recording of its flights",
        advice="Look at the memory card before the next flight.",
        condition=link.black_box_failing,
        opens_after_s=2.0,
        closes_after_s=2.0,
        follows=True,
    ),
)
"""The most urgent first."""

BY_NAME: Final = {rule.name: rule for rule in RULES}
RANK: Final = {rule.name: rank for rank, rule in enumerate(RULES)}
EVALUATED: Final = tuple((rule, rule.condition, (rule.name, "")) for rule in RULES if rule.condition is not None)
"""Each with its condition, and its key in `Lasting`."""
OF_TOWER: Final = tuple((rule, rule.tower_condition) for rule in RULES if rule.tower_condition is not None)
"""Those of the tower itself."""
