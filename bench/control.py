"""How fast and how well the controls change hands: from the event that ends manual flight to a vehicle that holds.

Real tower, agent and simulator; operator and admin are programs on the live channel. Measured at the autopilot's port.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import math
import shutil
import tempfile
from collections.abc import Coroutine, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bench.control_flown import fly_table
from bench.control_triggers import OTHERS, TAKE, Trigger
from bench.hand_flight import AXES, HandFlight
from bench.hold_figures import WATCHED_S, HoldFigures, began_at, figures, mode_shown_at
from bench.namespaces import emulated_network, why_not
from bench.person import Person, Refused, Sticks
from bench.rig import SLOW, Kind, Rig, running, wait_for
from bench.rows import Report, percentile
from bench.tap import ADMIN, OPERATOR

FULL_STICK_S = 2.0
USUAL = {"rtt_limit_ms": 500.0, "rtt_limit_s": 1.0}
PATIENT = {"rtt_limit_ms": 5000.0, "rtt_limit_s": 10.0}
QUICK_AXES = ("pitch forward", "climb", "descend")
MODE_BY_S = 20.0
FOREIGN = "old_holders_frames_after_hold_began"
_EXPECTED = (Refused, TimeoutError, OSError, RuntimeError)


@dataclass
class Trial:
    rig: Rig
    flight: HandFlight
    report: Report
    label: str

    def case(self, name: str) -> str:
        return f"{name}, {self.label}"

    @property
    def hold_numbers(self) -> set[int]:
        modes = self.flight.modes
        return {modes.number(modes.altitude_hold), modes.number(modes.position_number)}


async def run(report: Report, options: argparse.Namespace) -> None:
    """Runs the flown table if requested (`--autopilot`, `--flown`), else the measurements of speed and quality."""
    with _folder(options.keep) as folder:
        if options.autopilot is not None or options.flown:
            await fly_table(report, options, folder)
        else:
            await _measure(report, options, folder)


async def _measure(report: Report, options: argparse.Namespace, folder: Path) -> None:
    """Measures every kind of vehicle, on loopback and on the emulated network, unless options limit it."""
    kinds = [
        Kind(flavour, radio)
        for flavour in ("ardupilot", "px4")
        for radio in (True, False)
        if flavour in (options.flavour or (flavour,))
        if ("with" if radio else "without") in (options.radio or ("with", "without"))
    ]
    networks = [False] if options.loopback else [True] if options.network else [False, True]
    if True in networks and (reason := why_not()) is not None:
        report.say(f"no emulated network: this needs {reason}")
        networks = [False]
    for slow in networks:
        for kind in kinds:
            where = folder / f"{kind.flavour}-{'radio' if kind.radio else 'alone'}-{'slow' if slow else 'near'}"
            await _one_kind(report, options, where, kind, slow)


@contextlib.contextmanager
def _folder(keep: Path | None) -> Iterator[Path]:
    folder = Path(tempfile.mkdtemp(prefix="bench-")) if keep is None else keep
    try:
        yield folder
    finally:
        if keep is None:
            shutil.rmtree(folder, ignore_errors=True)


async def _one_kind(report: Report, options: argparse.Namespace, where: Path, kind: Kind, slow: bool) -> None:
    label = f"{kind.name}, {'300 ms RTT 5 % loss' if slow else 'loopback'}"
    report.say(f"[bold]{label}[/bold]")
    try:
        if slow:
            async with emulated_network({"drone": SLOW}) as network:
                with network.inside("tower"):
                    async with running(where, kind, network) as rig:
                        await _all_cases(Trial(rig, HandFlight(rig), report, label), options)
        else:
            async with running(where, kind, None) as rig:
                await _all_cases(Trial(rig, HandFlight(rig), report, label), options)
    except _EXPECTED as error:
        report.say(f"  given up: {type(error).__name__}: {error}")
        report.add(label, "given_up", 1, "count")


async def _all_cases(trial: Trial, options: argparse.Namespace) -> None:
    rounds = options.rounds or (5 if options.quick else 40)
    repeats = options.repeats if options.repeats is not None else (0 if options.quick else 10)
    axes = QUICK_AXES if options.quick else tuple(AXES)
    # A bad line must not end flights that measure something else; a separate case measures that it does.
    await _set(trial, PATIENT)
    await trial.flight.take_off()
    await trial.flight.back_to_start()

    def wanted(name: str) -> bool:
        return not options.case or any(part in name for part in options.case)

    if wanted("undisturbed"):
        await _attempt(trial, "undisturbed", _undisturbed(trial, 15.0 if options.quick else 60.0))
    if wanted("take and give"):
        await _attempt(trial, "take and give", _latencies(trial, rounds))
    for axis in axes:
        if wanted(f"take at {axis}"):
            await _attempt(trial, f"take at {axis}", _motion(trial, TAKE, f"take at {axis}", AXES[axis]))
    if wanted("take into position hold"):
        await _attempt(trial, "take into position hold", _position_hold(trial))
    for trigger in OTHERS:
        if wanted(trigger.name) and (trial.rig.has_line or not trigger.needs_line):
            if trigger.needs_usual_limits:
                await _set(trial, USUAL)
            await _attempt(trial, trigger.name, _motion(trial, trigger, trigger.name, AXES["pitch forward"]))
            if repeats:
                await _attempt(trial, trigger.name, _repeated(trial, trigger, repeats))
            await _set(trial, PATIENT)


async def _set(trial: Trial, settings: dict[str, Any]) -> None:
    await trial.rig.admin.ask("PATCH", "/drones/1/settings", settings)


async def _undisturbed(trial: Trial, seconds: float) -> None:
    """Manual flight with no fault except the line: counts unnecessary holds."""
    admin = trial.rig.admin
    await _set(trial, USUAL)
    began = admin.now
    await wait_for("the quiet time to pass", lambda: admin.now > began + seconds, seconds + 5)
    await _set(trial, PATIENT)
    holds = [event for at, event in admin.events if at > began and event["type"] == "hold"]
    count = sum(event["step"] == "ordered" for event in holds)
    trial.report.add(trial.case("undisturbed"), "holds_for_nothing", 60.0 * count / seconds, "1/min")
    trial.report.say(f"  undisturbed: {count} holds in {seconds:g} s")
    await trial.flight.back_to_start()


async def _attempt(trial: Trial, name: str, work: Coroutine[Any, Any, None]) -> None:
    """A failure is a row of its own; the others still run if the drone can be recovered."""
    try:
        await work
        return
    except _EXPECTED as error:
        trial.report.say(f"  {name}: failed: {type(error).__name__}: {error}")
        trial.report.add(trial.case(name), "failed", 1, "count")
    await _recover(trial.rig)


async def _recover(rig: Rig) -> None:
    rig.operator.pong_delay_s = 0.0
    if rig.has_line:
        await rig.change_line(SLOW)
    if rig.tower.returncode is not None:
        await rig.start_tower()
    for person in (rig.admin, rig.operator):
        await person.vanish()
        await person.go_live()
    drone = await rig.admin.drone()
    if drone["holder"] is not None and drone["holder"]["name"] == "admin":
        await rig.admin.control("release")
    rig.operator.sticks = Sticks()
    drone = await rig.admin.drone()
    if drone["holder"] is None:
        await rig.operator.control("acquire")


async def _latencies(trial: Trial, rounds: int) -> None:
    """Takes and gives repeatedly, while the old holder's sticks continue."""
    rig, report = trial.rig, trial.report
    took, answered, at_port = ({verb: list[float]() for verb in ("take", "give", "accept")} for _ in range(3))
    foreign = dict.fromkeys(took, 0)
    sticks = list(AXES.values())
    for number in range(rounds):
        await trial.flight.by_hand()
        # Out of phase with the autopilot's heartbeats, which determine how soon a mode is reported.
        await trial.flight.full_stick(sticks[number % len(sticks)], 0.3 + number * 0.618 % 1.0)
        rig.tap.forget()
        foreign["take"] += await _change(trial, "take", rig.admin, OPERATOR, took, answered, at_port)
        rig.admin.sticks = Sticks()
        await _centred(rig, ADMIN)
        # The admin flies by hand, too, so that giving back is a hold in flight.
        await trial.flight.change_mode(trial.flight.modes.by_hand, by=rig.admin)
        rig.tap.forget()
        rig.operator.sticks = Sticks()
        # Until acceptance the admin is still the holder: frames of the operator must not pass.
        foreign["give"] += await _change(trial, "give", rig.admin, OPERATOR, took, answered, at_port)
        rig.tap.forget()
        foreign["accept"] += await _change(trial, "accept", rig.operator, ADMIN, took, answered, at_port)
        rig.admin.sticks = None
        if number % 10 == 9:
            await trial.flight.back_to_start()
    for verb in took:
        case = trial.case(verb)
        report.spread(case, "request_to_confirmed", took[verb], "ms")
        report.spread(case, "answer_to_confirmed", answered[verb], "ms")
        report.spread(case, "request_to_mode_at_port", at_port[verb], "ms")
        report.add(case, FOREIGN, foreign[verb], "count")


async def _change(
    trial: Trial,
    verb: str,
    asker: Person,
    old_holder: int,
    took: dict[str, list[float]],
    answered: dict[str, list[float]],
    at_port: dict[str, list[float]],
) -> int:
    """Changes hands once; returns the number of the old holder's frames that arrived after the change began."""
    rig = trial.rig
    sent_at = rig.admin.now
    body = {"sticks_centred": True} if verb == "accept" else {}
    asking = asyncio.ensure_future(asker.control(verb, **body))
    try:
        confirmed_at, event = await rig.admin.until_hold(since=sent_at)
    finally:
        await asyncio.gather(asking, return_exceptions=True)
    asking.result()
    answered_at = asker.answered_at
    took[verb].append((confirmed_at - sent_at) * 1e3)
    answered[verb].append((confirmed_at - answered_at) * 1e3)
    if event["step"] != "confirmed":
        raise RuntimeError(f"the hold ended {event['step']}")
    shown = mode_shown_at(rig.tap, sent_at, trial.hold_numbers)
    if shown is not None:
        at_port[verb].append((shown - sent_at) * 1e3)
    settle_until = rig.admin.now + 0.4
    await wait_for("late frames", lambda: rig.admin.now >= settle_until)
    return max(figures(rig.tap, sent_at, old_holder, trial.hold_numbers).foreign_frames, 0)


async def _centred(rig: Rig, who: int) -> None:
    """Waits until this person's centred sticks arrive and the agent's have stopped."""
    since = rig.admin.now
    await wait_for(
        "the new holder's sticks at the autopilot",
        lambda: any(stick.who == who and stick.at > since for stick in rig.tap.sticks),
        10,
    )


async def _motion(trial: Trial, trigger: Trigger, name: str, sticks: Sticks) -> None:
    """Triggers one hold at full stick, and records the motion for six seconds."""
    rig, flight, report = trial.rig, trial.flight, trial.report
    await flight.back_to_start()
    await flight.full_stick(sticks, FULL_STICK_S)
    rig.tap.forget()
    at = await trigger.pull(rig)
    if trigger.reported:
        confirmed_at, _ = await rig.admin.until_hold(since=at, timeout_s=MODE_BY_S)
        report.add(trial.case(name), "to_confirmed", (confirmed_at - at) * 1e3, "ms")
    await wait_for("the hold's mode", lambda: mode_shown_at(rig.tap, at, trial.hold_numbers) is not None, MODE_BY_S)
    start = began_at(rig.tap, at) or at
    await wait_for("the watch to end", lambda: rig.admin.now > start + WATCHED_S + 0.1)
    found = figures(rig.tap, at, trigger.old_holder if trigger.old_holder is not None else -1, trial.hold_numbers)
    _write(trial, name, found, at)
    await trigger.mend(rig)


async def _repeated(trial: Trial, trigger: Trigger, rounds: int) -> None:
    """Repeats one trigger along all axes: measures the time until the vehicle holds."""
    rig, flight, report, case = trial.rig, trial.flight, trial.report, trial.case(trigger.name)
    confirmed: list[float] = []
    began: list[float] = []
    shown: list[float] = []
    foreign = 0
    axes = list(AXES.values())
    for number in range(rounds):
        if number % 3 == 0:
            await flight.back_to_start()
        else:
            await flight.by_hand()
        # Out of phase with anything that runs once per second.
        await flight.full_stick(axes[number % len(axes)], 0.5 + number * 0.618 % 1.0)
        rig.tap.forget()
        at = await trigger.pull(rig)
        if trigger.reported:
            confirmed_at, _ = await rig.admin.until_hold(since=at, timeout_s=MODE_BY_S)
            confirmed.append((confirmed_at - at) * 1e3)
        await _mode_and_late_frames(trial, at)
        found = figures(rig.tap, at, trigger.old_holder if trigger.old_holder is not None else -1, trial.hold_numbers)
        began.append((found.began_at - at) * 1e3)
        shown.append((found.mode_at - at) * 1e3)
        foreign += max(found.foreign_frames, 0)
        await trigger.mend(rig)
    for metric, values in (("all_to_confirmed", confirmed), ("all_to_first_act", began), ("all_to_mode", shown)):
        if values:
            report.spread(case, metric, values, "ms")
    report.add(case, "all_" + FOREIGN, foreign, "count")
    report.say(f"  {trigger.name}: {rounds} times, mode p50 {percentile(shown, 0.5):.0f}, worst {max(shown):.0f} ms")


async def _mode_and_late_frames(trial: Trial, since: float) -> None:
    """Waits until the autopilot reports the hold's mode, and a little longer for frames in transit."""
    rig = trial.rig
    await wait_for("the hold's mode", lambda: mode_shown_at(rig.tap, since, trial.hold_numbers), MODE_BY_S)
    until = rig.admin.now + 0.4
    await wait_for("late frames", lambda: rig.admin.now >= until)


def _write(trial: Trial, name: str, found: HoldFigures, at: float) -> None:
    case, add = trial.case(name), trial.report.add
    add(case, "to_first_act_at_port", (found.began_at - at) * 1e3, "ms")
    add(case, "to_mode_at_port", (found.mode_at - at) * 1e3, "ms")
    add(case, FOREIGN, found.foreign_frames, "count")
    add(case, "level_after", found.level_s, "s")
    add(case, "height_off", found.height_off_m, "m")
    add(case, "height_unsettled", found.height_unsettled_m, "m")
    add(case, "ground_speed_at_6_s", found.speed_end_mps, "m/s")
    if not math.isnan(found.stopped_s):
        add(case, "stopped_after", found.stopped_s, "s")
    words = f"{found.level_s:.2f} s to level, {found.height_off_m:.2f} m off, {found.foreign_frames} old frames"
    trial.report.say(f"  {name}: mode after {(found.mode_at - at) * 1e3:.0f} ms, {words}")


async def _position_hold(trial: Trial) -> None:
    """Repeats the take with a position hold as the first rung."""
    modes = trial.flight.modes
    await _set(trial, {"hold_ladder": [modes.position_hold]})
    try:
        await _motion(trial, TAKE, "take into position hold", AXES["pitch forward"])
    finally:
        await _set(trial, {"hold_ladder": []})
