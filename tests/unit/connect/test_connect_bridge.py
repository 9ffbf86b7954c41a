"""The bridge: what goes up, what comes down, and which program counts as present."""

from hypothesis import given
from hypothesis import strategies as st

from connect.bridge import MAX_PROGRAMS, PROGRAM_GONE_AFTER_S, Bridge
from wire.dialect import build, mavlink
from wire.ids import DroneId
from wire.lateness import stamp_ms
from wire.tagged import MAX_UPWARD_MESSAGE_BYTES, split_stamp, split_tagged, tag

KESTREL, MERLIN = DroneId(3), DroneId(4)


def frame(message: object, *, system_id: int = 255) -> bytes:
    return build(message, system_id=system_id, component_id=190, sequence=0)


HEARTBEAT = frame(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
RATES = frame(mavlink.MAVLink_request_data_stream_message(1, 1, 0, 4, 1))
LIST = frame(mavlink.MAVLink_param_request_list_message(1, 1))
STICKS = frame(mavlink.MAVLink_manual_control_message(1, 0, 0, 500, 0, 0))


def upward(messages: list[bytes]) -> list[tuple[int, bytes]]:
    return [part for message in messages for part in split_tagged(split_stamp(message)[1])]


def test_a_frame_goes_up_tagged_and_stamped_and_unchanged() -> None:
    bridge = Bridge(KESTREL)
    (message,) = bridge.from_program("qgc", LIST[:7], 10.0) + bridge.from_program("qgc", LIST[7:] + STICKS, 12.5)
    sent_ms, tagged = split_stamp(message)
    assert sent_ms == stamp_ms(12.5)
    assert split_tagged(tagged) == [(KESTREL, LIST), (KESTREL, STICKS)]


def test_programs_do_not_mix_their_bytes() -> None:
    bridge = Bridge(KESTREL)
    assert bridge.from_program("one", LIST[:9], 0.0) == []
    assert upward(bridge.from_program("two", STICKS, 0.0)) == [(KESTREL, STICKS)]
    assert upward(bridge.from_program("one", LIST[9:], 0.0)) == [(KESTREL, LIST)]


def test_without_the_controls_presence_and_rates_stay_here_and_all_else_is_the_towers_to_answer() -> None:
    bridge = Bridge(KESTREL)
    assert upward(bridge.from_program("qgc", HEARTBEAT + RATES + STICKS, 0.0)) == [(KESTREL, STICKS)]
    assert bridge.from_program("qgc", HEARTBEAT, 0.0) == []
    bridge.has_controls = True
    assert [part for _, part in upward(bridge.from_program("qgc", HEARTBEAT + RATES, 0.0))] == [HEARTBEAT, RATES]


def test_a_burst_is_cut_to_what_the_tower_takes() -> None:
    bridge = Bridge(KESTREL)
    messages = bridge.from_program("tcp", STICKS * 2000, 0.0)
    assert len(messages) > 1
    assert all(len(message) <= MAX_UPWARD_MESSAGE_BYTES for message in messages)
    assert [part for _, part in upward(messages)] == [STICKS] * 2000


def test_only_this_drones_frames_come_down() -> None:
    bridge = Bridge(KESTREL)
    assert bridge.from_tower(tag(MERLIN, LIST) + tag(KESTREL, STICKS) + tag(KESTREL, LIST), 0.0) == [STICKS, LIST]
    assert bridge.from_tower(b"\0\0nonsense", 0.0) == []
    assert bridge.skipped_bytes == 10


def test_who_is_there() -> None:
    bridge = Bridge(KESTREL)
    assert bridge.has_programs(100.0)
    bridge.from_program("qgc", b"noise", 100.0)
    assert bridge.has_programs(1e6), "noise is nobody"
    bridge.from_program("qgc", HEARTBEAT, 100.0)
    assert bridge.has_programs(100.0 + PROGRAM_GONE_AFTER_S - 0.1)
    assert not bridge.has_programs(100.0 + PROGRAM_GONE_AFTER_S)
    bridge.from_program("sdk", HEARTBEAT, 110.0)
    bridge.program_gone("sdk")
    assert not bridge.has_programs(110.0)


def test_strangers_cannot_grow_it() -> None:
    bridge = Bridge(KESTREL)
    for number in range(10 * MAX_PROGRAMS):
        bridge.from_program(number, LIST[:5], float(number))
    bridge.from_program("qgc", HEARTBEAT, 1e3)
    assert len(bridge._streams) == MAX_PROGRAMS
    assert bridge.has_programs(1e3)


@given(st.binary(max_size=400))
def test_nothing_that_comes_from_either_side_raises(data: bytes) -> None:
    bridge = Bridge(KESTREL)
    for part in upward(bridge.from_program("any", data, 0.0)):
        assert part[1] in data
    bridge.from_tower(data, 0.0)


def position(up_m: float = 30.0, east_m_s: float = 12.0) -> bytes:
    values = (0, 470000000, 80000000, 530_000, round(up_m * 1000), 0, round(east_m_s * 100), 0, 0)
    return frame(mavlink.MAVLink_global_position_int_message(*values), system_id=7)


def adsb_in(frames: list[bytes]) -> list[object]:
    parser = mavlink.MAVLink(None)
    messages = [message for one in frames for message in parser.parse_buffer(bytearray(one)) or ()]
    return [one for one in messages if one.get_type() == "ADSB_VEHICLE"]


def test_the_rest_of_the_squad_is_traffic_once_a_second() -> None:
    bridge = Bridge(KESTREL)
    own = tag(KESTREL, position())
    assert adsb_in(bridge.from_tower(tag(MERLIN, position()), 0.0)) == [], "its own system is not known yet"
    [told] = adsb_in(bridge.from_tower(own + tag(MERLIN, position()), 0.1))
    assert (told.lat, told.altitude, told.hor_velocity, told.heading) == (470000000, 530_000, 1200, 9000)  # type: ignore[attr-defined]
    assert (told.callsign, told.get_srcSystem(), told.emitter_type) == ("TWR4", 7, 14)  # type: ignore[attr-defined]
    assert adsb_in(bridge.from_tower(tag(MERLIN, position()), 0.9)) == []
    assert len(adsb_in(bridge.from_tower(tag(MERLIN, position()), 1.2))) == 1
    assert adsb_in(bridge.from_tower(tag(MERLIN, position(up_m=0.5)), 3.0)) == [], "on the ground"


def test_a_large_squad_is_bounded_traffic() -> None:
    bridge = Bridge(KESTREL)
    bridge.from_tower(tag(KESTREL, position()), 0.0)
    many = [adsb_in(bridge.from_tower(tag(DroneId(100 + one), position()), 0.5)) for one in range(80)]
    assert sum(len(one) for one in many) == 50
