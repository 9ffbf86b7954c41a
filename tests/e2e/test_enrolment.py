"""An admin enrols a drone: what is pasted on it brings it onto the map."""

import os
import shlex
import subprocess

from console_page import Somebody, signed_in
from playwright.sync_api import expect
from worlds.processes import BIN, CHECKOUT, World, free_udp_ports


def test_a_new_drone_appears_on_the_map_after_one_pasted_command(somebody_early: Somebody, quiet_world: World) -> None:
    admin = signed_in(somebody_early, "admin")
    [port] = free_udp_ports(1)
    admin.open("/#/admin/drones")
    admin.part("new-drone").click()
    admin.part("drone-name-field").fill("Osprey")
    admin.part("drone-save").click()
    admin.part("enrol-autopilot").fill(f"udpin:127.0.0.1:{port}")
    admin.part("enrol-begin").click()
    command = admin.part("enrol-command").inner_text()
    expect(admin.part("enrol-state")).to_have_attribute("data-value", "waiting")

    quiet_world.start("simulator", "tower-sim", "--boot-s", "1", "--out", f"udp:127.0.0.1:{port}")
    words = shlex.split(command)
    environment = {**os.environ, "TOWER_AGENT_TOKEN": str(quiet_world.token_file("Osprey"))}
    with (quiet_world.folder / "agent-Osprey.log").open("ab") as log:
        agent = subprocess.Popen(
            [str(BIN / words[0]), *words[1:]], stdout=log, stderr=subprocess.STDOUT, env=environment, cwd=CHECKOUT
        )
    try:
        expect(admin.part("enrol-state")).to_have_attribute("data-value", "seen")
        admin.part("enrol-close").click()
        expect(admin.part("drone-row").filter(has_text="Osprey")).to_contain_text("online")
        admin.open("/#/admin/enrolment")
        expect(admin.part("enrolment-row").first).to_have_attribute("data-state", "seen")
        admin.open("/")
        expect(admin.part("squad-row").filter(has_text="Osprey")).to_be_visible()
        admin.wait_for_frames()
        again = subprocess.run(
            [str(BIN / words[0]), *words[1:]],
            env={**environment, "TOWER_AGENT_TOKEN": str(quiet_world.folder / "second.token")},
            cwd=CHECKOUT,
            capture_output=True,
            text=True,
            check=False,
            timeout=60,
        )
        assert again.returncode == 2, "the token worked twice"
    finally:
        agent.terminate()
        agent.wait(10)
