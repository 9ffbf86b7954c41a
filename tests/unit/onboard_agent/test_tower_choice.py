"""Which tower an agent links to, and when it looks for another one."""

from pathlib import Path

import pytest

from onboard_agent.link.tower_choice import TowerChoice
from onboard_agent.link.tower_file import TowerFile
from onboard_agent.link.tower_leaving import AGAIN_AFTER_S, LOOK_AFTER_S, TowerLeaving
from onboard_agent.link.tower_url import parse_tower_url

A, B, C = (parse_tower_url(f"https://{one}.example.org") for one in "abc")


def choice(*kept: str) -> TowerChoice:
    return TowerChoice(A, kept, shuffle=lambda found: found.reverse())


def test_without_a_list_there_is_one_tower() -> None:
    made = choice()
    assert (made.in_order(), made.others()) == ([A], [])


def test_the_present_tower_is_tried_first_and_last_once_it_is_given_up() -> None:
    made = choice()
    assert made.learn([str(A), str(B), str(C)])
    assert not made.learn([str(A), str(B), str(C)])
    assert made.in_order() == [A, C, B]
    made.gave_up()
    assert made.in_order() == [C, B, A]
    made.linked(B)
    assert made.in_order() == [B, C, A]
    assert made.kept == (str(A), str(B), str(C))


def test_the_configured_tower_stays_in_the_list() -> None:
    made = choice(str(B))
    made.linked(B)
    assert made.in_order() == [B, A]


@pytest.mark.parametrize("address", ["http://127.0.0.1:8000", "ftp://b.example.org", "https://b.org/x", "", "b"])
def test_an_address_that_is_less_safe_than_the_configured_one_does_not_count(address: str) -> None:
    assert choice(address).in_order() == [A]


def test_on_this_machine_plain_http_is_as_safe() -> None:
    here, there = parse_tower_url("http://127.0.0.1:1"), parse_tower_url("http://127.0.0.1:2")
    assert TowerChoice(here, [str(there)]).in_order() == [here, there]


def test_the_list_is_kept(tmp_path: Path) -> None:
    file = TowerFile(tmp_path)
    assert file.read() == ()
    file.keep((str(A), str(B)))
    assert TowerFile(tmp_path).read() == (str(A), str(B))
    assert (tmp_path / "towers").stat().st_mode & 0o777 == 0o600
    (tmp_path / "towers").write_bytes(b"\xff\xfe")
    assert file.read() == ()
    TowerFile(None).keep((str(A),))
    TowerFile(tmp_path / "missing").keep((str(A),))


def test_it_looks_for_another_tower_in_silence_and_leaves_only_if_the_silence_lasts() -> None:
    leaving = TowerLeaving()
    assert not leaving.wants_to_look(silent_s=LOOK_AFTER_S, now=10.0)
    assert leaving.wants_to_look(silent_s=LOOK_AFTER_S + 0.01, now=10.0)
    assert leaving.may_go(heard_since_reached=False)
    assert not leaving.may_go(heard_since_reached=True)
    leaving.failed(10.0)
    assert not leaving.wants_to_look(silent_s=5.0, now=10.0 + AGAIN_AFTER_S - 0.01)
    assert leaving.wants_to_look(silent_s=5.0, now=10.0 + AGAIN_AFTER_S)


def test_sent_away_it_leaves_a_tower_that_is_heard() -> None:
    leaving = TowerLeaving()
    leaving.sent_away()
    assert leaving.wants_to_look(silent_s=0.0, now=0.0)
    assert leaving.may_go(heard_since_reached=True)
