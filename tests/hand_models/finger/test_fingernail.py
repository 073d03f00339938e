"""The fingernail: where it hooks, what it pulls with, what holds it, and plans that hang on it."""

from __future__ import annotations

import math
from dataclasses import replace

import msgspec
import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy.optimize import linprog

from hand_models import (
    FINGERS,
    Cylinder,
    Edge,
    Grasp,
    InvalidInputError,
    Mesh,
    Plane,
    Pose,
    Profile,
    SettledHand,
)
from hand_models.base import wrench_transport
from hand_models.fixed_wrist import wrench_space
from hand_models.hand import closing_sequence
from hand_models.rock import Hold
from planner.explanation import warnings
from planner.pictures import plot_plan, plot_wrench_space
from planner.prepare import HandBatch, settle_hand
from planner.question import Question
from planner.result import Plan
from planner.solving import plan
from service.answering import dispatch, questions
from service.commands.stances import read_request
from service.replies import PlanReply
from service.wire import Format, schema
from tests.suite.helpers.checks import problems
from tests.suite.helpers.fingernails import PIN, STRONG, hung, nail_rows, one_hand, step
from tests.suite.helpers.hands import HAND, ROCK, changed_hand, pinch, without_hand_load
from tests.suite.helpers.requests import HEAVY, JSON, MSGPACK, at, put, wall_request
from tests.suite.helpers.shares import given_some

JOINT = -0.0006
"""z of the joints in H [m]."""

LENGTH, RADIUS, STIFFNESS, FRICTION = 0.010, 0.0075, 0.025, 0.5


def cling(hold: Hold, x: float, z: float = 0.006, hand=HAND, **grasp) -> SettledHand:
    """A hand that clings to a hold whose frame is at (x, z) of H."""
    pose = Pose(np.array([x, 0.0, z]), np.eye(3))
    return hand.settle(hold, ROCK, Grasp(fingernail=True, **grasp), pose)


def contacts(settled: SettledHand) -> list[str]:
    return [settled.tiles[i].contact for i in nail_rows(settled)]


# Where it hooks -----------------------------------------------------------------------------------


def test_a_tip_hooks_behind_a_wall_that_its_pin_has_passed():
    settled = cling(step(0.02), PIN["inner"] - 0.002)
    assert contacts(settled) == ["nail"] * 4
    for i, row in enumerate(nail_rows(settled)):
        past = PIN[FINGERS[i].split("_")[0]] - PIN["inner"] + 0.002
        assert settled.nail_angles[i] == pytest.approx(math.pi / 2 + math.asin(past / LENGTH))
        depth = math.sqrt(LENGTH**2 - past**2)
        place = [PIN["inner"] - 0.002, settled.positions[row, 1], JOINT + depth]
        np.testing.assert_allclose(settled.positions[row], place, atol=1e-12)
        np.testing.assert_allclose(settled.nail_normals[i], [1.0, 0.0, 0.0], atol=1e-12)


def test_a_flank_rests_on_a_corner_that_its_pin_has_not_reached():
    settled = cling(step(0.02), PIN["inner"] + 0.005)
    i, row = FINGERS.index("inner_left"), nail_rows(settled)[1]
    angle = math.atan2(0.006 - JOINT, 0.005)
    assert settled.nail_angles[i] == pytest.approx(angle)
    np.testing.assert_allclose(
        settled.positions[row], [PIN["inner"] + 0.005, 0.0165, 0.006], atol=1e-12
    )
    np.testing.assert_allclose(
        settled.nail_normals[i], [math.sin(angle), 0.0, -math.cos(angle)], atol=1e-12
    )


def test_a_step_of_three_millimetres_is_hooked_and_no_palm_or_tile_touches():
    settled = cling(step(0.003), 0.2, 0.0055)
    assert contacts(settled) == ["nail"] * 4
    assert not settled.touching.any()
    assert not settled.palm.engaged
    for finger in settled.fingers:
        assert not finger.joint_angles.any()
    np.testing.assert_allclose(
        settled.positions[nail_rows(settled)][:, [0, 2]], [[0.2, 0.0055]] * 4
    )


def test_smoothing_is_for_tiles_and_not_for_nails():
    hold = step(0.003)
    axes = np.eye(3)[[0, 2]]
    raw, smooth = hold.raw_section(np.zeros(3), *axes), hold.section(np.zeros(3), *axes)
    outline = hold.outlines[0][1:3].tolist()
    assert [raw.clearance(tuple(point)) for point in outline] == pytest.approx([0.0, 0.0])
    # the step's foot is lost to a tile
    assert smooth.clearance((0.0, 0.003)) < -0.0005
    # analytic holds have nothing to smooth
    assert Plane().raw_section([0.0, 0.0, -0.01], *axes).clearance((0.0, 0.0)) == 0.01


def test_a_nail_meets_a_step_of_triangles_as_it_meets_a_drawn_one():
    outline = np.array([[-0.25, 0.0], [0.0, 0.0], [0.0, 0.003], [0.2, 0.003]])
    vertices = [[x, y, z] for x, z in outline for y in (-0.1, 0.1)]
    faces = [face for i in (0, 2, 4) for face in ([i, i + 1, i + 2], [i + 1, i + 3, i + 2])]
    drawn, meshed = (cling(hold, 0.2, 0.0055) for hold in (Profile(outline), Mesh(vertices, faces)))
    assert contacts(meshed) == ["nail"] * 4
    np.testing.assert_allclose(meshed.nail_angles, drawn.nail_angles, atol=1e-9)
    np.testing.assert_allclose(meshed.positions, drawn.positions, atol=1e-9)
    np.testing.assert_allclose(meshed.nail_normals, drawn.nail_normals, atol=1e-9)


def test_an_edge_is_hooked_on_the_face_that_it_turns_away():
    """A square edge, rock on the palm's side of x = 193 mm; its fillet rounds the corner alone."""
    fillet, corner = 0.0005, np.array([0.193, 0.0, 0.006])
    half = math.sqrt(0.5)
    into = np.array([-half, 0.0, half])
    axes = np.column_stack([np.cross([0.0, 1.0, 0.0], into), [0.0, 1.0, 0.0], into])
    crest = corner + fillet * (1.0 - half) * np.array([-1.0, 0.0, 1.0])
    settled = HAND.settle(
        Edge(fillet, math.pi / 2), ROCK, Grasp(fingernail=True), Pose(crest, axes)
    )
    past = np.array([PIN[name.split("_")[0]] - corner[0] for name in FINGERS])
    np.testing.assert_allclose(settled.nail_angles, math.pi / 2 + np.arcsin(past / LENGTH))
    np.testing.assert_allclose(settled.nail_normals, [[1.0, 0.0, 0.0]] * 4, atol=1e-6)


def test_on_flat_rock_the_tip_stands_on_it():
    settled = HAND.settle(Plane(), ROCK, Grasp(fingernail=True))
    # seated, the tiles' faces lie on the rock: 4.7 mm from the joints
    np.testing.assert_allclose(settled.nail_angles, math.asin(0.0047 / LENGTH))
    np.testing.assert_allclose(settled.nail_normals, [[0.0, 0.0, -1.0]] * 4, atol=1e-12)
    assert not settled.touching.any()
    # the palm still works beside them
    assert settled.palm.engaged == tuple(range(8))
    assert {"palm_shear", "palm_pressing"} < set(wrench_space(settled).columns)


def test_without_rock_a_nail_turns_by_half_a_turn_and_carries_nothing():
    settled = cling(Plane(), 0.0, 0.02)
    assert contacts(settled) == ["none"] * 4
    np.testing.assert_allclose(settled.nail_angles, math.pi)
    # 0.025 N·m/rad over π rad, on 7.5 mm
    assert closing_sequence(settled)[0].stages[0].ends == pytest.approx(10.47, abs=0.01)
    space = wrench_space(settled)
    assert not any("nail" in name for name in space.columns)
    assert not np.abs(space.generators).any()
    assert space.rows[0].limit == "tendon_tension"


def test_a_tension_too_low_to_turn_the_nail_does_not_hook_it():
    """Nor one that turns the nail, but moves its finger's joints more.

    About a joint, D from the pin, the rock's reaction to P opens with P (c + D cos ψ), and to A,
    which friction allows up to P / 2, with A D sin ψ.
    """
    angle, c = math.atan2(0.0066, 0.005), math.hypot(0.0066, 0.005)
    spring, needed = STIFFNESS * angle, 0.0
    for D, radius in ((0.1293, 0.0055), (0.0862, 0.003195), (0.0431, 0.001945)):
        opening = (c + D * math.cos(angle) + FRICTION * D * math.sin(angle)) / c
        # (7.5 mm f − spring) opening = radius f
        needed = max(needed, spring * opening / (RADIUS * opening - radius))
    hold, x = step(0.02), PIN["outer"] + 0.005
    for tension, expected in ((0.999 * needed, "none"), (1.001 * needed, "nail")):
        assert contacts(cling(hold, x, closing_tension=tension))[0] == expected


def test_a_nail_that_would_let_its_finger_curl_does_not_hook():
    """Its flank, turned past 90° under an edge, lifts off the rock unless friction holds it."""
    hold, x = Profile([[-0.3, 0.0], [0.0, 0.0], [-0.02, 0.02], [0.3, 0.02]]), PIN["inner"] - 0.002
    smooth = changed_hand("nail", "friction", 0.0)
    assert contacts(cling(hold, x, hand=smooth)) == ["none"] * 4
    assert contacts(cling(hold, x)) == ["nail"] * 4


def test_rock_in_a_straight_finger_or_before_its_nail_is_refused():
    for x, z, words in [
        (0.3, 0.004, "straight, to cling with its nail"),
        (0.205, 0.006, "in the way of the nail of outer_left"),
    ]:
        hold = (
            step(0.02)
            if x == 0.3
            else Profile([[-0.3, 0.0], [0.0, 0.0], [0.0, -0.05], [0.3, -0.05]])
        )
        with pytest.raises(InvalidInputError, match=words) as caught:
            cling(hold, x, z)
        assert caught.value.field == "hold"


def test_fingers_that_close_are_not_touched_by_the_nails():
    settled = pinch()
    assert not settled.nails.any()
    assert not any(tile.phalanx == "nail" for tile in settled.tiles)
    np.testing.assert_allclose(settled.nail_angles, math.pi)


def test_an_impossible_nail_is_refused_by_name():
    for name in ["length", "pulley_radius", "retraction"]:
        for value in (0.0, -1.0, math.nan):
            with pytest.raises(InvalidInputError) as caught:
                changed_hand("nail", name, value)
            assert caught.value.field == f"nail.{name}"
        with pytest.raises(InvalidInputError, match="at least 0"):
            changed_hand("nail", "friction", -0.1)


# What it pulls with, and what holds it ------------------------------------------------------------


def test_the_tendon_balances_the_rock_about_the_pin():
    """f = 200 N on 7.5 mm, the spring, and the rock at the tip, 10 mm from the pin."""
    settled = cling(step(0.02), PIN["inner"] - 0.002)
    angle = math.pi / 2 + math.asin(0.2)
    turning = (200.0 * RADIUS - STIFFNESS * angle) / LENGTH
    assert turning == pytest.approx(145.57, abs=0.01)
    along = 30.0
    loads = settled.tile_loads(np.full(4, 200.0), axials=np.full(4, along))
    forces = np.einsum("tk,tkx->tx", loads, settled.axes)
    for i in (1, 2):
        force = forces[nail_rows(settled)[i]]
        w = np.array([math.cos(angle), 0.0, math.sin(angle)])
        v = np.array([-math.sin(angle), 0.0, math.cos(angle)])
        np.testing.assert_allclose(force, turning * v - along * w, atol=1e-9)
    assert not loads[~settled.nails].any()


def fingers_lp(settled: SettledHand, index: int, direction: np.ndarray):
    """The most that one nail's force and moment can do in a direction, from first principles.

    Unknown are the tension and the force (F_x, F_z) on the rock. Returned are the greatest
    direction · wrench, and the wrench.
    """
    name, row = FINGERS[index], nail_rows(settled)[index]
    model, place, n = HAND.finger, settled.positions[row], settled.nail_normals[index]
    pin = np.array([PIN[name.split("_")[0]], place[1], JOINT])
    pivots = pin - np.outer([0, 3, 2, 1], [0.0431, 0.0, 0.0])
    units = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    # moments of the rock on the finger, from x toward z, about the pin and about the joints
    about = [np.cross(place - pivot, -units) @ [0.0, -1.0, 0.0] for pivot in pivots]
    side = np.cross(n, [0.0, 1.0, 0.0])
    A = [
        [0.0, *(units @ (FRICTION * n + side))],
        [0.0, *(units @ (FRICTION * n - side))],
        *([radius, *arm] for radius, arm in zip(model.pulley_radii, about[1:], strict=True)),
        [0.0, -1.0, 0.0],
        [0.0, 0.0, 1.0],
    ]
    b = [0.0] * 5 + [500.0, 600.0]
    angle = settled.nail_angles[index]
    gain = np.concatenate([units, np.cross(place, units)], axis=1).T
    drive = HAND.drive
    current = drive.maximum_current - drive.no_load_current
    most = min(
        700.0,
        drive.maximum_torque / drive.torque_per_newton,
        current / drive.current_per_newton,
    )
    found = linprog(
        [0.0, *(-direction @ gain)],
        A_ub=A,
        b_ub=b,
        A_eq=[[RADIUS, *about[0]]],
        b_eq=[STIFFNESS * angle],
        bounds=[(0.0, most), (None, None), (None, None)],
    )
    assert found.status == 0
    return -found.fun, gain @ found.x[1:]


SCENES = st.one_of(
    st.tuples(st.just(0.02), st.floats(-0.008, 0.006), st.just(0.006)),
    st.tuples(st.floats(0.002, 0.006), st.floats(-0.004, 0.008), st.floats(0.0055, 0.008)),
)


@given_some(8, 40, scene=SCENES, seed=st.integers(0, 10**6))
def test_what_four_nails_carry_is_what_each_finger_carries_by_hand(scene, seed):
    deep, ahead, z = scene
    settled = cling(step(deep), PIN["inner"] + ahead, z, palm=False)
    if contacts(settled) != ["nail"] * 4:
        return
    space = without_hand_load(wrench_space(settled))
    direction = np.random.default_rng(seed).normal(size=6) * [1.0, 1.0, 1.0, 10.0, 10.0, 10.0]
    # no nail holds sideways
    byhand = sum(fingers_lp(settled, i, direction)[0] for i in range(4))
    assert space.support(direction) == pytest.approx(byhand, rel=1e-6, abs=1e-3)


def test_five_hundred_newtons_is_what_a_finger_pulls():
    settled = cling(step(0.02), PIN["inner"] + 0.001)
    pull = np.array([-1.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    whole = without_hand_load(wrench_space(settled))
    assert whole.support(pull) == pytest.approx(2000.0, rel=1e-6)
    assert wrench_space(settled).support(pull) == pytest.approx(475.22, abs=0.01)
    limits = [row.limit for row in whole.rows]
    assert limits.count("nail_shear") == limits.count("fingertip_force") == 4


def test_a_straight_finger_pulls_like_a_rope_and_hardly_off_the_rock():
    """Off the rock its joints would let it follow: its force passes the first joint on rock's side.

    With the tip 10 mm below the joints and 139 mm from the first, a rope would pull off with 7 % of
    what it pulls; the tendon's moment about that joint, 5.5 mm on 7.5 mm of nail, takes more.
    """
    settled = cling(step(0.02), PIN["inner"] + 0.001)
    for i in range(4):
        best, wrench = fingers_lp(settled, i, np.array([0.0, 0.0, -1.0, 0.0, 0.0, 0.0]))
        assert best < 0.07 * 500.0
        assert wrench[2] >= 0.07 * wrench[0]


def test_friction_in_the_tendon_leaves_the_nail_less():
    sliding = changed_hand("tendon", "friction", 0.1)
    free, lossy = (cling(step(0.02), PIN["inner"] - 0.002, hand=hand) for hand in (HAND, sliding))
    for i, row in enumerate(nail_rows(free)):
        pulleys = 4 if FINGERS[i].startswith("outer") else 3
        assert lossy.loads[row, 1, 1] == pytest.approx(0.9**pulleys * free.loads[row, 1, 1])
        assert lossy.loads[row, 1, 0] == free.loads[row, 1, 0]
    sticking = [row for row in wrench_space(lossy).rows if row.limit == "tendon_sticks"]
    assert [row.finger for row in sticking] == list(FINGERS)


@given(
    tension=st.floats(5.0, 700.0),
    axial=st.floats(-300.0, 300.0),
    ahead=st.floats(-0.008, 0.008),
)
def test_the_set_gives_the_wrench_of_the_nails_forces(tension, axial, ahead):
    settled = cling(step(0.02), PIN["inner"] + ahead)
    space = wrench_space(settled)
    y = np.zeros(len(space.columns))
    tensions, axials = np.zeros(4), np.zeros(4)
    for i, finger in enumerate(FINGERS):
        if f"{finger}/nail" in space.columns:
            tensions[i], axials[i] = tension, axial
            y[space.columns.index(f"{finger}/tension")] = tension
            y[space.columns.index(f"{finger}/nail")] = axial
    loads = settled.tile_loads(tensions, axials=axials)
    forces = np.einsum("tk,tkx->tx", loads, settled.axes)
    moments = np.cross(settled.positions, forces)
    np.testing.assert_allclose(
        space.wrench(y), np.concatenate([forces.sum(axis=0), moments.sum(axis=0)]), atol=1e-9
    )


# Plans --------------------------------------------------------------------------------------------


def test_a_hand_is_as_strong_as_its_nails():
    for pull, status in [(1000.0, "optimal"), (2200.0, "overloaded")]:
        answer = plan(hung(one_hand(STRONG), pull))
        assert (answer.status, answer.verified) == (status, True)
        assert answer.utilisation == pytest.approx(pull / 4.0 / 500.0, rel=0.02)
        if status == "overloaded":
            assert (answer.limiting.limit, answer.limiting.phalanx) == ("nail_shear", "nail")
            assert "nail of " in answer.reason
            assert "of 500 N along its finger" in answer.reason


def test_a_hand_that_holds_less_than_its_nails_names_itself():
    answer = plan(hung(one_hand(), 600.0))
    assert (answer.status, answer.limiting.limit) == ("overloaded", "hand_load")


def test_nails_pull_nothing_off_the_rock():
    stance = one_hand()
    wrench = wrench_transport(stance.body.inverse() @ stance.hands[0].pose) @ np.array(
        [-100.0, 0.0, -60.0, 0.0, 0.0, 0.0]
    )
    answer = plan(Question(stance, body_wrench=-wrench))
    assert answer.status == "infeasible"
    blocking = {(name.phalanx, name.limit) for name in answer.certificate.blocking}
    assert blocking & {("proximal", "joint_stop"), ("nail", "nail_slips"), ("nail", "nail_lifts")}


NUMBERS = {
    "shear": ("loads", 0),
    "normal": ("loads", 1),
    "force": ("forces", ...),
    "utilisation": ("tile_utilisations", ...),
}
"""Where a plan has the numbers of a tile."""


def spoilt(answer: Plan, finger: str = "inner_left", **changes) -> Plan:
    """The plan with other numbers of a finger's nail, or of its tendon."""
    hand = answer.hands[0]
    row = hand.tile(finger, "nail")
    for key, value in changes.items():
        if key == "tension":
            name, place = "tensions", FINGERS.index(finger)
        elif key == "contact":
            tiles = list(hand.tiles)
            tiles[row] = tiles[row]._replace(contact=value)
            hand = replace(hand, tiles=tuple(tiles))
            continue
        else:
            name, place = NUMBERS[key][0], (row, NUMBERS[key][1])
        numbers = getattr(hand, name).copy()
        numbers[place] = value
        hand = replace(hand, **{name: numbers})
    return replace(answer, hands=(hand,))


def complaints(answer: Plan, question: Question) -> str:
    return "; ".join(problems(question, answer))


def test_a_tampered_nail_is_caught():
    question = hung(one_hand(), 400.0)
    answer = plan(question)
    assert complaints(answer, question) == ""
    finger = answer.hands[0].fingers[1]
    nail = finger.tiles[-1]
    whole, along, out = (np.array(v) for v in (nail.force, nail.shear_axis, nail.normal_axis))

    def pushed(shear: float = 0.0, normal: float = 0.0) -> dict[str, object]:
        """Loads changed, and the force with them."""
        force = whole + shear * along + normal * out
        return {"shear": nail.shear + shear, "normal": nail.normal + normal, "force": force}

    for changes, words in (
        ({"force": whole + 0.1}, "nail of inner_left: force and loads disagree"),
        ({"force": whole * np.nan}, "force and loads disagree"),
        (pushed(normal=1.0), "out of balance"),
        (pushed(shear=200.0), "would slip"),
        (pushed(shear=200.0), "lets a joint of its finger close, by 8.09 N·m"),
        ({"contact": "none"}, "carries a load but touches nothing"),
        ({"utilisation": 0.5 * nail.utilisation}, "utilisation is"),
        ({"tension": finger.tendon_tension + 1.0}, "out of balance"),
    ):
        assert words in complaints(spoilt(answer, **changes), question), words


def test_a_nail_that_touches_nothing_may_carry_nothing():
    """Rock of two depths: the left fingers find an edge, the right ones none."""
    near, far = ([[-0.3, z], [0.0, z], [0.0, 0.03], [0.3, 0.03]] for z in (0.0, 0.015))
    sides = {name: near if name.endswith("left") else far for name in FINGERS}
    stance = one_hand(hold=Profile(sides))
    settled = settle_hand(stance.hands[0], stance)
    assert contacts(settled) == ["nail", "nail", "none", "none"]
    assert "front_left: 2 of 4 nails hook" in warnings(stance, HandBatch.of([settled]))
    force = np.array([-100.0, 0.0, 5.0])
    wrench = np.zeros(6)
    for row in nail_rows(settled)[:2]:
        wrench += np.concatenate([force, np.cross(settled.positions[row], force)])
    carried = wrench_transport(stance.body.inverse() @ stance.hands[0].pose) @ -wrench
    question = Question(stance, body_wrench=carried)
    answer = plan(question)
    assert (answer.status, answer.verified) == ("optimal", True)
    idle = answer.hands[0].fingers[3].tiles[-1]
    assert (idle.contact, idle.utilisation) == ("none", 0.0)
    assert not any(idle.force)
    tampered = spoilt(answer, "outer_right", force=-np.array(idle.normal_axis), normal=-1.0)
    assert "nail of outer_right carries a load but touches nothing" in complaints(
        tampered, question
    )


def test_a_winch_draws_in_its_nail_too():
    question = hung(one_hand(), 400.0)
    settled = settle_hand(question.stance.hands[0], question.stance)
    for i, finger in enumerate(plan(question).hands[0].fingers):
        tiles = 4 if finger.name.startswith("outer") else 3
        # free tiles slide on their springs: 2 · 2 f / 11.5 N/mm each; the joints stay straight
        drawn = RADIUS * settled.nail_angles[i] + 4.0 * tiles * finger.tendon_tension / 11500.0
        assert finger.winch_angle == pytest.approx(drawn / 0.0067, rel=1e-9)


# The service and pictures -------------------------------------------------------------------------


def test_the_bundled_ledge_is_planned_and_its_nails_carry():
    answer = plan(questions.question(read_request("ledge")))
    assert (answer.status, answer.verified) == ("optimal", True)
    for hand in answer.hands:
        clings = hand.limb.startswith("rear")
        phalanges = [tile.phalanx for finger in hand.fingers for tile in finger.tiles]
        assert phalanges.count("nail") == (4 if clings else 0)
        if clings:
            # trodden on: pressed, and with no palm on the rock
            assert hand.wrench[0] < -300.0
            assert hand.wrench[2] > 0.0
            assert not hand.palm.engaged


@pytest.mark.parametrize("form", [JSON, MSGPACK])
def test_clinging_travels(form):
    path = ("stance", "hands", 1)
    request = wall_request(HEAVY)
    ledge = msgspec.to_builtins(read_request("ledge"))
    request = put(request, (*path, "grasp"), {"fingernail": True})
    request = put(request, (*path, "hold"), at(ledge, (*path, "hold")))
    assert at(ledge, (*path, "grasp"))["fingernail"] is True
    encode = msgspec.msgpack.encode if "msgpack" in form else msgspec.json.encode
    answer = dispatch.handle("crux/robosimian/plan", encode(request), form)
    assert answer.good
    reply = Format.named(answer.encoding).decode(answer.payload, PlanReply)
    assert reply.verified
    for finger in reply.hands[1].fingers:
        *_, tile = finger.tiles
        assert (tile.phalanx, tile.contact) == ("nail", "nail")
    for odd in ("yes", 1, None):
        spoilt_request = put(request, (*path, "grasp", "fingernail"), odd)
        assert not dispatch.handle("crux/robosimian/plan", encode(spoilt_request), form).good


def test_the_schema_tells_of_the_nail():
    text = msgspec.json.encode(schema()).decode()
    assert "clinging with their nails alone" in text


@pytest.mark.slow
@pytest.mark.parametrize("hold", [step(0.02), Plane(), Cylinder(0.2)])
def test_a_clinging_hand_is_drawn_whether_its_nails_hook_or_not(hold, tmp_path):
    settled = cling(hold, 0.195 if isinstance(hold, Profile) else 0.0, 0.006)
    space = wrench_space(settled)
    path = tmp_path / "hand.png"
    plot_wrench_space(settled, space if isinstance(hold, Profile) else None, path, "a hand")
    assert path.stat().st_size > 10_000


@pytest.mark.parametrize("hooked", [True, False])
def test_a_plan_of_a_clinging_hand_is_drawn_too(hooked, tmp_path):
    stance = one_hand()
    question = hung(stance, 300.0) if hooked else Question(stance, body_wrench=np.zeros(6))
    if not hooked:
        away = Pose(np.array([0.0, 0.0, 0.03]), np.eye(3))
        hands = (replace(stance.hands[0], hold_in_hand=away),)
        question = replace(question, stance=replace(stance, hands=hands))
    answer = plan(question)
    assert (answer.status, answer.verified) == ("optimal", True)
    path = tmp_path / "plan.png"
    plot_plan(answer, question, path)
    assert path.stat().st_size > 10_000
