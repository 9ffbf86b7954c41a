"""The benchmarks' load keeps its kinds: a table that moves in wire/ must not turn its events into state."""

from bench.load_frames import EVENT_KINDS, STATE_KINDS, stamped_frame
from wire.state_messages import state_key


def test_the_kinds_of_the_load_are_of_the_classes_that_the_tower_knows() -> None:
    for msgid in STATE_KINDS:
        first, second = stamped_frame(msgid, 1, 0, 0), stamped_frame(msgid, 1 << 40, 0, 1)
        assert state_key(first) is not None
        assert state_key(first) == state_key(second)
    for msgid in EVENT_KINDS:
        assert state_key(stamped_frame(msgid, 1, 1, 0)) is None
