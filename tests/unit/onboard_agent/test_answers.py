"""Whether the autopilot hears the agent, proved on the present line only."""

from onboard_world import World, frame

from onboard_agent.autopilot.answers import ASK_EVERY_S, DEAF_AFTER_S
from wire.control_messages import AutopilotState
from wire.dialect import decode, mavlink


def questions(world: World) -> list[int]:
    return [one.ts1 for one in map(decode, world.sent) if one is not None and one.get_type() == "TIMESYNC"]


def answer(world: World, ts1: int, *, component: int = 1) -> list[bytes]:
    reply = frame(mavlink.MAVLink_timesync_message(77, ts1), component_id=component)
    return world.onboard.from_autopilot([reply], world.now)


def hears(world: World) -> bool | None:
    return [one for one in world.reported if isinstance(one, AutopilotState)][-1].hears_agent


def test_it_answers() -> None:
    world = World(answers=False)
    world.pass_time(ASK_EVERY_S)
    assert answer(world, questions(world)[-1]) == [], "no affair of the tower"
    world.pass_time(1.0)
    assert hears(world) is True
    world.sent.clear()
    for _ in range(6):
        world.pass_time(ASK_EVERY_S + 0.1)
        answer(world, questions(world)[-1])
    assert hears(world) is True


def test_an_autopilot_that_answers_nothing_is_deaf() -> None:
    world = World(answers=False)
    world.pass_time(DEAF_AFTER_S - 1.0)
    assert hears(world) is None
    world.pass_time(1.5)
    assert hears(world) is False
    answer(world, questions(world)[-1])
    world.pass_time(0.2)
    assert hears(world) is True


def test_only_its_own_answers_count() -> None:
    world = World(answers=False)
    world.pass_time(DEAF_AFTER_S)
    asked = questions(world)[-1]
    answer(world, asked + 1)
    answer(world, asked, component=154)
    world.onboard.from_autopilot([frame(mavlink.MAVLink_timesync_message(0, asked))], world.now)
    world.pass_time(0.5)
    assert hears(world) is False
    assert answer(world, asked + 1) != [], "somebody else asked that"


def test_an_earlier_line_proves_nothing() -> None:
    world = World(answers=False)
    world.pass_time(ASK_EVERY_S)
    answer(world, questions(world)[-1])
    world.pass_time(1.0)
    world.heard = False
    world.pass_time(6.0)
    assert hears(world) is None
    world.heard = True
    world.pass_time(1.0)
    assert hears(world) is None
    world.pass_time(DEAF_AFTER_S)
    assert hears(world) is False


def test_nobody_knows_what_another_kind_would_answer() -> None:
    world = World(answers=False, vehicle=(mavlink.MAV_AUTOPILOT_GENERIC, mavlink.MAV_TYPE_QUADROTOR))
    world.pass_time(2 * DEAF_AFTER_S)
    assert hears(world) is None
    assert questions(world) == []
