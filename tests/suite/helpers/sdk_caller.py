"""Call a service and take a topic with zenoh-ros2-sdk, offline, for a test.

Usage: ``python sdk_caller.py FOLDER PORT DOMAIN``, with a folder of definitions; the plan's request
is standard input. Prints what came as JSON.
"""

from __future__ import annotations

import json
import queue
import sys

from zenoh_ros2_sdk import ROS2ServiceClient, ROS2Subscriber
from zenoh_ros2_sdk.message_registry import get_registry
from zenoh_ros2_sdk.session import ZenohSession

NODE = "/crux/robosimian"


def main(folder: str, port: int, domain: int) -> None:
    """Call the service ``plan``, and take the diagnostics."""
    # the one session of the process, and the definitions that no network is asked for
    ZenohSession.get_instance("127.0.0.1", port)
    registry = get_registry(folder)
    where = {"domain_id": domain, "router_ip": "127.0.0.1", "router_port": port}
    got: queue.Queue = queue.Queue()
    states = ROS2Subscriber(
        "/diagnostics", "diagnostic_msgs/msg/DiagnosticArray", callback=got.put, **where
    )
    for kind in ("sensor_msgs/msg/JointState", "geometry_msgs/msg/WrenchStamped"):
        registry.load_message_type(kind)
    registry.load_message_type("crux_msgs/msg/Error")
    request, response = (
        (registry.messages_dir / "crux_msgs/srv/Plan.srv").read_text().split("\n---\n")
    )
    client = ROS2ServiceClient(
        f"{NODE}/plan",
        "crux_msgs/srv/Plan",
        request_definition=request,
        response_definition=response,
        timeout=60.0,
        **where,
    )
    answer = client.call(request=sys.stdin.read())
    told = {
        "hash": client.type_hash,
        "status": answer.status,
        "error": answer.error.kind,
        "utilisation": answer.utilisation,
        "tensions": answer.set_points.effort.tolist(),
        "frames": [each.header.frame_id for each in answer.wrenches],
        "states": [each.name for each in got.get(timeout=60.0).status],
    }
    client.close()
    states.close()
    print(json.dumps(told))


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]))
