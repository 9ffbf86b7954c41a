"""The order in which a tower that ends its work sends its drones elsewhere."""

from server.towers.core.drain import ASK_AGAIN_AFTER_S, MAX_ASKED, Drain, Linked, Step
from wire.ids import LinkId


def link(number: int, *, by_hand: bool = False, settled: bool = True, can_move: bool = True) -> Linked:
    return Linked(LinkId(number), f"drone {number}", by_hand, settled, can_move)


def test_drones_that_nobody_flies_by_hand_go_first_and_not_all_at_once() -> None:
    drain = Drain()
    links = [link(1, by_hand=True), *(link(number) for number in range(2, 2 + MAX_ASKED + 3))]
    assert drain.due(links, 0.0) == [(LinkId(number), Step.ASK) for number in range(2, 2 + MAX_ASKED)]
    assert drain.due(links, 0.1) == []
    left = [one for one in links if one.link_id not in (2, 3)]
    assert [number for number, _ in drain.due(left, 0.2)] == [2 + MAX_ASKED, 3 + MAX_ASKED]


def test_who_did_not_go_is_asked_again_behind_those_who_were_not_asked() -> None:
    drain = Drain()
    links = [link(number) for number in range(1, MAX_ASKED + 3)]
    drain.due(links, 0.0)
    later = [number for number, _ in drain.due(links, ASK_AGAIN_AFTER_S)]
    assert later == [MAX_ASKED + 1, MAX_ASKED + 2, *range(1, MAX_ASKED - 1)]


def test_hand_flown_drones_go_last_and_one_after_the_other() -> None:
    drain = Drain()
    links = [link(1, by_hand=True), link(2, by_hand=True)]
    assert drain.due(links, 0.0) == [(LinkId(1), Step.ASK)]
    assert drain.due(links, 1.0) == []
    assert drain.due(links[1:], 1.1) == [(LinkId(2), Step.ASK)]


def test_a_hand_flown_drone_waits_while_its_next_tower_would_make_it_hold() -> None:
    drain = Drain()
    assert drain.due([link(1, by_hand=True, settled=False)], 0.0) == []
    assert drain.due([link(1, by_hand=True, settled=False), link(2, by_hand=True)], 0.1) == [(LinkId(2), Step.ASK)]


def test_an_agent_that_cannot_move_is_closed_but_never_under_a_hand() -> None:
    drain = Drain()
    assert drain.due([link(1, can_move=False), link(2)], 0.0) == [(LinkId(1), Step.CLOSE), (LinkId(2), Step.ASK)]
    assert drain.due([link(3, by_hand=True, can_move=False)], 1.0) == []


def test_how_far_it_is_names_the_drones_that_are_flown() -> None:
    words = Drain.in_words([link(1), link(2), link(3, by_hand=True, can_move=False)], 4)
    assert words == "2 drones to move; flown by hand: drone 3 (drone 3 cannot move in flight); 4 browsers to move"
    assert Drain.in_words([], 0) == "done"
