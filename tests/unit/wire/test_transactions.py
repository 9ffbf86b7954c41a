"""The messages about transactions survive JSON, keep their limits, and are distinct from all others."""

from typing import Any

import msgspec
import pytest

from wire import control_messages
from wire.plans import MAX_ITEMS_ANY, PlanItem, PlanKind, pack_plan
from wire.transactions import (
    MAX_LOGS,
    MAX_PACKED_TABLE_BYTES,
    MAX_REFUSALS,
    MAX_TRANSACTION_BYTES,
    CancelTransaction,
    CommandWork,
    LogDownloadWork,
    LogEntry,
    LogListWork,
    Outcome,
    ParameterCache,
    ParameterChanged,
    ParameterRefusal,
    ParametersReadWork,
    ParametersWriteWork,
    ParameterTable,
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
    LogListWork(),
    LogDownloadWork(65535),
    CommandWork(192, (-1.0, 1.0, 0.0, None, 0.0, 0.0, 30.0), x=473977420, y=85455940, frame=6),
]


@pytest.mark.parametrize("work", WORKS, ids=lambda work: type(work).__name__)
def test_what_is_to_be_done_survives_json(work: Any) -> None:
    sent = Transaction(id=7, epoch=3, deadline_s=30.0, work=work)
    assert msgspec.json.decode(msgspec.json.encode(sent), type=TransactionToAgent) == sent


@pytest.mark.parametrize(
    "reported",
    [
        TransactionProgress(id=7, phase="writing", done=3, total=200),
        TransactionResult(id=7, outcome=Outcome.FAILED, words="No.", item=3, code="MAV_MISSION_UNSUPPORTED"),
        TransactionResult(
            id=8, outcome=Outcome.DONE, words="", refusals=(ParameterRefusal("RTL_ALT", 1e6, None, "No."),), refused=1
        ),
        TransactionResult(id=8, outcome=Outcome.DONE, words="", logs=(LogEntry(65535, 2**32 - 1, None),)),
        PlanOnBoard(kind=PlanKind.MISSION, hash=None, fit_to_fly=False),
        ParameterCache(hash=None, count=17, total=1400),
        ParameterTable(hash="00" * 8, packed=b"x"),
        ParameterChanged(name="RTL_ALT", value=0.1, kind=9, before="00" * 8, hash="11" * 8),
        PlanOnBoard(
            kind=PlanKind.RALLY, hash="00" * 8, count=1, plan=pack_plan(PlanKind.RALLY, (WIDEST,)), sent_hash="11" * 8
        ),
    ],
    ids=lambda reported: type(reported).__name__,
)
def test_what_came_of_it_survives_json(reported: Any) -> None:
    assert msgspec.json.decode(msgspec.json.encode(reported), type=TransactionToTower) == reported


def test_the_longest_plan_of_the_widest_items_fits_into_a_message() -> None:
    work = PlanUploadWork(PlanKind.MISSION, (WIDEST,) * MAX_ITEMS_ANY)
    sent = msgspec.json.encode(Transaction(id=2**32 - 1, epoch=2**32 - 1, deadline_s=599.5, work=work))
    assert len(sent) <= MAX_TRANSACTION_BYTES
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


def test_what_goes_to_the_tower_keeps_its_bound() -> None:
    refusal = ParameterRefusal("N" * 16, -1.1754943508222875e-38, -1.1754943508222875e-38, "w" * 160)
    plan = pack_plan(PlanKind.MISSION, (WIDEST,) * MAX_ITEMS_ANY)
    for reported in (
        TransactionResult(id=2**32 - 1, outcome=Outcome.DONE, words="w" * 600, refusals=(refusal,) * MAX_REFUSALS),
        TransactionResult(id=2**32 - 1, outcome=Outcome.DONE, words="w" * 600, plan=plan),
        TransactionResult(
            id=1, outcome=Outcome.DONE, words="", logs=(LogEntry(65535, 2**32 - 1, 2**32 - 1),) * MAX_LOGS
        ),
        PlanOnBoard(kind=PlanKind.MISSION, hash="00" * 8, count=MAX_ITEMS_ANY, plan=plan, sent_hash="11" * 8),
        ParameterTable(hash="00" * 8, packed=b"x" * MAX_PACKED_TABLE_BYTES),
    ):
        sent = control_messages.encode_message(reported)
        assert len(sent) <= control_messages.MAX_MESSAGE_BYTES
        assert control_messages.decode_to_tower(sent) == reported


def test_the_control_channel_carries_them() -> None:
    cancel = CancelTransaction(id=7)
    assert control_messages.decode_to_agent(control_messages.encode_message(cancel)) == cancel
    everything = control_messages.ToTower | control_messages.ToAgent
    msgspec.json.Decoder(everything)  # msgspec refuses a union in which two have the same tag
