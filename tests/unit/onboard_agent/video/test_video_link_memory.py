"""The rate that a link carried is kept for its next stream, and for no other link."""

from onboard_agent.video.core.link_memory import REMEMBERED_S, LinkMemory
from onboard_agent.video.core.link_rate import Known

KNOWN = Known(2e6, 1.5e6, 2.1e6, 0.05)
HERE = "192.0.2.7"


def test_the_same_link_within_some_minutes() -> None:
    memory = LinkMemory()
    assert memory.recall(HERE, 0.0) is None
    memory.note(KNOWN, HERE, 10.0)
    assert memory.recall(HERE, 10.0 + REMEMBERED_S) == KNOWN
    assert memory.recall(HERE, 11.0 + REMEMBERED_S) is None
    assert memory.recall(HERE, 9.0) is None, "the computer has started again"


def test_another_uplink_is_another_link() -> None:
    memory = LinkMemory()
    memory.note(KNOWN, HERE, 10.0)
    assert memory.recall("198.51.100.7", 11.0) is None
    memory.forget()
    assert memory.recall(HERE, 11.0) is None


def test_the_next_process_knows_it_too() -> None:
    memory = LinkMemory()
    memory.note(KNOWN, HERE, 10.0)
    assert LinkMemory(memory.remembered).recall(HERE, 20.0) == KNOWN
