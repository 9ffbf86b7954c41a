"""How `make run` starts the simulator: on which model, and with a terminal."""

from __future__ import annotations

from pathlib import Path

import pytest
import run_local


@pytest.mark.parametrize(
    ("chosen", "count", "model"),
    [
        ("", 1, "sensing"),
        ("", run_local.MAX_SENSING, "sensing"),
        ("", run_local.MAX_SENSING + 1, "exact"),
        ("exact", 1, "exact"),
        (" sensing ", 200, "sensing"),
    ],
)
def test_a_small_squad_flies_on_sensors(monkeypatch: pytest.MonkeyPatch, chosen: str, count: int, model: str) -> None:
    monkeypatch.setenv("SQUAD_MODEL", chosen)
    assert run_local.flight_model(count) == model


def test_an_unknown_model_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SQUAD_MODEL", "jet")
    with pytest.raises(run_local.CannotRun, match="SQUAD_MODEL must be one of sensing, exact"):
        run_local.flight_model(1)


def test_a_folder_too_deep_for_a_socket_has_the_commander_alone() -> None:
    assert run_local.shell_words(Path("/var/tower/simulator.sock")) == ("--shell", Path("/var/tower/simulator.sock"))
    assert run_local.shell_words(Path("/" + "x" * 101)) == ("--commander",)
