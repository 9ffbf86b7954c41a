"""Mutations of bytes without knowledge of their meaning. Everything derives from the seed."""

from __future__ import annotations

import random
from typing import Final

_EDGES: Final = (0x00, 0x01, 0x7F, 0x80, 0xFE, 0xFD, 0xFF)
_EDGE_NUMBERS: Final = (0, 1, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF)
_MAX_STEPS: Final = 4


class Mutator:
    """`chance` is the only source of randomness, so that a run can be repeated."""

    def __init__(self, chance: random.Random) -> None:
        self.chance = chance

    def mutate(self, data: bytes) -> bytes:
        """Applies one to four mutations in a row. May return the same bytes."""
        mutable = bytearray(data)
        for _ in range(self.chance.randint(1, _MAX_STEPS)):
            self._step(mutable)
        return bytes(mutable)

    def differently(self, data: bytes) -> bytes:
        """Mutates at least one bit."""
        while (mutated := self.mutate(data)) == data:
            pass
        return mutated

    def flip_bits(self, data: bytes) -> bytes:
        """Flips one to eight different bits; the length stays."""
        mutable = bytearray(data)
        for bit in self.chance.sample(range(len(data) * 8), self.chance.randint(1, 8)):
            mutable[bit // 8] ^= 1 << bit % 8
        return bytes(mutable)

    def noise(self, at_most: int) -> bytes:
        """Returns random bytes, with a random length that is often small or at the limit."""
        pick = self.chance.random()
        size = at_most if pick < 0.05 else self.chance.randint(0, min(40, at_most)) if pick < 0.5 else None
        return self.chance.randbytes(self.chance.randint(0, at_most) if size is None else size)

    def _step(self, data: bytearray) -> None:
        chance = self.chance
        if not data:
            data += chance.randbytes(chance.randint(1, 8))
            return
        at = chance.randrange(len(data))
        match chance.randrange(8):
            case 0:
                data[at] ^= 1 << chance.randrange(8)
            case 1:
                data[at] = chance.choice(_EDGES)
            case 2:
                data[at] = chance.randrange(256)
            case 3:
                del data[at : at + chance.randint(1, 16)]
            case 4:
                data[at:at] = chance.randbytes(chance.randint(1, 16))
            case 5:
                data[at:at] = data[at : at + chance.randint(1, 64)]
            case 6:
                del data[at:]
            case _:
                number = chance.choice(_EDGE_NUMBERS).to_bytes(4, "little")
                data[at : at + 4] = number
