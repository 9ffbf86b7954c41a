"""The pre-flight loss check on a terminal: reads out what a loss would do and asks for confirmation."""

from collections.abc import Awaitable, Callable

from connect.rest import Rest
from connect.squad import Chosen
from connect.unusable import Ended

Say = Callable[[str], None]
Ask = Callable[[str], Awaitable[str]]


async def before_flight(rest: Rest, drone: Chosen, *, acknowledge: bool, say: Say, ask: Ask) -> None:
    """Reports what would be dangerous. With `acknowledge`, asks and sends the answer to the tower; raises Ended on a
    no."""
    path = f"/drones/{drone.drone_id}/loss-check"
    answer = await rest.ask("GET", path)
    if not answer.done:
        raise Ended(f"the loss check of {drone.name} cannot be read: {answer.words}")
    check = answer.body
    if check["acknowledged"] or not check["dangerous"]:
        return
    for sentence in check["sentences"]:
        if acknowledge or sentence["severity"] == "danger":
            say(f"{sentence['severity']}: if the {sentence['about']} is lost: {sentence['text']}")
    if not acknowledge:
        say(
            f"{drone.name} cannot be armed until this is acknowledged: in the console, or with --acknowledge-loss-check"
        )
        return
    if await ask(f"Type the drone's name, {drone.name}, if you know this and want to fly it as it is:") != drone.name:
        raise Ended("the loss check was not acknowledged: --acknowledge-loss-check needs the drone's name, typed")
    answer = await rest.ask("POST", f"{path}/acknowledge", {"drone": drone.name})
    if not answer.done:
        raise Ended(f"the loss check was not acknowledged: {answer.words}")
    say("the loss check is acknowledged")
