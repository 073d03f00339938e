"""Plans that are executed as they are on displaced hands."""

from dataclasses import replace
from functools import cache, partial

import msgspec
import numpy as np
import pytest
import scipy

from hand_models.base import Array, InvalidInputError, Pose, turns_about
from hand_models.compliance import CompliantHand, CompliantWrist
from hand_models.hand import SettledHand
from planner.deadline import within
from planner.execution import LimbPull, equilibria, execute, find_open_loop
from planner.prepare import PreparedStance, prepare_stance, settle_hand, wrists_at
from planner.question import LimbStiffness, Limits, OpenLoopSettings, Question
from planner.result import HandPlan, OpenLoop, OpenLoopSample, Plan
from planner.solving import KnownStance, plan
from planner.solving.verified import execution_passes
from service.answering import questions
from service.commands.stances import read_request
from tests.planner.floating.test_compliant_plan import asked

SAME_USE = 1e-6
"""How far the utilisation at rest may be from the plan's: loads that balance to 1e-6 N."""

MIRRORED = np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0])
"""Signs of a twist's mirror image across the x-z plane."""


def executed(name: str = "wall-300", stiffness: float = 5000.0, **settings: float) -> Question:
    question, limb = asked(name), LimbStiffness(position=stiffness, angle=0.02 * stiffness)
    return replace(
        question,
        stance=replace(question.stance, limb_stiffness=limb),
        want=frozenset(["open_loop"]) if settings else frozenset(),
        open_loop=OpenLoopSettings(**settings) if settings else None,
    )


@cache
def planned(name: str = "wall-300") -> tuple[PreparedStance, Plan]:
    question = executed(name)
    return prepare_stance(question), plan(question)


def hands_of(answer: Plan) -> tuple[HandPlan, ...]:
    assert answer.hands is not None
    return answer.hands


def outcomes(displacements: Array, name: str = "wall-300") -> list[OpenLoopSample]:
    prepared, answer = planned(name)
    samples, refused, _ = execute(prepared, hands_of(answer), displacements)
    assert not refused
    return samples


def executed_again(**settings: float) -> OpenLoop:
    """The plan of `wall-300` over other displacements."""
    prepared, (_, answer) = prepare_stance(executed(**settings)), planned()
    found = find_open_loop(prepared, hands_of(answer), 0.0, partial(execution_passes, prepared))
    assert found is not None
    return found


def found_in(question: Question) -> tuple[Plan, OpenLoop]:
    answer = plan(question)
    assert answer.open_loop is not None
    return answer, answer.open_loop


def some(seed: int = 0, count: int = 1) -> Array:
    """Displacements of four hands within their ranges."""
    widths = np.array([2e-3, 2e-3, 2.5e-4, 3e-3, 3e-3, 2e-2])
    return np.random.default_rng(seed).uniform(-widths, widths, (count, 4, 6))


def test_without_displacement_the_equilibrium_is_the_plan() -> None:
    answer, found = found_in(executed(samples=2, position=0.0, height=0.0, tilt=0.0, yaw=0.0))
    for sample in found.samples:
        assert sample.found
        assert sample.utilisation == pytest.approx(answer.utilisation, abs=SAME_USE)
        assert sample.dragged == 0.0
        assert np.abs(sample.body_twist).max() < 1e-9  # [m, rad]
    assert (found.holds, found.dragged, found.without) == (1.0, 0, 0)
    assert found.tenth == found.median == found.ninetieth == found.samples[0].utilisation


def test_without_displacement_wrists_are_where_they_were_planned() -> None:
    prepared, answer = planned()
    plans = [hand.wrist for hand in hands_of(answer)]
    stiffness = np.array([5000.0] * 3 + [100.0] * 3)
    targets = np.array([each.pose_target for each in plans])
    pull = LimbPull(stiffness, targets, prepared.hands.transports, prepared.wrench)
    wrists = [w for w in prepared.hands.wrists if w is not None]
    tensions = np.array([hand.tensions for hand in hands_of(answer)])
    # from rest, so that the twists of the plan have to be found
    found = equilibria([wrists], tensions, pull, np.zeros((4, 6)))
    assert found.found.all()
    assert (found.least_stiffness > 0.0).all()
    np.testing.assert_allclose(found.twists[0], [each.twist for each in plans], atol=1e-8)
    np.testing.assert_allclose(found.body[0], 0.0, atol=1e-8)


def closed_at(question: Question, index: int, displacement: Array) -> SettledHand:
    """The hand closed where the rock has moved the other way, by the stance's own placing."""
    hand, (plain, _) = question.stance.hands[index], planned()
    moved = Pose(displacement[:3], turns_about(displacement[3:]))
    rock = moved.inverse() @ plain.batch.hands[index].seating.pose
    return settle_hand(replace(hand, hold_pose=None, hold_in_hand=rock), question.stance)


def test_wrists_and_body_balance_by_an_independent_computation() -> None:
    displacements = some()
    (sample,) = outcomes(displacements)
    assert sample.found
    prepared, answer = planned()
    question = prepared.question
    v, turn = np.split(np.array(sample.body_twist), 2)
    force, moment, used = np.zeros(3), np.zeros(3), []
    for i, hand in enumerate(hands_of(answer)):
        settled = closed_at(question, i, displacements[0, i])
        model = CompliantWrist(CompliantHand(settled, scheme="tension"))
        here = question.stance.body.inverse() @ question.stance.hands[i].pose
        axes, place = here.rotation, here.position
        carried = np.concatenate([axes.T @ (v + np.cross(turn, place)), axes.T @ turn])
        target, stiffness = hand.wrist.pose_target + carried, np.array([5e3] * 3 + [1e2] * 3)

        def off(x: Array, model=model, target=target, hand=hand, stiffness=stiffness) -> Array:
            wrench = model.evaluate(np.concatenate([hand.tensions, x])[None]).wrenches[0]
            return wrench - stiffness * (target - x)

        sizes = {"x_scale": [1e-3] * 3 + [1e-2] * 3, "max_nfev": 200}
        ends = {"xtol": 1e-15, "ftol": 1e-15, "gtol": 1e-15}
        x = scipy.optimize.least_squares(off, np.zeros(6), **sizes, **ends).x
        there = model.evaluate(np.concatenate([hand.tensions, x])[None])
        wrench = there.wrenches[0]
        assert np.abs(off(x)).max() < 1e-6  # [N, N·m]
        force -= axes @ wrench[:3]
        moment -= axes @ wrench[3:] + np.cross(place, axes @ wrench[:3])
        used.append(there.utilisation[0])
    np.testing.assert_allclose(np.append(force, moment), answer.body_wrench, atol=1e-5)
    assert sample.utilisation == pytest.approx(max(used), abs=SAME_USE)
    assert sample.limb == prepared.limbs[int(np.argmax(used))]


def test_a_tile_that_is_dragged_backwards_is_reported_with_its_force() -> None:
    displacements = some(1)
    (sample,) = outcomes(displacements)
    prepared, answer = planned()
    wrists = wrists_at(
        prepared.question.stance,
        [closed_at(prepared.question, i, displacements[0, i]) for i in range(4)],
    )
    plans = [hand.wrist for hand in hands_of(answer)]
    pull = LimbPull(
        np.array([5e3] * 3 + [1e2] * 3),
        np.array([each.pose_target for each in plans]),
        prepared.hands.transports,
        prepared.wrench,
    )
    tensions = np.array([hand.tensions for hand in hands_of(answer)])
    start = np.array([each.twist for each in plans])
    found = equilibria([[w for w in wrists if w is not None]], tensions, pull, start)
    most = 0.0
    for wrist, f, x in zip(wrists, tensions, found.twists[0], strict=True):
        settled, loads = wrist.hand.settled, wrist.hand.loads(x[None], f[None])
        for t in np.flatnonzero(settled.touching):
            normal = loads.normals[0, t]
            if settled.tiles[t].phalanx == "base":
                # it has the normal load of its finger's first phalanx
                normal = settled.engagement[t] * loads.normals[0, t + 1]
            kept = loads.shears[0, t] + settled.surface.friction * normal
            most = max(most, -(kept + settled.drag_allowances[t]))
    assert most > 0.01
    assert sample.dragged == pytest.approx(most, abs=1e-5)
    assert not sample.holds


@pytest.mark.parametrize("spoilt", ["twist", "body", "utilisation", "wrench", "dragged"])
def test_an_equilibrium_that_the_check_refuses_is_not_reported(spoilt: str) -> None:
    prepared, answer = planned()

    def passes(closed, hands, sample) -> bool:
        assert execution_passes(prepared, closed, hands, sample)
        first, *others = hands
        if spoilt == "twist":
            twist = first.wrist.twist + 1e-7
            first = replace(first, wrist=replace(first.wrist, twist=twist))
        elif spoilt == "wrench":
            first = replace(first, wrench=first.wrench + 1e-3)
        elif spoilt == "body":
            twist = [each + 1e-7 for each in sample.body_twist]
            sample = msgspec.structs.replace(sample, body_twist=twist)
        elif spoilt == "dragged":
            sample = msgspec.structs.replace(sample, dragged=sample.dragged + 0.01)
        else:
            sample = msgspec.structs.replace(sample, utilisation=sample.utilisation - 1e-4)
        return execution_passes(prepared, closed, [first, *others], sample)

    samples, refused, _ = execute(prepared, hands_of(answer), some(4), passes=passes)
    assert samples == [OpenLoopSample(False)]
    assert not refused


def test_all_equilibria_pass_the_check_wherever_hands_are_displaced() -> None:
    for name in ("wall-300", "overhang"):
        prepared, answer = planned(name)
        displacements, checked = 2.0 * some(5, 6), []

        def passes(closed, hands, sample, prepared=prepared, checked=checked) -> bool:
            checked.append(execution_passes(prepared, closed, hands, sample))
            return checked[-1]

        execute(prepared, hands_of(answer), displacements, passes=passes)
        assert len(checked) > 4
        assert all(checked)


def test_a_mirrored_stance_has_the_mirrored_outcome() -> None:
    prepared, answer = planned()
    hands = hands_of(answer)

    def mirrored(hand: HandPlan, limb: str) -> HandPlan:
        wrist = replace(
            hand.wrist,
            twist=MIRRORED * hand.wrist.twist,
            pose_target=MIRRORED * hand.wrist.pose_target,
        )
        return replace(hand, limb=limb, tensions=hand.tensions[::-1].copy(), wrist=wrist)

    # limbs are front_right, rear_right, rear_left, front_left
    turned = [mirrored(hands[3 - i], prepared.limbs[i]) for i in range(4)]
    displacements = some(2)
    (one,), _, _ = execute(prepared, hands, displacements)
    there = prepared.turned(MIRRORED * prepared.wrench)
    (other,), _, _ = execute(there, turned, MIRRORED * displacements[:, ::-1])
    assert one.found
    assert other.utilisation == pytest.approx(one.utilisation, abs=1e-5)
    assert other.limb == prepared.limbs[3 - prepared.limbs.index(one.limb)]
    np.testing.assert_allclose(other.body_twist, MIRRORED * one.body_twist, atol=1e-7)


def test_very_soft_limbs_keep_the_planned_wrenches() -> None:
    prepared, answer = planned()
    hands, displacements = hands_of(answer), some(3)[0]
    closed = [closed_at(prepared.question, i, displacements[i]) for i in range(4)]
    wrists = wrists_at(prepared.question.stance, closed)
    tensions = np.array([hand.tensions for hand in hands])
    plans, wrenches = [hand.wrist for hand in hands], np.array([hand.wrench for hand in hands])
    twists = np.array([each.twist for each in plans])
    off = []
    for scale in (1.0, 1e-2, 1e-4):
        stiffness = scale * np.array([5e3] * 3 + [1e2] * 3)
        targets = twists + wrenches / stiffness
        pull = LimbPull(stiffness, targets, prepared.hands.transports, prepared.wrench)
        found = equilibria([wrists], tensions, pull, twists)
        assert found.found.all()
        there = [
            wrist.hand.loads(x[None], f[None]).wrenches[0]
            for wrist, x, f in zip(wrists, found.twists[0], tensions, strict=True)
        ]
        off.append(np.abs(np.array(there) - wrenches).max())
    # [N] what is left falls with the stiffness
    assert off[0] > 0.1
    assert off[1] < 0.05 * off[0]
    assert off[2] < 0.05 * off[1]


def test_samples_depend_on_the_seed_and_the_limb_and_not_on_the_order_of_hands() -> None:
    question = executed(samples=4, seed=5)
    found = executed_again(samples=4, seed=5)
    assert len({sample.utilisation for sample in found.samples}) == 4
    order = replace(question.stance, hands=question.stance.hands[::-1])
    prepared = prepare_stance(replace(question, stance=order))
    turned = KnownStance(replace(question, stance=order)).plan(planned()[1].body_wrench).open_loop
    assert prepared.limbs == tuple(reversed(planned()[0].limbs))
    # plans of the same stance in another order differ by what the search leaves open
    for one, other in zip(found.samples, turned.samples, strict=True):
        assert other.utilisation == pytest.approx(one.utilisation, abs=0.05)
    assert executed_again(samples=4, seed=5) == found
    others = executed_again(samples=4, seed=6)
    assert others.samples[0].utilisation != found.samples[0].utilisation


def test_softer_limbs_bear_displaced_hands_better_than_rigid_ones() -> None:
    ranges = {"samples": 8, "height": 1e-3, "tilt": 0.02}
    _, soft = found_in(executed(stiffness=1000.0, **ranges))
    _, rigid = found_in(executed(stiffness=1e8, **ranges))
    assert soft.median < 0.8 * rigid.median


@pytest.mark.slow
def test_floating_hands_stand_still_at_their_preload() -> None:
    question = executed("slab", samples=2, position=0.0, height=0.0, tilt=0.0, yaw=0.0)
    hands = [replace(hand, wrist="floating") for hand in question.stance.hands]
    answer, found = found_in(replace(question, stance=replace(question.stance, hands=hands)))
    assert np.abs(hands_of(answer)[0].tensions - 37.0).max() > 1.0  # not the preload
    for sample in found.samples:
        assert sample.utilisation == pytest.approx(answer.utilisation, abs=SAME_USE)


def test_quantiles_count_samples_without_equilibrium_as_infinite() -> None:
    there = [OpenLoopSample(True, True, 0.1 * k, "arm", 0.0, [0.0] * 6) for k in range(9)]
    lost = OpenLoop.of([*there, OpenLoopSample(False)] * 2, 0, (0.0,) * 4, {"arm": 2}, {})
    assert lost.tenth == pytest.approx(0.1 * 0.9, abs=0.02)
    assert lost.median == pytest.approx(0.45)
    assert lost.ninetieth is None
    assert (lost.without, lost.holds, lost.worst_limb) == (2, 0.9, "arm")


def test_a_hand_that_cannot_close_is_counted_and_spoils_its_sample_alone() -> None:
    prepared, answer = planned()
    displacements = np.zeros((2, 4, 6))
    displacements[1, 2, 2] = 0.02  # [m] into the rock
    samples, refused, reasons = execute(prepared, hands_of(answer), displacements)
    assert samples[0].utilisation == pytest.approx(answer.utilisation, abs=SAME_USE)
    assert samples[1] == OpenLoopSample(False)
    assert refused == {"rear_left": 1}
    assert "inside the palm" in reasons["rear_left"]


def test_a_deadline_leaves_it_out() -> None:
    prepared, answer = planned()
    with within(1e-6):
        assert find_open_loop(prepared, hands_of(answer), 0.0, lambda *_: True) is None


def test_without_a_plan_there_is_nothing_to_execute() -> None:
    question = executed(samples=2)
    alone = replace(question.stance, hands=question.stance.hands[:1])
    # farther than wrists go
    answer = plan(replace(question, stance=alone, body_wrench=1e3 * question.needed_wrench()))
    assert answer.hands is None
    assert answer.open_loop is None


@pytest.mark.parametrize(
    ("change", "field", "words"),
    [
        (
            {"open_loop": OpenLoopSettings(), "want": frozenset()},
            "open_loop",
            "requires 'open_loop' in want",
        ),
        ({"stance": "rigid"}, "want", "limb_stiffness"),
        ({"stance": "fixed"}, "want", "fixed are front_right"),
    ],
)
def test_what_it_requires_is_named(change: dict[str, object], field: str, words: str) -> None:
    question = executed()
    stance = question.stance
    if change.get("stance") == "rigid":
        change = {"stance": replace(stance, limb_stiffness=None)}
    elif change.get("stance") == "fixed":
        first = replace(stance.hands[0], wrist="fixed")
        change = {"stance": replace(stance, hands=(first, *stance.hands[1:]))}
    with pytest.raises(InvalidInputError, match=words) as caught:
        replace(question, **{"want": frozenset(["open_loop"])} | change)
    assert caught.value.field == field


@pytest.mark.parametrize(
    ("field", "value"),
    [("samples", 0), ("seed", -1), ("position", 0.1), ("height", -1e-3), ("tilt", 1.0)],
)
def test_a_setting_out_of_range_is_named_with_its_bounds(field: str, value: float) -> None:
    with pytest.raises(InvalidInputError, match=f"must be 0|must be 1.*got {value:g}") as caught:
        OpenLoopSettings(**{field: value})
    assert caught.value.field == field


@pytest.mark.slow
def test_five_newtons_of_margin_drag_no_tile_backwards() -> None:
    for name in ("wall-300", "overhang"):
        question = replace(executed(name, samples=64), limits=Limits(hold_margin=5.0))
        _, found = found_in(question)
        assert (found.dragged, found.without) == (0, 0)


def test_contact_that_leaves_nothing_leaves_the_rest() -> None:
    request = read_request("wall-300")
    hands = [
        msgspec.structs.replace(hand, wrist="compliant", placing="contact")
        for hand in request.stance.hands
    ]
    exact = {"seat": {"contact_position": {"value": 0.0, "unit": "m", "source": "assumed"}}}
    limbs = LimbStiffness(position=5000.0, angle=100.0)
    stance = msgspec.structs.replace(request.stance, hands=hands, limb_stiffness=limbs, hand=exact)
    settings = OpenLoopSettings(samples=4, position=0.0, height=0.0, tilt=0.0, yaw=0.0)
    request_of_rest = msgspec.structs.replace(
        request, stance=stance, want=["open_loop"], open_loop=settings
    )
    answer = plan(questions.question(request_of_rest))
    assert answer.open_loop is not None
    assert answer.open_loop.ninetieth == pytest.approx(answer.utilisation, rel=1e-6)
