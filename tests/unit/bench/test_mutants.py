"""The changes of the code that `bench.mutants` draws: each is one place, and a probe changes nothing."""

import ast
import builtins
from typing import Any

import pytest

from bench.mutants import AREAS, CHECKOUT, OF_EACH_AREA, SEED, draw, mutants_of, mutated, probed

TEXT = '''
LIMIT = 3

def judge(height_m, seen):
    """“Height” is not ASCII."""
    said = []
    if height_m > LIMIT and not seen:
        said.append("é")
    for number in (1, 2):
        said.append(f"{number + 1}")
    return said, height_m == 7, True
'''


def run(text: str, *arguments: Any) -> Any:
    names: dict[str, Any] = {}
    exec(compile(text, "text", "exec"), names)
    return names["judge"](*arguments)


def test_each_change_is_one_place_and_is_valid() -> None:
    news = [(one.line, one.new) for one in mutants_of("a.py", "x", TEXT)]
    assert (7, "(height_m >= LIMIT)") in news
    assert (7, "((height_m > LIMIT) or (not seen))") in news
    assert (7, "bool(seen)") in news
    assert (8, "pass") in news
    assert (9, "(2 + 1)") in news
    assert (11, "(height_m != 7)") in news
    assert (11, "False") in news
    assert not [line for line, _ in news if line in (2, 5)], "the rest of the module runs once, at its import"
    for one in mutants_of("a.py", "x", TEXT):
        changed = mutated(TEXT, one)
        assert changed != TEXT
        assert ast.parse(changed)


def test_a_change_changes_what_is_done() -> None:
    assert run(TEXT, 5, False) == (["é", "2", "3"], False, True)
    left_out = next(one for one in mutants_of("a.py", "x", TEXT) if one.line == 8)
    assert run(mutated(TEXT, left_out), 5, False) == (["2", "3"], False, True)


def test_a_probe_notes_what_is_reached_and_changes_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    reached: set[int] = set()
    monkeypatch.setattr(builtins, "__builtins_hit__", reached.add, raising=False)
    chosen = [one for one in mutants_of("a.py", "x", TEXT) if one.line in (8, 11) and one.new != "(7 + 1)"]
    numbered = [type(one)(**{**vars(one), "number": number}) for number, one in enumerate(chosen)]
    text = probed(TEXT, numbered)
    assert run(text, 1, False) == run(TEXT, 1, False)
    assert reached == {1, 2}
    assert run(text, 5, False) == run(TEXT, 5, False)
    assert reached == {0, 1, 2}


def test_the_same_changes_are_drawn_again_as_many_from_each_area() -> None:
    drawn = draw(CHECKOUT, SEED)
    assert drawn == draw(CHECKOUT, SEED)
    assert [one.number for one in drawn] == list(range(len(AREAS) * OF_EACH_AREA))
    for one in drawn:
        assert one.file in AREAS[one.area]
        ast.parse(mutated((CHECKOUT / one.file).read_text(), one))
    for file in {one.file for one in drawn}:
        ast.parse(probed((CHECKOUT / file).read_text(), [one for one in drawn if one.file == file]))
