"""Turns and shares of a queue that several share."""

from hypothesis import given
from hypothesis import strategies as st

from server.kernel.fair_queue import FairQueue


def test_each_has_a_turn_and_the_oldest_of_ones_own_goes_first() -> None:
    queue: FairQueue[str, int] = FairQueue(share=3)
    for number in range(5):
        queue.put("noisy", number)
    queue.put("calm", 9)
    assert (len(queue), queue.waiting("noisy"), queue.dropped) == (4, 3, 2)
    assert [queue.pop() for _ in range(4)] == [("noisy", 2), ("calm", 9), ("noisy", 3), ("noisy", 4)]
    assert len(queue) == 0


@given(st.lists(st.tuples(st.sampled_from("abc"), st.integers()), max_size=60))
def test_nobody_loses_anything_to_another(put: list[tuple[str, int]]) -> None:
    queue: FairQueue[str, int] = FairQueue(share=4)
    for whose, item in put:
        queue.put(whose, item)
    kept = {one: [item for whose, item in put if whose == one][-4:] for one in "abc"}
    popped: dict[str, list[int]] = {one: [] for one in "abc"}
    in_turn = []
    while len(queue):
        whose, item = queue.pop()
        popped[whose].append(item)
        in_turn.append(whose)
    assert popped == kept
    for at in range(len(in_turn) - 1):  # nobody is served twice in a row while another waits
        assert in_turn[at] != in_turn[at + 1] or len(set(in_turn[at:])) == 1
