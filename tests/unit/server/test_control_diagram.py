"""docs/control.md shows the current lease table."""

from pathlib import Path
from typing import Final

from server.control.core.diagram import draw, transitions
from server.control.core.lease import Event, Phase
from server.control.store.rehearsal import LASTS_S
from server.kernel.drone_settings import DEFAULTS

PAGE: Final = (Path(__file__).resolve().parents[3] / "docs" / "control.md").read_text()


def test_the_diagram_in_the_document_is_drawn_from_the_table() -> None:
    assert f"```mermaid\n{draw()}```\n" in PAGE, "run: python -m server.control.core.diagram"


def test_the_diagram_leaves_nothing_out() -> None:
    drawn = list(transitions())
    assert {before for before, *_ in drawn} == set(Phase)
    assert {event for _, event, *_ in drawn} == set(Event)


def test_every_event_and_every_setting_is_explained() -> None:
    for name in (*Event, *DEFAULTS.as_values()):
        assert f"`{name}`" in PAGE, name
    for seconds in LASTS_S.values():
        assert f"{seconds:g} s" in PAGE
