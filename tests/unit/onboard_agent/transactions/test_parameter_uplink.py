"""Which parameter values go up to the tower as frames while the agent reads them all."""

from drone_world import DroneWorld

from onboard_agent.transactions.parameter_files import ParameterFiles
from onboard_agent.transactions.parameter_handler import ParameterHandler
from wire.dialect import mavlink
from wire.transactions import ParameterCache


def names_seen(drone: DroneWorld) -> set[str]:
    return {message.param_id for message in drone.seen if message.get_type() == "PARAM_VALUE"}


def read_by_the_agent(drone: DroneWorld) -> bool:
    return any(isinstance(reported, ParameterCache) and reported.hash is not None for reported in drone.reported)


def drone_that_is_read() -> DroneWorld:
    drone = DroneWorld(make_handlers=lambda maker: [ParameterHandler(maker, ParameterFiles(None))])
    drone.until(
        lambda: any(isinstance(reported, ParameterCache) for reported in drone.reported),
        what="the agent begins to read",
    )
    return drone


def test_the_agents_own_reading_is_kept_off_the_uplink() -> None:
    drone = drone_that_is_read()
    drone.until(lambda: read_by_the_agent(drone), what="all are read")
    assert len(names_seen(drone)) < 100


def test_a_ground_station_that_reads_at_the_same_time_misses_nothing() -> None:
    drone = drone_that_is_read()
    drone.tower_sends(mavlink.MAVLink_param_request_list_message(1, 1))
    drone.until(lambda: read_by_the_agent(drone), what="all are read")
    drone.run(3.0)
    assert len(names_seen(drone)) > 1300
