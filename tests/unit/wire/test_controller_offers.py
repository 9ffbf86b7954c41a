"""The names of an agent's controllers in its hello."""

import msgspec

from wire.control_messages import Takes
from wire.controllers import CONTROLLERS, MAX_OFFERED, offered, offers


def test_the_tower_reads_the_names_that_an_agent_tells() -> None:
    assert offered((CONTROLLERS, *offers(["survey", "challenge"]), "video")) == ["challenge", "survey"]
    assert offered((CONTROLLERS, "video")) == []


def test_every_hello_stays_within_its_bounds() -> None:
    names = ["a" * 29, "b" * 30, "/opt/x.py", "", *(f"c{number}" for number in range(50))]
    entries = offers(names)
    assert len(entries) == MAX_OFFERED
    assert offered(entries)[0] == "a" * 29
    assert not {"b" * 30, "/opt/x.py", ""} & set(offered(entries))
    assert msgspec.convert(entries, Takes) == entries


def test_a_name_that_is_none_is_not_shown() -> None:
    assert offered(("controller:<b>", "controller:", "controller:ok")) == ["ok"]
