"""The node through a router, by a client of the convention that others have made."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path

import msgspec
import pytest

from service.answering import answer_plan
from service.ros2.definitions import RosTypes, package_folder
from service.serving import open_session, zenoh_config
from tests.suite.helpers.checkout import ROOT
from tests.suite.helpers.patience import PATIENCE
from tests.suite.helpers.requests import plan_request, wall_request
from tests.suite.helpers.ros_peer import DEFINITIONS
from tests.suite.helpers.served import Served, free_endpoint

pytest.importorskip("zenoh_ros2_sdk")

CALLER = ROOT / "tests" / "suite" / "helpers" / "sdk_caller.py"
DOMAIN = "6"


@pytest.mark.slow
def test_another_client_calls_the_service_and_hears_the_topic(tmp_path: Path) -> None:
    # given by hand: no network is asked
    for name, text in DEFINITIONS.items():
        file = tmp_path / f"{name}.msg"
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
    shutil.copytree(package_folder(), tmp_path / "crux_msgs")
    router, request = free_endpoint(), wall_request()
    with open_session(zenoh_config(mode="router", listen=[router], multicast=False)):
        flags = ["--workers", "1", "--ros2", "--domain", DOMAIN, "-e", router]
        server = Served(free_endpoint(), *flags)
        try:
            port = router.rpartition(":")[2]
            done = subprocess.run(
                [sys.executable, str(CALLER), str(tmp_path), port, DOMAIN],
                input=msgspec.json.encode(request),
                capture_output=True,
                timeout=PATIENCE,
                check=True,
            )
        finally:
            server.process.kill()
            server.process.communicate()
    told = json.loads(done.stdout)
    # it has computed the hash by itself
    assert told["hash"] == RosTypes().type_hash("crux_msgs/srv/Plan")
    assert (told["error"], told["status"]) == ("", "optimal")
    expected = answer_plan(plan_request(request))
    assert told["utilisation"] == pytest.approx(expected.utilisation, rel=1e-9)
    planned = [f.tendon_tension for hand in expected.hands for f in hand.fingers]
    assert told["tensions"] == pytest.approx(planned, rel=1e-6)
    assert told["frames"] == [f"{hand.limb}/H" for hand in expected.hands]
    assert "crux/robosimian: set-points" in told["states"]
