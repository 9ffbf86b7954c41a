"""The names of the controllers that an agent has, and its setting `controllers`. Loads none of them."""

import re
from collections.abc import Mapping, Sequence
from importlib.metadata import entry_points
from typing import Final

from onboard_agent.unusable import Unusable

GROUP: Final = "control_tower.controllers"
BUILT_IN: Final = {
    "challenge": ("onboard_agent.autonomy.challenge", "Challenge"),
    "scripted": ("onboard_agent.autonomy.scripted", "Scripted"),
}
FORM: Final = "NAME=/FILE.py:CLASS"
_FORM: Final = re.compile(r"([a-z][a-z0-9_-]{0,39})=(/[^:]+\.py:[A-Za-z_]\w*)")


def parse_controllers(texts: Sequence[str]) -> Mapping[str, str]:
    """Returns FILE:CLASS by name. Raises Unusable."""
    found: dict[str, str] = {}
    for text in texts:
        match = _FORM.fullmatch(text)
        if match is None:
            raise Unusable(f"controllers: {text!r} is not of the form {FORM}, with the file's whole path")
        name, source = match.groups()
        if name in found:
            raise Unusable(f"controllers: {name} is there twice")
        found[name] = source
    return found


def names_on_board(sources: Mapping[str, str]) -> list[str]:
    """Returns the names of all controllers that the tower may start, in order. `sources`: as `parse_controllers`."""
    return sorted(sources_on_board(sources))


def sources_on_board(sources: Mapping[str, str]) -> dict[str, str]:
    """Returns FILE:CLASS by name of the same controllers; empty: built in, or of a package."""
    return {**dict.fromkeys(BUILT_IN, ""), **{entry.name: "" for entry in entry_points(group=GROUP)}, **sources}
