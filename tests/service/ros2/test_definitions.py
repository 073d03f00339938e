"""Types of ROS 2: hashes against published ones and against another computation, CDR, names."""

from __future__ import annotations

import re
import sys
import tomllib
from itertools import pairwise
from xml.etree import ElementTree

import pytest
from rosbags.typesys import Stores, get_typestore

from hand_models.base import InvalidInputError
from service.ros2 import definitions, names, ros_domain
from service.wire import MalformedError
from tests.suite.helpers.checkout import ROOT
from tests.suite.helpers.ros_peer import DEFINITIONS, RosPeer

PACKAGE = definitions.package_folder()
SERVICES = ("Plan", "SetPoints", "Stream", "WrenchSpace")

PUBLISHED_MESSAGES = {
    "std_msgs/msg/String": "df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18",
    "sensor_msgs/msg/JointState": (
        "a13ee3a330e346c9d87b5aa18d24e11690752bd33a0350f11c5882bc9179260e"
    ),
    "geometry_msgs/msg/WrenchStamped": (
        "8dc3deaf06b2ab281f9f9a742a8961c328ca7cec16e3fd6586d3a5c83fa78f77"
    ),
    "diagnostic_msgs/msg/KeyValue": (
        "d68081eaa540288c5440753baecef0c4e16e81a5f78ad68902ded5100413bb42"
    ),
    "diagnostic_msgs/msg/DiagnosticArray": (
        "5a8a36efb05fb25070fa0fb3810290c0e6cd4862b54a8fb975a1ee8dc55a333e"
    ),
}
"""Hashes as ``ros2 topic info --verbose`` and clients of rmw_zenoh publish them."""

PUBLISHED_ACTION = {
    "example_interfaces/action/Fibonacci_SendGoal": (
        "d1a57fb2a4afe8c21e34fb10db206f16ce6729b28531141472df92277c55b557"
    ),
    "example_interfaces/action/Fibonacci_SendGoal_Request": (
        "3d088942b413247db536576f0286768c6be8fcd5d0c9a5d544f359fba090a238"
    ),
    "example_interfaces/action/Fibonacci_GetResult": (
        "1b0de0d5d29dc955d92f546706568428632771db13ec84c15ec1c1a59f424a57"
    ),
    "example_interfaces/action/Fibonacci_FeedbackMessage": (
        "c1de71afd52e49a89c53d8262366884185bc0a02f78ce051c4e46b0a7fe59bb2"
    ),
    "action_msgs/srv/CancelGoal": (
        "573d8b0a534451d7bc2ac8c5ffde8ac14b8593b7001175d0cd6516dcbeb8689a"
    ),
    "action_msgs/msg/GoalStatusArray": (
        "6c1684b00f177d37438febe6e709fc4e2b0d4248dca4854946f9ed8b30cda83e"
    ),
}
"""Hashes of what an action has, as the type descriptions of ROS 2 and several clients have them."""

PUBLISHED_SERVICES = {
    "example_interfaces/srv/AddTwoInts": (
        "int64 a\nint64 b\n---\nint64 sum",
        "e118de6bf5eeb66a2491b5bda11202e7b68f198d6f67922cf30364858239c81a",
    ),
    "std_srvs/srv/Trigger": (
        "---\nbool success\nstring message",
        "eeff2cd6fa5ad9d27cdf4dec64818317839b62f212a91e6b5304b634b2062c5f",
    ),
    "std_srvs/srv/SetBool": (
        "bool data\n---\nbool success\nstring message",
        "abe9e4bb6b41b40e6789712c00ec8871923e089af3f667a79992a428cff2da0a",
    ),
}
"""Definitions, and hashes as rmw_zenoh's design document and its clients publish them."""


@pytest.fixture(scope="module")
def types() -> definitions.RosTypes:
    return definitions.RosTypes()


@pytest.fixture(scope="module")
def peer() -> RosPeer:
    return RosPeer(PACKAGE)


@pytest.mark.parametrize("name", PUBLISHED_MESSAGES)
def test_a_message_has_the_published_hash(name: str, types: definitions.RosTypes) -> None:
    assert types.type_hash(name) == f"RIHS01_{PUBLISHED_MESSAGES[name]}"


@pytest.mark.parametrize("name", PUBLISHED_SERVICES)
def test_a_service_has_the_published_hash(name: str, peer: RosPeer) -> None:
    text, digest = PUBLISHED_SERVICES[name]
    store = get_typestore(Stores.ROS2_JAZZY)
    found = definitions.service_definitions(name, *text.split("---"))
    del store.fielddefs["service_msgs/msg/ServiceEventInfo"]
    store.register(found)
    assert store.hash_rihs01(name) == f"RIHS01_{digest}"
    # the other computation is right, too
    peer.add_service(name, text)
    assert peer.type_hash(name) == f"RIHS01_{digest}"


def test_an_action_has_the_published_hashes(peer: RosPeer) -> None:
    name, parts = "example_interfaces/action/Fibonacci", ("int32 order", *2 * ("int32[] sequence",))
    types = definitions.RosTypes(definitions.action_definitions(name, *parts))
    peer.add_action(name, "\n---\n".join(parts))
    for each, digest in PUBLISHED_ACTION.items():
        assert types.type_hash(each) == f"RIHS01_{digest}", each
        # the other computation is right, too
        assert peer.type_hash(each) == f"RIHS01_{digest}", each


def test_own_types_have_the_hashes_of_another_computation(
    types: definitions.RosTypes, peer: RosPeer
) -> None:
    own = [name for name in peer.fields if name.startswith("crux_msgs/")]
    assert {f"crux_msgs/srv/{name}" for name in SERVICES} <= {*own}
    assert "crux_msgs/action/Climb_GetResult" in own
    for name in own:
        assert types.type_hash(name) == peer.type_hash(name), name
    hashes = {types.type_hash(name) for name in own}
    assert len(hashes) == len(own)


def test_types_of_others_have_the_hashes_of_another_computation(
    types: definitions.RosTypes, peer: RosPeer
) -> None:
    for name in DEFINITIONS.keys() - {"service_msgs/msg/ServiceEventInfo"}:
        assert types.type_hash(name) == peer.type_hash(name), name


def test_what_is_left_out_of_a_message_is_zero_or_empty(
    types: definitions.RosTypes, peer: RosPeer
) -> None:
    marker = types.make("visualization_msgs/msg/Marker", ns="a", id=3)
    read = peer.decode("visualization_msgs/msg/Marker", types.encode(marker))
    assert (read["ns"], read["id"], read["points"], read["text"]) == ("a", 3, [], "")
    assert read["pose"]["orientation"] == dict.fromkeys("xyzw", 0.0)
    assert read["texture"]["data"] == b""
    goal = types.make("action_msgs/msg/GoalInfo")
    assert peer.decode("action_msgs/msg/GoalInfo", types.encode(goal))["goal_id"]["uuid"] == bytes(
        16
    )


def test_types_of_others_are_the_same_from_iron_to_lyrical() -> None:
    used = [
        *PUBLISHED_MESSAGES,
        "builtin_interfaces/msg/Time",
        "geometry_msgs/msg/Wrench",
        "visualization_msgs/msg/MarkerArray",
        "sensor_msgs/msg/PointCloud2",
        "action_msgs/msg/GoalStatusArray",
    ]
    stores = (Stores.ROS2_IRON, Stores.ROS2_JAZZY, Stores.ROS2_KILTED, Stores.ROS2_LYRICAL)
    found = [[get_typestore(store).hash_rihs01(name) for name in used] for store in stores]
    assert all(one == other for one, other in pairwise(found))


def test_the_package_builds_every_definition_and_depends_on_what_they_use() -> None:
    listed = re.findall(
        r'"((?:action|msg|srv)/\w+\.\w+)"', (PACKAGE / "CMakeLists.txt").read_text()
    )
    files = sorted(str(file.relative_to(PACKAGE)) for file in PACKAGE.glob("*/*.*"))
    assert listed == files
    about = ElementTree.parse(PACKAGE / "package.xml").getroot()
    assert about.findtext("name") == PACKAGE.name == "crux_msgs"
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    assert about.findtext("version") == project["version"]
    texts = "".join(file.read_text("utf-8") for file in PACKAGE.glob("*/*.*"))
    used = set(re.findall(r"^(\w+)/", texts, re.MULTILINE)) - {"crux_msgs"}
    # what every action needs
    assert {each.text for each in about.findall("depend")} == used | {"action_msgs"}


def test_cdr_is_what_another_codec_writes_and_reads(
    types: definitions.RosTypes, peer: RosPeer
) -> None:
    vector = {"x": 1.5, "y": -2.0, "z": 3e300}
    tile = {"limb": "front_left", "finger": "é", "phalanx": ""}
    message = {
        "stream": "abc",
        "body_wrench": {"force": vector, "torque": vector | {"z": 0.0}},
        "lost": [tile, tile | {"limb": "rear_left"}],
        "deadline": 0.25,
    }
    name = "crux_msgs/srv/SetPoints_Request"
    data = peer.encode(name, message)
    read = types.decode(data, name)
    assert read.lost[1].limb == "rear_left"
    assert read.lost[0].finger == "é"
    assert read.body_wrench.force.z == 3e300
    assert read.deadline == 0.25
    # what follows the last field is filled up
    assert types.encode(read)[: len(data)] == data
    assert peer.decode(name, types.encode(read)) == message


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"\x00\x01\x00\x00",
        b"\x00\x01\x00\x00\xff\xff\xff\xff",
        b"\x00\x01\x00\x00\x05\x00\x00\x00ab",
        b"\x00\x01\x00\x00\x02\x00\x00\x00\xff\x00",
        b'{"v": 1}',
    ],
)
def test_bytes_that_are_no_message_are_malformed(data: bytes, types: definitions.RosTypes) -> None:
    with pytest.raises(MalformedError, match="not the CDR of a crux_msgs/srv/Plan_Request"):
        types.decode(data, "crux_msgs/srv/Plan_Request")


def test_without_rosbags_the_error_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "rosbags.typesys", None)
    with pytest.raises(InvalidInputError, match=r"--ros2: needs rosbags.*\[ros2\]"):
        definitions.RosTypes()


def test_keys_are_those_of_the_design_document() -> None:
    _, digest = PUBLISHED_SERVICES["example_interfaces/srv/AddTwoInts"]
    service = names.Endpoint(
        "/add_two_ints", "example_interfaces/srv/AddTwoInts", f"RIHS01_{digest}"
    )
    node = names.NodeNames(2, "f9980ee0495eaafb3e38f0d19e2eae12", "robosimian")
    typed = f"example_interfaces::srv::dds_::AddTwoInts_/RIHS01_{digest}"
    assert node.key(service) == f"2/add_two_ints/{typed}"
    assert node.token(names.EndpointKind.SERVICE, service, 10) == (
        "@ros2_lv/2/f9980ee0495eaafb3e38f0d19e2eae12/0/10/SS/%/%crux/robosimian/%add_two_ints/"
        f"{typed}/::,10:,:,:,,"
    )
    assert node.node_token() == (
        "@ros2_lv/2/f9980ee0495eaafb3e38f0d19e2eae12/0/0/NN/%/%crux/robosimian"
    )


@pytest.mark.parametrize("robot", ["spot-2", "2legs", "a__b", "", "tall robot"])
def test_a_robots_name_must_be_one_of_ros(robot: str) -> None:
    with pytest.raises(InvalidInputError, match="is no name in ROS 2"):
        names.NodeNames(0, "ab", robot)


def test_an_attachment_is_read_as_it_is_written() -> None:
    data = b"\x05" + bytes(7) + b"\x00\x01" + bytes(6) + b"\x10" + bytes(range(16))
    read = names.Attachment.read(data)
    assert read == (5, 256, bytes(range(16)))
    assert read.encode() == data
    for wrong in (b"", data[:-1], data + b"\x00", data[:16] + b"\x0f" + data[17:]):
        with pytest.raises(InvalidInputError, match=f"attachment: {len(wrong)} bytes"):
            names.Attachment.read(wrong)


def test_the_domain_is_the_given_one_or_that_of_the_environment(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.delenv("ROS_DOMAIN_ID", raising=False)
    assert ros_domain(None) == 0
    monkeypatch.setenv("ROS_DOMAIN_ID", "42")
    assert ros_domain(None) == 42
    assert ros_domain(7) == 7
    for wrong in ("233", "-1", "seven"):
        monkeypatch.setenv("ROS_DOMAIN_ID", wrong)
        with pytest.raises(InvalidInputError, match=r"ROS_DOMAIN_ID: .* from 0 to 232"):
            ros_domain(None)
