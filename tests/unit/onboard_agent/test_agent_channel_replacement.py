"""When a link seeks another control channel, when it ends, and what is reported on the new one."""

import pytest

from onboard_agent.link.backoff import Backoff
from onboard_agent.link.channel_replacement import FIRST_CHECK_AFTER_S, SEEK_S, SILENT_S, ChannelReplacement, Need
from onboard_agent.onboard import Onboard
from wire.control_messages import AutopilotState, ControlChanged, Welcome
from wire.dialect import build, mavlink

HEARTBEAT = build(mavlink.MAVLink_heartbeat_message(2, 3, 209, 2, 4, 3), system_id=1, component_id=1, sequence=0)


def channel_replacement() -> ChannelReplacement:
    return ChannelReplacement(Backoff(lambda: 0.0), 0.0)


def need(
    one: ChannelReplacement, now: float, *, silent_s: float = 0.1, over_udp: bool = True, uplink_silent: bool = False
) -> Need:
    return one.need(silent_s=silent_s, over_udp=over_udp, uplink_silent=uplink_silent, now=now)


@pytest.mark.parametrize("over_udp", [True, False])
@pytest.mark.parametrize("silent_s", [0.0, 100.0])
def test_a_control_channel_that_is_there_is_left_alone(over_udp: bool, silent_s: float) -> None:
    assert need(channel_replacement(), 100.0, silent_s=silent_s, over_udp=over_udp) is Need.NOTHING


def test_one_whose_uplink_is_silent_gets_a_successor_but_not_at_once_after_the_last() -> None:
    one = channel_replacement()
    assert need(one, FIRST_CHECK_AFTER_S - 0.01, uplink_silent=True) is Need.NOTHING
    assert need(one, FIRST_CHECK_AFTER_S, uplink_silent=True) is Need.ANOTHER


@pytest.mark.parametrize("code", [None, 1005, 1006, 1011])
def test_one_that_broke_off_gets_a_successor_at_once(code: int | None) -> None:
    one = channel_replacement()
    one.ended(code, 1.0)
    assert need(one, 1.0) is Need.ANOTHER


@pytest.mark.parametrize("code", [1000, 1001, 1008, 1012, 4400, 4401, 4408, 4409])
def test_one_that_was_closed_by_wish_is_the_end_of_its_link(code: int) -> None:
    one = channel_replacement()
    one.ended(code, 1.0)
    assert need(one, 1.0) is Need.END


def test_a_link_without_datagrams_ends_with_its_control_channel() -> None:
    one = channel_replacement()
    one.ended(1006, 1.0)
    assert need(one, 1.1, silent_s=SILENT_S) is Need.ANOTHER
    assert need(one, 1.1, silent_s=SILENT_S + 0.01) is Need.END
    assert need(one, 1.1, over_udp=False) is Need.END, "its datagrams went by that control channel"


def test_nobody_seeks_for_ever_and_failures_wait() -> None:
    one = channel_replacement()
    one.ended(1006, 1.0)
    one.failed(1.0)
    assert need(one, 1.0) is Need.ANOTHER, "the first failure is answered at once"
    one.failed(1.0)
    assert need(one, 1.2) is Need.NOTHING
    assert need(one, 1.25) is Need.ANOTHER
    assert need(one, 1.0 + SEEK_S) is Need.ANOTHER
    assert need(one, 1.0 + SEEK_S + 0.01) is Need.END


def linked() -> Onboard:
    onboard = Onboard(now=0.0, speaks_first=False)
    onboard.from_autopilot([HEARTBEAT], 0.0)
    welcome = Welcome(drone_id=1, name="Kestrel", link_id=1, public_key=b"", udp_port=1, epoch=3, holder="alice")
    onboard.welcomed(welcome, 0.0)
    return onboard


def test_a_resumed_link_keeps_its_epoch_and_tells_all_again() -> None:
    onboard = linked()
    first = onboard.messages_to_tower(0.1)
    assert AutopilotState(heard=True, armed=True, airborne=False, system_id=1) in first
    assert onboard.messages_to_tower(0.2) == []
    onboard.resumed()
    assert onboard.downlink.epoch == 3
    assert onboard.messages_to_tower(0.3) == first


def test_who_holds_is_believed_in_the_order_in_which_it_was_told() -> None:
    onboard = linked()

    def reported(number: int, *, present: bool) -> None:
        changed = ControlChanged(number=number, epoch=3, holder="alice", holder_present=present)
        onboard.message(changed, 1.0)

    reported(1, present=False)
    reported(2, present=True)
    reported(1, present=False)
    assert onboard._holder_present, "a copy that came late says nothing"
    reported(3, present=False)
    assert not onboard._holder_present
    reported(0, present=True)
    assert onboard._holder_present, "a tower that does not count has one channel only"
