"""Which tower a drone belongs to, as one tower sees it. With a single tower every drone is `HERE`."""

from enum import Enum


class Place(Enum):
    HERE = "here"
    """This tower is the drone's home: it alone passes commands, orders holds and changes the lease."""
    ELSEWHERE = "elsewhere"
    """Another tower is, and it is within reach: it shows the drone to the browsers of this one."""
    OUT_OF_REACH = "out of reach"
    """Another tower is, and it is not heard. Browsers here see the drone offline."""
    NOWHERE = "nowhere"
    """No tower is: the drone never had a link or a holder since the towers share a bus."""
