"""No text that the tower or an agent makes stands outside the console's catalogue."""

import importlib.util
import json
import re
import sys
from pathlib import Path
from types import ModuleType

import pytest

SCRIPTS = Path(__file__).resolve().parents[3] / "web" / "scripts"


@pytest.fixture(scope="module")
def script() -> ModuleType:
    spec = importlib.util.spec_from_file_location("tower_texts", SCRIPTS / "tower_texts.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


def test_the_catalogue_has_each_text_of_the_sources_and_no_other(script: ModuleType) -> None:
    wanted = script.collected()
    for language in script.LANGUAGES:
        folder = script.CHECKOUT / "web" / "src" / "languages" / language / "tower"
        known = {text for path in folder.glob("*.json") for text in json.loads(path.read_text(encoding="utf-8"))}
        assert known == set(wanted), "run `npm run texts:tower` in web/ and translate what it adds"


def test_rules_name_sources_that_exist(script: ModuleType) -> None:
    """A source that moved would otherwise take its texts out of the catalogue, or none, in silence."""
    places = {place for place, _ in script._sources()}
    assert set(script.MORE) <= places
    assert {area for area, pattern in script.AREAS if any(re.match(pattern, place) for place in places)} == {
        area for area, _ in script.AREAS
    }


@pytest.mark.parametrize(
    ("source", "texts"),
    [
        ('raise Refusal("there is no such drone")', ["there is no such drone"]),
        ('raise Offline(f"{drone.name} is offline")', ["{name} is offline"]),
        ('say(f"above {height_m:.0f} m of {zone.name}")', ["above {height_m:number} m of {name}"]),
        ('say(f"{name} holds: {why}.")', ["{name} holds: {why:text}."]),
        ('say(f"{a.name} follows {b.name}")', ["{name} follows {name2}"]),
        ('''say(f"it {'is' if n == 1 else 'was'} there")''', ["it is there", "it was there"]),
        ('say("The autopilot says: " + words)', ["The autopilot says: {words:text}"]),
        ('words = "low"', ["low"]),
        ('level = "low" if charge < 30 else "critical"', ["low", "critical"]),
        ('"""A docstring is for programmers."""', []),
        ('_log.info("the drone is linked")', []),
        ('if text == "no answer": pass', []),
        ('kind = "no-fly"', []),
    ],
)  # fmt: skip
def test_a_text_is_a_literal_that_people_read(script: ModuleType, source: str, texts: list[str]) -> None:
    assert script.texts_of(source) == texts
