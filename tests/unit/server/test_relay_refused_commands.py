"""Commands that the hub refuses: the acknowledgements, and what needs a confirmation."""

from dataclasses import replace

import pytest
from hub_world import (
    command_long,
)
from safety_scene import ADMIN, HELD, ONE, Scene

from server.control.core.loss_check_mark import LossCheckMark
from server.live import live_messages as live
from wire.control_messages import (
    AutopilotState,
)
from wire.dialect import build, decode, mavlink
from wire.drops import DropReason
from wire.ids import Epoch, UserId
from wire.tagged import split_tagged, tag


@pytest.fixture
def scene() -> Scene:
    return Scene()


def test_every_refused_command_is_counted_and_answered_in_both_forms(scene: Scene) -> None:
    admin = scene.world.browser(9)
    for number in range(3):
        whole = mavlink.MAVLink_command_int_message(1, 1, 3, 192, 0, 0, 0, 0, 0, 0, 1, 2, 3)
        admin.send(tag(ONE, build(whole, system_id=255, component_id=190, sequence=number)), now=1.0)
    assert scene.hub.state.drops[DropReason.NOT_IN_CONTROL] == 3
    answers = [decode(frame) for _, frame in split_tagged(b"".join(admin.frames()))]
    assert [(ack.command, ack.result) for ack in answers if ack is not None] == [(192, 10)] * 3
    assert scene.notices(admin) == ["not-in-control"]
    scene.hub.tick(2.1)
    (summed,) = [event for event in admin.events() if isinstance(event, live.Notice)]
    assert (summed.code, summed.count) == ("not-in-control", 2)
    assert scene.agent.received() == []


def test_disarming_in_the_air_is_asked_twice(scene: Scene) -> None:
    scene.hub.reports.receive(scene.agent.link, AutopilotState(heard=True, armed=True, airborne=True))
    disarm = mavlink.MAVLink_command_long_message(1, 1, 400, 0, 0, 21196, 0, 0, 0, 0, 0)
    frame = build(disarm, system_id=255, component_id=190, sequence=0)
    scene.alice.send(tag(ONE, frame), now=1.0)
    assert scene.agent.received() == []
    assert scene.notices(scene.alice) == ["ask-twice"]
    scene.alice.send(tag(ONE, frame), now=2.0)
    assert scene.agent.received() == [(1, frame)]


def test_arming_waits_until_a_dangerous_loss_check_is_acknowledged(scene: Scene) -> None:
    admin = scene.world.browser(9)
    scene.lease(replace(HELD, assistant=ADMIN, epoch=Epoch(2)), "assisting")
    scene.alice.events()
    scene.hub.changes.set_loss_check(ONE, LossCheckMark(dangerous=True, version="a"))
    assert scene.alice.events() == [live.LossCheckChanged(ONE)]
    scene.alice.send(tag(ONE, command_long(400)), now=1.0)
    assert scene.notices(scene.alice) == ["loss-check"]
    mark = LossCheckMark(dangerous=True, read_by=frozenset({UserId(1)}), version="b")
    for _ in range(2):
        scene.hub.changes.set_loss_check(ONE, mark)
    assert scene.alice.events() == [live.LossCheckChanged(ONE)], "what has not changed is not told"
    admin.send(tag(ONE, command_long(400)), now=2.0)
    assert scene.agent.received() == [], "the assistant has not read it"
    scene.alice.send(tag(ONE, command_long(400)), now=2.0)
    assert len(scene.agent.received()) == 1
