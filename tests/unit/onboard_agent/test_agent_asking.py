"""Rates, parameters and heartbeats: what the agent requests from the autopilot, when, and how often."""

import struct
from typing import Any

import pytest

from onboard_agent.autopilot.asking import Asking
from onboard_agent.autopilot.own_frames import FrameMaker, Sender
from onboard_agent.autopilot.parameters import NAMES, Parameters, read_value
from onboard_agent.autopilot.presence import Presence
from onboard_agent.autopilot.rates import (
    ASK_AGAIN_AFTER_S,
    MAX_ASK_AGAIN_S,
    MISSED_FOR_S,
    RATE_REQUESTS,
    Rates,
)
from onboard_agent.link.backoff import Backoff
from wire.dialect import decode, mavlink
from wire.stream_profiles import StreamProfile


def ack(command: int, result: int = 0) -> Any:
    return mavlink.MAVLink_command_ack_message(command, result)


def test_one_question_at_a_time_each_given_up_after_its_tries() -> None:
    asking: Asking[str] = Asking(timeout_s=1.0, tries=2)
    assert asking.due(0.0) is None
    asking.ask(["a", "b"])
    assert asking.due(0.0) == ("a", 0)
    assert asking.due(0.9) is None
    assert asking.due(1.0) == ("a", 1)
    assert asking.due(2.0) == ("b", 0)
    asking.answered()
    assert asking.current is None
    assert asking.due(3.0) is None


def test_an_answer_makes_the_next_question_due_at_once() -> None:
    asking: Asking[str] = Asking(timeout_s=1.0, tries=2)
    asking.ask(["a", "b"])
    asking.due(0.0)
    asking.answered()
    assert asking.due(0.01) == ("b", 0)


class RatesBench:
    def __init__(self, *, narrow_line: bool = False) -> None:
        self.rates = Rates(FrameMaker(), narrow_line=narrow_line)
        self.rates.ask_all(0.0)

    def ask(self, now: float) -> Any:
        frame = self.rates.due(now, vehicle_system_id=1)
        return None if frame is None else decode(frame)

    def intervals(self, now: float) -> dict[int, float]:
        """Returns all granted requests: message id to its interval in seconds."""
        granted = {}
        while (message := self.ask(now)) is not None:
            granted[int(message.param1)] = message.param2 * 1e-6
            self.rates.acknowledged(ack(message.command), now)
        return granted

    def grant_all(self, now: float, refuse: int | None = None) -> list[int]:
        asked = []
        while (message := self.ask(now)) is not None:
            asked.append(int(message.param1))
            self.rates.acknowledged(ack(message.command, 3 if message.param1 == refuse else 0), now)
        return asked

    def hear_all(self, now: float, *, but: frozenset[int] = frozenset()) -> None:
        for request in RATE_REQUESTS:
            if request.message_id not in but:
                self.rates.heard(request.message_id, now)


def test_the_whole_table_is_asked_for_in_order() -> None:
    assert RatesBench().grant_all(0.0) == [request.message_id for request in RATE_REQUESTS]


def test_the_interval_is_in_microseconds_and_the_version_is_asked_once() -> None:
    bench = RatesBench()
    first = bench.ask(0.0)
    assert (first.command, first.param1, first.param2) == (511, 30, 100_000)
    assert (first.target_system, first.target_component) == (1, 1)
    assert (first.get_srcSystem(), first.get_srcComponent()) == (1, 191)
    bench.rates.acknowledged(ack(511), 0.0)
    messages = []
    while (message := bench.ask(0.0)) is not None:
        messages.append(message)
        bench.rates.acknowledged(ack(message.command), 0.0)
    assert (messages[-1].command, messages[-1].param1) == (512, 148)


def test_a_repeat_carries_a_higher_confirmation_and_then_the_next_is_asked() -> None:
    bench = RatesBench()
    asked = [bench.ask(n * 0.5) for n in range(4)]
    assert [(m.param1, m.confirmation) for m in asked] == [(30, 0), (30, 1), (30, 2), (33, 0)]


def test_what_is_unsupported_is_not_asked_again() -> None:
    bench = RatesBench()
    bench.grant_all(0.0, refuse=mavlink.MAVLINK_MSG_ID_WIND)
    assert bench.rates.unsupported == {mavlink.MAVLINK_MSG_ID_WIND}
    bench.rates.ask_all(10.0)
    assert mavlink.MAVLINK_MSG_ID_WIND not in bench.grant_all(10.0)


def test_a_narrow_line_is_asked_for_no_more_than_goes_up() -> None:
    bench = RatesBench(narrow_line=True)
    before = bench.intervals(0.0)
    bench.rates.follow(StreamProfile.MINIMAL)
    lowered = bench.intervals(1.0)
    assert lowered[mavlink.MAVLINK_MSG_ID_ATTITUDE] == pytest.approx(0.2), "what a pilot needs stays"
    assert lowered[mavlink.MAVLINK_MSG_ID_NAV_CONTROLLER_OUTPUT] == pytest.approx(10.0)
    assert all(interval_s > before[number] for number, interval_s in lowered.items())
    read_here = ("GLOBAL_POSITION_INT", "SYS_STATUS", "EXTENDED_SYS_STATE", "RC_CHANNELS")
    assert not lowered.keys() & {getattr(mavlink, f"MAVLINK_MSG_ID_{name}") for name in read_here}
    bench.rates.follow(StreamProfile.MINIMAL)
    assert bench.intervals(2.0) == {}, "asked once"
    bench.rates.follow(StreamProfile.FULL)
    assert bench.intervals(3.0) == {number: before[number] for number in lowered}


def test_a_change_while_the_table_is_being_asked_for_asks_for_the_rest_too() -> None:
    bench = RatesBench(narrow_line=True)
    bench.ask(0.0)
    bench.rates.acknowledged(ack(511), 0.0)
    bench.rates.follow(StreamProfile.THIN)
    assert set(bench.intervals(0.1)) == {request.message_id for request in RATE_REQUESTS}


def test_a_wide_line_is_asked_for_everything_in_any_profile() -> None:
    bench = RatesBench()
    bench.grant_all(0.0)
    bench.rates.follow(StreamProfile.MINIMAL)
    assert bench.ask(1.0) is None


def test_an_answer_to_another_command_is_not_ours() -> None:
    bench = RatesBench()
    bench.ask(0.0)
    bench.rates.acknowledged(ack(400), 0.1)
    bench.rates.acknowledged(ack(512), 0.1)
    assert bench.ask(0.5).param1 == 30


@pytest.mark.parametrize("result", [5, 1], ids=["in progress", "temporarily rejected"])
def test_not_now_means_wait(result: int) -> None:
    bench = RatesBench()
    bench.ask(0.0)
    bench.rates.acknowledged(ack(511, result), 0.1)
    assert bench.ask(0.4) is None
    assert bench.ask(2.2).param1 == 30


def test_rates_that_were_forgotten_are_asked_for_again_but_not_too_often() -> None:
    bench = RatesBench()
    bench.grant_all(0.0)
    bench.hear_all(1.5)
    assert bench.ask(1.5 + MISSED_FOR_S) is None, "the last request is too recent"
    asked_at, again_s = 0.0, ASK_AGAIN_AFTER_S
    while again_s < MAX_ASK_AGAIN_S:
        assert bench.ask(asked_at + again_s - 0.1) is None
        asked_at, again_s = asked_at + again_s + 0.1, min(2 * again_s, MAX_ASK_AGAIN_S)
        assert len(bench.grant_all(asked_at)) == len(RATE_REQUESTS)
    bench.hear_all(asked_at + MAX_ASK_AGAIN_S)
    assert bench.ask(asked_at + MAX_ASK_AGAIN_S + 0.1) is None, "it still comes"


def test_a_reboot_soon_after_another_is_noticed_soon() -> None:
    bench = RatesBench()
    for booted_at in (0.0, 100.0):
        bench.rates.ask_all(booted_at)
        bench.grant_all(booted_at)
        bench.hear_all(booted_at + 10.0)
        assert len(bench.grant_all(booted_at + 10.1 + MISSED_FOR_S)) == len(RATE_REQUESTS)


@pytest.mark.parametrize("answered", [True, False])
def test_one_message_that_does_not_come_is_asked_for_again(answered: bool) -> None:
    """Answered: the response belonged to another request. Not answered: the autopilot was too busy for all three
    requests."""
    bench = RatesBench()
    gps = mavlink.MAVLINK_MSG_ID_GPS_RAW_INT
    now = 0.0
    while now < ASK_AGAIN_AFTER_S:
        message = bench.ask(now)
        if message is not None and (answered or message.param1 != gps):
            bench.rates.acknowledged(ack(message.command), now)
        now += 0.25
    now = ASK_AGAIN_AFTER_S
    bench.hear_all(now, but=frozenset({gps}))
    assert bench.ask(now) is None, "not yet"
    assert bench.grant_all(now + 0.1) == [gps]
    now += MAX_ASK_AGAIN_S + 0.2
    bench.hear_all(now, but=frozenset({gps}))
    assert bench.grant_all(now) == [gps], "each time again"
    now += MAX_ASK_AGAIN_S + 0.2
    bench.hear_all(now)
    assert bench.grant_all(now) == []


def test_what_was_refused_for_good_is_not_missed() -> None:
    bench = RatesBench()
    bench.grant_all(0.0, refuse=mavlink.MAVLINK_MSG_ID_WIND)
    bench.hear_all(ASK_AGAIN_AFTER_S, but=frozenset({mavlink.MAVLINK_MSG_ID_WIND}))
    assert bench.grant_all(ASK_AGAIN_AFTER_S + 0.1) == []


def value(name: str, number: float) -> Any:
    return mavlink.MAVLink_param_value_message(name.encode(), number, 9, 900, 1)


class ParametersBench:
    def __init__(self, known: dict[str, float], *, kind: int = 3) -> None:
        self.parameters = Parameters(FrameMaker())
        self.parameters.ask_all(kind)
        self.asked: list[str] = []
        for n in range(60):
            frame = self.parameters.due(n * 1.0, vehicle_system_id=1)
            if frame is None:
                continue
            name = decode(frame).param_id
            self.asked.append(name)
            if name in known:
                self.parameters.value(framed(value(name, known[name])))


def framed(message: Any) -> bytes:
    return FrameMaker().make(message, Sender(1, 1))


def test_the_ground_stations_id_by_its_old_name() -> None:
    bench = ParametersBench({"SYSID_MYGCS": 245, "RC3_MIN": 1100, "RC3_MAX": 1900, "RC1_TRIM": 1510})
    assert bench.parameters.ground_station_system_id == 245
    assert "MAV_GCS_SYSID" not in bench.asked
    assert bench.parameters.channel_middles_us == (1510, 1500, 1500, 1500)


def test_the_ground_stations_id_by_its_new_name() -> None:
    bench = ParametersBench({"MAV_GCS_SYSID": 250, "RC3_MIN": 1000, "RC3_MAX": 1800})
    assert bench.parameters.ground_station_system_id == 250
    assert bench.asked.count("SYSID_MYGCS") == 3
    assert bench.parameters.channel_middles_us[2] == 1400


def test_an_autopilot_that_answers_nothing_is_asked_for_a_while_only() -> None:
    bench = ParametersBench({})
    assert len(bench.asked) == 3 * len(NAMES[3])
    assert bench.parameters.all_read
    assert bench.parameters.loss_values == {}
    assert bench.parameters.ground_station_system_id == 255
    assert bench.parameters.channel_middles_us == (1500, 1500, 1500, 1500)


@pytest.mark.parametrize("number", [0.0, -1.0, 256.0, float("nan"), float("inf")])
def test_an_impossible_ground_station_id_is_not_believed(number: float) -> None:
    parameters = Parameters(FrameMaker())
    parameters.ask_all(3)
    parameters.value(framed(value("SYSID_MYGCS", number)))
    assert parameters.ground_station_system_id == 255


def beats(presence: Presence, now: float, **changes: Any) -> list[tuple[int, int, int]]:
    situation = {
        "vehicle_system_id": 3,
        "ground_station_system_id": 255,
        "holder_present": True,
        "tower_silent_s": 0.1,
        "holds": False,
    } | changes
    frames = presence.due(now, **situation)
    return [(m.get_srcSystem(), m.get_srcComponent(), m.type) for m in map(decode, frames) if m is not None]


OWN = (3, 191, 18)
GROUND_STATION = (255, 190, 6)


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({}, [OWN, GROUND_STATION]),
        ({"holder_present": False}, [OWN]),
        ({"tower_silent_s": 2.0}, [OWN]),
        ({"holder_present": False, "tower_silent_s": 60.0, "holds": True}, [OWN, GROUND_STATION]),
        ({"ground_station_system_id": 245}, [OWN, (245, 190, 6)]),
        ({"vehicle_system_id": None}, []),
    ],
)
def test_who_beats(changes: dict[str, Any], expected: list[tuple[int, int, int]]) -> None:
    assert beats(Presence(FrameMaker(), speaks_first=False), 5.0, **changes) == expected


def test_beats_are_a_second_apart() -> None:
    presence = Presence(FrameMaker(), speaks_first=False)
    assert sum(len(beats(presence, n * 0.025)) for n in range(400)) == 20


def test_who_must_be_spoken_to_first_is_greeted() -> None:
    assert beats(Presence(FrameMaker(), speaks_first=True), 0.0, vehicle_system_id=None) == [(1, 191, 18)]


def test_each_sender_has_its_own_sequence() -> None:
    presence = Presence(FrameMaker(), speaks_first=False)
    sequences = []
    for n in range(3):
        frames = presence.due(
            float(n),
            vehicle_system_id=3,
            ground_station_system_id=255,
            holder_present=True,
            tower_silent_s=0.0,
            holds=False,
        )
        sequences.append([frame[4] for frame in frames])
    assert sequences == [[0, 0], [1, 1], [2, 2]]


def test_the_backoff_begins_at_once_and_ends_at_two_seconds() -> None:
    backoff = Backoff(fraction=lambda: 0.0)
    assert [backoff.next_delay_s() for _ in range(6)] == [0.0, 0.25, 0.5, 1.0, 2.0, 2.0]
    backoff.reset()
    assert backoff.next_delay_s() == 0.0


def test_the_jitter_only_shortens() -> None:
    backoff = Backoff(fraction=lambda: 1.0)
    assert [backoff.next_delay_s() for _ in range(4)] == [0.0, 0.125, 0.25, 0.5]


def test_what_decides_on_a_loss_is_read_and_what_the_autopilot_lacks_is_left_out() -> None:
    bench = ParametersBench({"SYSID_MYGCS": 255, "FS_GCS_ENABLE": 1, "RC_OVERRIDE_TIME": 3, "RC1_TRIM": 1500})
    assert bench.parameters.loss_values == {"SYSID_MYGCS": 255, "FS_GCS_ENABLE": 1, "RC_OVERRIDE_TIME": 3}
    assert set(bench.asked) >= {"FS_THR_ENABLE", "FS_GCS_TIMEOUT", "RC_FS_TIMEOUT", "RC_OPTIONS", "FS_OPTIONS"}


def test_a_simulated_ardupilot_is_known_by_a_parameter_that_a_real_one_lacks() -> None:
    assert "SIM_SPEEDUP" in ParametersBench({"SIM_SPEEDUP": 1}).parameters.loss_values


def test_px4_is_asked_for_its_own() -> None:
    bench = ParametersBench({"COM_RC_LOSS_T": 0.5}, kind=12)
    assert bench.parameters.loss_values == {"COM_RC_LOSS_T": 0.5}
    assert set(bench.asked) == set(NAMES[12])
    assert set(bench.asked) >= {"COM_RCL_EXCEPT", "NAV_RCL_ACT", "SYS_HITL"}


def test_another_kind_of_autopilot_is_asked_for_nothing() -> None:
    bench = ParametersBench({}, kind=8)
    assert bench.asked == []
    assert bench.parameters.all_read


def test_what_an_autopilot_of_another_kind_had_is_forgotten() -> None:
    bench = ParametersBench({"FS_GCS_ENABLE": 1})
    bench.parameters.ask_all(3)
    assert bench.parameters.loss_values == {"FS_GCS_ENABLE": 1}
    assert not bench.parameters.all_read
    bench.parameters.ask_all(12)
    assert bench.parameters.loss_values == {}


@pytest.mark.parametrize(
    ("layout", "number", "kind"),
    [("<i", -1, 6), ("<i", 2, 6), ("<I", 0x7F800001, 5), ("<bxxx", -3, 2), ("<Hxx", 65535, 3), ("<f", 0.5, 9)],
)
def test_px4_sends_an_integers_bytes_where_the_float_is(layout: str, number: float, kind: int) -> None:
    payload = struct.pack(layout, number) + struct.pack("<HH16sB", 1, 0, b"NAV_DLL_ACT", kind)
    frame = bytes([0xFD, len(payload), 0, 0, 0, 1, 1, 22, 0, 0]) + payload + b"xx"
    assert read_value(frame, 12) == ("NAV_DLL_ACT", number)


def test_a_value_that_is_no_number_is_none() -> None:
    assert read_value(framed(value("RC3_MIN", float("nan"))), 3) is None
    assert read_value(framed(value("RC3_MIN", 1100)), 3) == ("RC3_MIN", 1100.0)
