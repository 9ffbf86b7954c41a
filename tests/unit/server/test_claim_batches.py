"""Claims that come at the same time share a transaction, and a failed one keeps nobody but its own drone."""

from __future__ import annotations

import asyncio

import pytest

from server.towers.store.claim_batches import MAX_DRONES, MAX_TRANSACTIONS, ClaimBatches
from wire.ids import DroneId


class Transactions:
    """Each waits until `go`, and fails if it has one of the `locked` drones."""

    def __init__(self) -> None:
        self.began: list[list[DroneId]] = []
        self.locked: set[DroneId] = set()
        self.go = asyncio.Event()
        self.go.set()

    async def claim_all(self, drone_ids: list[DroneId]) -> dict[DroneId, str]:
        self.began.append(drone_ids)
        await self.go.wait()
        if self.locked.intersection(drone_ids):
            raise OSError("locked")
        return {one: f"claimed {one}" for one in drone_ids if one != 404}


def drones(*numbers: int) -> list[DroneId]:
    return [DroneId(one) for one in numbers]


async def test_one_claim_has_a_transaction_of_its_own() -> None:
    transactions = Transactions()
    batches = ClaimBatches(transactions.claim_all)
    assert await batches.claim(DroneId(7)) == "claimed 7"
    assert await batches.claim(DroneId(404)) is None
    assert transactions.began == [drones(7), drones(404)]


async def test_claims_that_wait_share_the_next_transaction() -> None:
    transactions = Transactions()
    transactions.go.clear()
    batches = ClaimBatches(transactions.claim_all)
    last = MAX_TRANSACTIONS + MAX_DRONES + 10
    claims = [asyncio.create_task(batches.claim(DroneId(one))) for one in range(last, 0, -1)]
    await asyncio.sleep(0)
    await asyncio.sleep(0)
    assert transactions.began == [drones(last - one) for one in range(MAX_TRANSACTIONS)]
    transactions.go.set()
    assert await asyncio.gather(*claims) == [f"claimed {one}" for one in range(last, 0, -1)]
    shared = transactions.began[MAX_TRANSACTIONS:]
    assert [len(one) for one in shared] == [MAX_DRONES, 10]
    assert all(one == sorted(one) for one in shared)


async def test_after_a_failure_each_is_claimed_by_itself() -> None:
    transactions = Transactions()
    transactions.go.clear()
    transactions.locked = set(drones(90))
    batches = ClaimBatches(transactions.claim_all)
    first = [asyncio.create_task(batches.claim(DroneId(one))) for one in range(1, MAX_TRANSACTIONS + 1)]
    await asyncio.sleep(0)
    shared = [asyncio.create_task(batches.claim(DroneId(one))) for one in (90, 91)]
    await asyncio.sleep(0)
    transactions.go.set()
    await asyncio.gather(*first)
    failed = await asyncio.gather(*shared, return_exceptions=True)
    assert [type(one) for one in failed] == [OSError, OSError]
    again = await asyncio.gather(*(batches.claim(DroneId(one)) for one in (90, 91)), return_exceptions=True)
    assert isinstance(again[0], OSError)
    assert again[1] == "claimed 91"
    assert transactions.began[MAX_TRANSACTIONS:] == [drones(90, 91), drones(90), drones(91)]


async def test_a_cancelled_claim_is_not_made() -> None:
    transactions = Transactions()
    transactions.go.clear()
    batches = ClaimBatches(transactions.claim_all)
    first = [asyncio.create_task(batches.claim(DroneId(one))) for one in range(1, MAX_TRANSACTIONS + 1)]
    late = [asyncio.create_task(batches.claim(DroneId(one))) for one in (90, 91)]
    await asyncio.sleep(0)
    late[0].cancel()
    with pytest.raises(asyncio.CancelledError):
        await late[0]
    transactions.go.set()
    await asyncio.gather(*first)
    assert await late[1] == "claimed 91"
    assert transactions.began[-1] == drones(91)
