"""The messages about work at the drone survive JSON, keep their bounds, and are told apart from all others."""

from typing import Any

import msgspec
import pytest

from wire import control_messages
from wire.plans import ITEMS_MOST, PlanItem, PlanKind
from wire.transactions import (
    LARGEST_TRANSACTION_BYTES,
    CancelTransaction,
    CommandWork,
    Outcome,
    ParametersReadWork,
    ParametersWriteWork,
    PlanClearWork,
    PlanDownloadWork,
    PlanOnBoard,
    PlanUploadWork,
    PlanVerifyWork,
    Transaction,
    TransactionProgress,
    TransactionResult,
    TransactionToAgent,
    TransactionToTower,
)

WIDEST = PlanItem(65535, 255, (-1.1754943508222875e-38,) * 4, -(2**31), -(2**31), -1.1754943508222875e-38, 255)
WORKS = [
    PlanDownloadWork(PlanKind.FENCE),
    PlanUploadWork(PlanKind.MISSION, (PlanItem(22, 3, (0.0, 0.0, 0.0, None), z=30.0), WIDEST)),
    PlanClearWork(PlanKind.RALLY),
    PlanVerifyWork(PlanKind.MISSION, ()),
    ParametersReadWork(again=True),
    ParametersWriteWork((("RTL_ALT", 2000.0), ("WPNAV_SPEED", 0.1))),
    CommandWork(192, (-1.0, 1.0, 0.0, None, 0.0, 0.0, 30.0), x=473977420, y=85455940, frame=6),
]


@pytest.mark.parametrize("work", WORKS, ids=lambda work: type(work).__name__)
def test_what_is_to_be_done_survives_json(work: Any) -> None:
    sent = Transaction(id=7, epoch=3, deadline_s=30.0, work=work)
    assert msgspec.json.decode(msgspec.json.encode(sent), type=TransactionToAgent) == sent


@pytest.mark.parametrize(
    "told",
    [
        TransactionProgress(id=7, phase="writing", done=3, total=200),
        TransactionResult(id=7, outcome=Outcome.FAILED, words="No.", item=3, code="MAV_MISSION_UNSUPPORTED"),
        PlanOnBoard(kind=PlanKind.MISSION, hash=None, fit_to_fly=False),
        PlanOnBoard(kind=PlanKind.RALLY, hash="00" * 8, count=1, items=(WIDEST,), sent_hash="11" * 8),
    ],
    ids=lambda told: type(told).__name__,
)
def test_what_came_of_it_survives_json(told: Any) -> None:
    assert msgspec.json.decode(msgspec.json.encode(told), type=TransactionToTower) == told


def test_the_longest_plan_of_the_widest_items_fits_into_a_message() -> None:
    work = PlanUploadWork(PlanKind.MISSION, (WIDEST,) * ITEMS_MOST)
    sent = msgspec.json.encode(Transaction(id=2**32 - 1, epoch=2**32 - 1, deadline_s=599.5, work=work))
    assert len(sent) <= LARGEST_TRANSACTION_BYTES
    longer = sent.replace(b'"items":[', b'"items":[' + msgspec.json.encode(WIDEST) + b",")
    with pytest.raises(msgspec.ValidationError):
        msgspec.json.decode(longer, type=TransactionToAgent)


@pytest.mark.parametrize(
    "changed",
    [{"epoch": -1}, {"deadline_s": 0}, {"deadline_s": 601}, {"work": {"work": "self_destruct"}}, {"id": 2**32}],
)
def test_what_is_out_of_bounds_is_refused(changed: dict[str, Any]) -> None:
    good = msgspec.to_builtins(Transaction(id=7, epoch=3, deadline_s=30.0, work=WORKS[0]))
    with pytest.raises(msgspec.ValidationError):
        msgspec.convert({**good, **changed}, type=TransactionToAgent)


def test_their_types_are_told_apart_from_those_of_the_control_channel() -> None:
    everything = control_messages.ToTower | control_messages.ToAgent | TransactionToTower | TransactionToAgent
    decoder = msgspec.json.Decoder(everything)  # msgspec refuses a union in which two have the same tag
    cancel = CancelTransaction(id=7)
    assert decoder.decode(msgspec.json.encode(cancel)) == cancel
