"""The identification of a recorded flight in its own process, with the traces for its plots."""

from pathlib import Path

import numpy as np
import pytest
from test_identification import SYSTEMS, check, doublets, flown, frames

from server.flights.core.refusals import NotIdentified
from server.flights.core.tlog import STAMP
from server.identification.core.first_order import fit, manoeuvres_in
from server.identification.core.traces import MAX_POINTS, MAX_TRACES, traces
from server.identification.store.running import run_identification
from server.storage import bounded_program
from server.storage.bounded_program import TooMuchSaid, run_program


def test_the_model_goes_along_what_the_drone_did() -> None:
    manoeuvres = manoeuvres_in(*flown(100, gain=40, tau_s=0.3, delay_s=0.1, stick=doublets, lasts_s=60))
    found = fit(manoeuvres)
    assert found is not None
    shown = traces(manoeuvres, found)
    assert len(shown) == MAX_TRACES < len(manoeuvres)
    assert [one.began_s for one in shown] == sorted(one.began_s for one in shown)
    for one in shown:
        assert MAX_POINTS / 2 < len(one.times_s) <= MAX_POINTS
        assert len(one.times_s) == len(one.given) == len(one.got) == len(one.model)
        assert one.times_s[0] == 0.0
        assert np.ptp(one.got) > 20
        assert np.abs(np.subtract(one.model, one.got)).max() < 1.5
    assert min(np.ptp(one.given) for one in shown) >= 1.2, "the largest of ten"


async def test_a_flight_is_identified_in_a_process_of_its_own(tmp_path: Path) -> None:
    (log := tmp_path / "flight.tlog").write_bytes(b"".join(STAMP.pack(at_us) + frame for at_us, frame in frames()))
    axes = await run_identification(log)
    check({one["axis"]: one["fit"] for one in axes})
    for one in axes:
        assert len(one["traces"]) == 4
        gain = abs(SYSTEMS[one["axis"]][0])
        for trace in one["traces"]:
            assert 1_000 <= trace["began_s"] < 1_100
            apart = np.abs(np.subtract(trace["model"], trace["got"]))
            assert apart.max() < 0.1 * gain, one["axis"]


async def test_a_flight_that_cannot_be_read_is_refused_with_words(tmp_path: Path) -> None:
    with pytest.raises(NotIdentified, match="No such file"):
        await run_identification(tmp_path / "none.tlog")
    (tmp_path / "empty.tlog").touch()
    assert [one["fit"] for one in await run_identification(tmp_path / "empty.tlog")] == [None] * 4


async def test_a_program_that_says_too_much_or_takes_too_long_is_ended(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(bounded_program, "_ROOT", tmp_path)
    (tmp_path / "talks.py").write_text("while True: print('more', flush=True)")
    (tmp_path / "sleeps.py").write_text("import time; time.sleep(600)")
    (tmp_path / "secrets_of_it.py").write_text("import os; print(sorted(os.environ))")
    monkeypatch.setenv("TOWER_SECRET_KEYS", "x")
    with pytest.raises(TooMuchSaid):
        await run_program("talks", within_s=60, max_bytes=1_000)
    with pytest.raises(TimeoutError):
        await run_program("sleeps", within_s=0.2, max_bytes=1_000)
    code, said = await run_program("secrets_of_it", within_s=60, max_bytes=1_000)
    assert code == 0
    assert b"TOWER" not in said
