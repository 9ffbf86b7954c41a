"""Distinct types for numbers that must never be mixed up. Types only: nothing else may be added here."""

from typing import NewType

DroneId = NewType("DroneId", int)
"""The tower's number for a drone, 1..2**32-1: the tag in front of a frame."""

UserId = NewType("UserId", int)
LinkId = NewType("LinkId", int)
"""One association of an agent with the tower, random, 32 bits."""

Epoch = NewType("Epoch", int)
"""Increments each time the holder of a drone changes, 0..2**32-1."""

SystemId = NewType("SystemId", int)
ComponentId = NewType("ComponentId", int)
MessageId = NewType("MessageId", int)
