"""Agents' reports beside operations: the plan on board, and parameter tables."""

from typing import Any

import pytest
from operation_scene import DOWNLOAD, ITEMS, Scene

from server.operations.core.table_fetching import NOT_YET_S, TABLE_AGAIN_AFTER_S, TABLES_APART_S
from wire.control_messages import MalformedMessage
from wire.parameters import Parameter, by_name, pack_table, table_hash
from wire.plans import PlanKind, pack_plan, plan_hash
from wire.transactions import (
    Outcome,
    ParameterCache,
    ParameterChanged,
    ParametersReadWork,
    ParameterTable,
    PlanOnBoard,
    TransactionResult,
)

# -- what is on board ----------------------------------------------------------------------------------------


def on_board(**more: Any) -> PlanOnBoard:
    reported = {"hash": plan_hash(PlanKind.MISSION, ITEMS), "count": 2, "plan": pack_plan(PlanKind.MISSION, ITEMS)}
    return PlanOnBoard(kind=PlanKind.MISSION, **(reported | more))


def test_the_plan_on_board_is_in_the_snapshot_and_told_on_change_only() -> None:
    scene = Scene()
    scene.announce(on_board())
    scene.announce(on_board())
    (reported,) = scene.reported()
    assert (reported.kind, reported.state, reported.count) == ("mission", "known", 2)
    assert scene.drone.view().plans.mission.hash == plan_hash(PlanKind.MISSION, ITEMS)
    view, known = scene.drone.onboard.plan(PlanKind.MISSION)
    assert known.items() == ITEMS
    scene.announce(on_board(hash=None, plan=None, fit_to_fly=False))
    view, known = scene.drone.onboard.plan(PlanKind.MISSION)
    assert (view.state, view.count, view.fit_to_fly, known.items()) == ("unknown", 0, False, None)


def test_nothing_is_known_of_a_drone_that_is_offline_and_nothing_is_told_to_the_blind() -> None:
    scene = Scene()
    scene.announce(on_board())
    scene.hub.detach_link(scene.agent_.link)
    assert scene.drone.view().plans.mission.state == "unknown"


GARBAGE = {
    "another hash": on_board(hash="0" * 16),
    "another count": on_board(count=3),
    "another kind": on_board(plan=pack_plan(PlanKind.FENCE, ITEMS)),
    "cut short": on_board(plan=pack_plan(PlanKind.MISSION, ITEMS)[:-1]),
    "empty": on_board(plan=b""),
}


@pytest.mark.parametrize("reported", GARBAGE.values(), ids=GARBAGE)
def test_a_plan_that_is_not_what_is_said_of_it_is_malformed(reported: PlanOnBoard) -> None:
    scene = Scene()
    with pytest.raises(MalformedMessage):
        scene.announce(reported)
    assert scene.reported() == []


def test_a_download_that_is_no_plan_is_malformed() -> None:
    scene = Scene()
    operation = scene.begin(DOWNLOAD)
    with pytest.raises(MalformedMessage):
        scene.end(operation, plan=b"\0\1\0")
    assert operation.running


# -- parameters ----------------------------------------------------------------------------------------------

TABLE = by_name([Parameter("RTL_ALT", 1500.0, 9), Parameter("ARMING_CHECK", 1.0, 6)])
HASH = table_hash(TABLE)


def read_table(scene: Scene) -> None:
    scene.announce(ParameterCache(hash=HASH, count=2, total=2))
    (asked,) = scene.sent()
    assert asked.work == ParametersReadWork(again=False)
    scene.announce(ParameterTable(hash=HASH, packed=pack_table(TABLE)))
    scene.announce(TransactionResult(id=asked.id, outcome=Outcome.DONE, words=""))


def test_a_table_that_is_not_here_is_asked_for_once_and_by_the_tower_itself() -> None:
    scene = Scene()
    read_table(scene)
    assert scene.drone.onboard.parameters.table() == TABLE
    assert [type(event).__name__ for event in scene.reported()] == ["ParametersChanged"]
    scene.pass_time(60.0)
    assert scene.sent() == []


def test_a_table_is_asked_for_again_until_it_is_here() -> None:
    scene = Scene()
    scene.announce(ParameterCache(hash=HASH, count=2, total=2))
    (asked,) = scene.sent()
    scene.announce(TransactionResult(id=asked.id, outcome=Outcome.REFUSED, words="Busy."))
    scene.pass_time(TABLE_AGAIN_AFTER_S - 0.1)
    assert scene.sent() == []
    scene.pass_time(0.2)
    assert len(scene.sent()) == 1


def test_an_agent_that_is_not_online_yet_is_asked_for_its_table_as_soon_as_it_is() -> None:
    scene = Scene()
    link, heard = scene.agent_.link, scene.agent_.link.is_heard
    link.is_heard = lambda now: False  # type: ignore[method-assign]
    scene.hub.tick(scene.now)
    assert not scene.drone.online
    scene.announce(ParameterCache(hash=HASH, count=2, total=2))
    assert scene.sent() == []
    link.is_heard = heard  # type: ignore[method-assign]
    scene.drone.online = True
    scene.pass_time(NOT_YET_S)
    (asked,) = scene.sent()
    assert asked.work == ParametersReadWork(again=False)


def test_the_same_table_is_not_asked_for_again_when_the_agent_is_back() -> None:
    scene = Scene()
    read_table(scene)
    scene.hub.detach_link(scene.agent_.link)
    assert scene.drone.onboard.parameters.table() is None
    scene.agent_ = scene.come(link_id=55)
    scene.announce(ParameterCache(hash=HASH, count=2, total=2))
    assert scene.sent() == []
    assert scene.drone.onboard.parameters.table() == TABLE


def test_a_change_is_taken_over_where_it_fits_the_table_and_else_the_table_is_asked_for() -> None:
    scene = Scene()
    read_table(scene)
    scene.reported()
    changed = by_name([Parameter("RTL_ALT", 3000.0, 9), TABLE[0]])
    scene.announce(
        ParameterChanged(name="RTL_ALT", value=3000.0, kind=9, before=HASH, hash=table_hash(changed)),
    )
    assert scene.drone.onboard.parameters.table() == changed
    assert [event.hash for event in scene.reported()] == [table_hash(changed)]
    scene.announce(ParameterChanged(name="RTL_ALT", value=1.0, kind=9, before="f" * 16, hash="e" * 16))
    assert scene.drone.onboard.parameters.table() is None
    assert scene.sent() == []  # not at once: an agent may report a new hash with every message
    scene.pass_time(TABLES_APART_S)
    assert [one.work for one in scene.sent()] == [ParametersReadWork(again=False)]


def test_changes_that_do_not_add_up_to_their_hash_make_the_table_unknown() -> None:
    scene = Scene()
    read_table(scene)
    scene.announce(ParameterChanged(name="RTL_ALT", value=1.0, kind=9, before=HASH, hash="e" * 16))
    assert scene.drone.onboard.parameters.table() is None
    assert scene.drone.onboard.parameters.lacks_table


def test_a_table_that_nobody_asked_for_is_not_even_looked_at() -> None:
    scene = Scene()
    scene.announce(ParameterTable(hash=HASH, packed=b"garbage"))
    assert scene.drone.onboard.parameters.table() is None


@pytest.mark.parametrize("packed", [b"garbage", pack_table(TABLE[:1]), b""], ids=["garbage", "another", "empty"])
def test_a_table_that_is_not_what_its_hash_says_is_malformed(packed: bytes) -> None:
    scene = Scene()
    scene.announce(ParameterCache(hash=HASH, count=2, total=2))
    with pytest.raises(MalformedMessage):
        scene.announce(ParameterTable(hash=HASH, packed=packed))


@pytest.mark.parametrize("name", ["NO SPACE", "\u00e4"], ids=["space", "letters"])
def test_a_changed_parameter_with_a_name_that_none_has_is_malformed(name: str) -> None:
    scene = Scene()
    with pytest.raises(MalformedMessage):
        scene.announce(ParameterChanged(name=name, value=1.0, kind=9, before=HASH, hash=HASH))
