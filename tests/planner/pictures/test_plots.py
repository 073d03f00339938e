"""The picture of a plan: what is drawn is what was planned, for every kind of stance."""

from __future__ import annotations

import json
import math
import re
from dataclasses import replace
from functools import cache
from itertools import combinations, pairwise

import numpy as np
import pytest
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d import proj3d
from msgspec import structs

import planner
from hand_models import Grasp, Plane
from planner.explanation import constraint_words
from planner.pictures import draw_plan, hand_plots, plot_plan
from planner.pictures.plan_scene import drawn_scene
from planner.pictures.plan_views import SCENE_STYLES, UTILISATION_COLOURS
from planner.pictures.settings import PICTURE_SETTINGS
from planner.question import Limits, Question
from planner.solving import solve
from service.commands.cli import run_command_line
from tests.suite.helpers.hands import HAND, ROCK
from tests.suite.helpers.pictures import answered, drawn, panels
from tests.suite.helpers.stances import ask, on_wall

found = solve.plan


@cache
def laid_out(name):
    """The same with its texts where they are drawn."""
    figure = drawn(name)
    figure.draw_without_rendering()
    return figure


def arrows(axes):
    """Begin and tip of every arrow, shape (n, 2, 2), and their colours."""
    notes = [note for note in axes.texts if note.arrow_patch is not None]
    ends = np.array([(note.xyann, note.xy) for note in notes])
    return ends, [note.arrow_patch.get_edgecolor() for note in notes]


def limb_lines(axes):
    colour = SCENE_STYLES["limb"]["color"]
    return [each for each in axes.lines if (each.get_color(), each.get_linewidth()) == (colour, 4)]


def words(axes):
    return [note.get_text() for note in axes.texts]


KINDS = ("overloaded", "plain", "ceiling", "floating", "infeasible", "one limb", "two limbs")
STATUSES = {"overloaded": "overloaded", "infeasible": "infeasible", "plain": "optimal"}
LONG = ("plain", "ceiling", "one limb", "two limbs")


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow if name in LONG else ()) for name in KINDS]
)
def test_every_kind_of_stance_has_a_picture_with_units_on_its_axes(name):
    question, plan = answered(name)
    assert plan.status == STATUSES.get(name, plan.status)
    figure = drawn(name)
    space, facing, side = panels(figure)
    labels = [space.get_xlabel(), space.get_ylabel(), space.get_zlabel()]
    assert labels == ["x of W [m]", "y of W [m]", "z of W [m]"]
    for axes in (facing, side):
        assert axes.get_xlabel().endswith(", from B [m]")
        assert axes.get_ylabel().endswith(", from B [m]")
        assert axes.get_aspect() == 1.0
    for axes in (space, facing, side):
        count = 0 if plan.joints is None else len(question.stance.robot.limbs)
        assert len(limb_lines(axes)) == count
        assert len(arrows(axes)[0]) == 1 + len(plan.hands or ())
    used = "" if plan.utilisation is None else f": utilisation {plan.utilisation:.2f}"
    assert figure.get_suptitle() == f"{plan.status}{used}"


def test_a_picture_is_written_in_the_form_of_its_name(tmp_path):
    question, plan = answered("two hands")
    plot_plan(plan, question, tmp_path / "plan.svg")
    assert (tmp_path / "plan.svg").read_bytes().startswith(b"<?xml")


def test_a_plan_is_not_solved_again_for_its_picture(tmp_path, monkeypatch, capfd):
    solved, without = [], planner.plan_without_palms
    for name, of in (("plan", found), ("plan_without_palms", without)):
        count = lambda question, name=name, of=of: solved.append(name) or of(question)  # noqa: E731
        monkeypatch.setattr(planner, name, count)
    picture = tmp_path / "plan.png"
    assert run_command_line(["plan", "wall-300", "--plot", str(picture), "--json"]) == 0
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert solved == ["plan", "plan_without_palms"]
    assert json.loads(capfd.readouterr().out)["status"] == "optimal"


@pytest.mark.parametrize("name", ["solved", "plain", "overloaded", "two limbs"])
def test_the_arrows_of_every_view_balance(name):
    for axes in panels(drawn(name)):
        ends, _ = arrows(axes)
        steps = ends[:, 1] - ends[:, 0]
        longest = np.linalg.norm(steps, axis=1).max()
        np.testing.assert_allclose(steps.sum(axis=0), 0.0, atol=1e-5 * longest)


@pytest.mark.parametrize("name", ["solved", "overloaded", "ceiling", "two hands", "two limbs"])
def test_notes_and_arrows_stay_in_the_picture_and_off_each_other(name):
    figure = drawn(name)
    figure.draw_without_rendering()
    space, *sides = panels(figure)
    room = sides[0].get_window_extent().x0
    for axes in (space, *sides):
        frame = (0.0, 0.0, room, figure.bbox.height)
        frame = np.reshape(frame if axes is space else axes.get_window_extent().extents, (2, 2))
        ends = axes.transData.transform(arrows(axes)[0].reshape(-1, 2))
        assert ((ends >= frame[0]) & (ends <= frame[1])).all()
        boxes = [note.get_window_extent() for note in axes.texts if note.get_text()]
        assert not any(a.overlaps(b) for a, b in combinations(boxes, 2))
        for box in boxes if axes is not space else ():
            assert (frame[0] <= box.min).all()
            assert (box.max <= frame[1]).all()
            assert not any(box.contains(*tip) for tip in ends[1::2])


@pytest.mark.parametrize("off", [0.3, 0.6])
def test_under_a_ceiling_the_body_and_its_weight_are_seen_beside_the_hands(off):
    question = Question(on_wall(overhang=math.pi / 2, off=off))
    plan = replace(answered("ceiling")[1], hands=None, joints=None, certificate=None)
    axes = draw_plan(plan, question).axes[0]
    scene = drawn_scene(plan, question)

    def seen(places):
        return np.column_stack(proj3d.proj_transform(*np.transpose(places), axes.get_proj())[:2])

    spots = seen([scene.origin, scene.arrows[-1].start])
    palms = [surface.triangles for surface in scene.surfaces if surface.kind == "palm"]
    fingers = [line.points for line in scene.lines if line.kind == "finger"]
    for i, palm in enumerate(palms):
        drawn_hand = seen(np.vstack([*palm, *fingers[4 * i : 4 * i + 4]]))
        within = (drawn_hand.min(axis=0) < spots) & (spots < drawn_hand.max(axis=0))
        assert not within.all(axis=1).any()


@pytest.mark.parametrize("name", ["plain", "nails"])
def test_titles_of_columns_do_not_run_together(name):
    figure = laid_out(name)
    titles = figure.axes[3].get_xticklabels()
    assert ("nail" in [title.get_text() for title in titles]) == (name == "nails")
    if titles[0].get_rotation() == 0.0:
        boxes = [title.get_window_extent() for title in titles]
        assert all(a.x1 < b.x0 for a, b in pairwise(boxes))
    else:
        # parallel lines of words, whose ends are farther apart than they are high
        ends = [title.get_transform().transform(title.get_position())[0] for title in titles]
        height = titles[0].get_fontsize() * figure.dpi / 72.0
        away = np.diff(ends) * math.sin(math.radians(titles[0].get_rotation()))
        assert (away > height).all()


def test_where_nothing_balances_the_picture_says_what_is_missing_and_what_leaves_no_balance():
    _, plan = answered("flat wall")
    assert plan.status == "infeasible"
    proof = plan.certificate
    panel = drawn("flat wall").axes[3]
    cells = panel.tables[0].get_celld()
    parts = {"needed": plan.body_wrench, "nearest": proof.nearest, "missing": proof.shortfall}
    for j, (name, wrench) in enumerate(parts.items(), start=1):
        assert cells[0, j].get_text().get_text() == name
        told = [float(cells[i + 1, j].get_text().get_text()) for i in range(6)]
        np.testing.assert_allclose(told, wrench, atol=0.051)
    text = words(panel)[-1]
    assert proof.irreducible
    first = proof.irreducible[0]
    assert f"{first.limb.replace('_', ' ')}:\n    {constraint_words(first)}" in text
    for name in proof.irreducible:
        assert f"{name.limb.replace('_', ' ')}:" in text


def test_where_loads_of_any_sign_give_nothing_the_picture_says_so():
    _, plan = answered("infeasible")
    assert plan.certificate.irreducible == ()
    panel = drawn("infeasible").axes[3]
    assert "no loads at all, of any sign" in words(panel)[-1]
    bare = draw_plan(replace(plan, certificate=None), answered("infeasible")[0])
    assert words(bare.axes[3]) == ["no plan, no loads"]


def test_large_numbers_stay_in_their_cells():
    question, plan = answered("plain")
    hands = [
        replace(hand, utilisation=used, tile_utilisations=used + hand.tile_utilisations)
        for hand, used in zip(plan.hands, (9.9951, 99.951, 901.51, 5e6), strict=True)
    ]
    figure = draw_plan(replace(plan, hands=tuple(hands)), question)
    figure.draw_without_rendering()
    table = figure.axes[3]
    assert {"902", "999+"} <= set(words(table))
    width = table.get_window_extent().width / len(table.get_xticklabels())
    assert all(text.get_window_extent().width < width for text in table.texts)


@pytest.mark.parametrize("name", ["solved", "overloaded"])
def test_forces_begin_at_the_hands_and_have_their_direction_size_and_colour(name):
    question, plan = answered(name)
    *forces, load = drawn_scene(plan, question).arrows
    ends, colours = arrows(panels(drawn(name))[1])
    assert len(ends) == len(forces) + 1
    for arrow, colour, hand, planned in zip(
        forces, colours[:-1], question.stance.hands, plan.hands, strict=True
    ):
        np.testing.assert_allclose(arrow.start, hand.pose.position)
        np.testing.assert_allclose(arrow.force, -hand.pose.rotation @ planned.wrench[:3])
        assert colour == UTILISATION_COLOURS(planned.utilisation)
        assert (colour == to_rgba(PICTURE_SETTINGS.overload)) == (name == "overloaded")
    # seen along −z of B: against its y, and along its x; the longest arrow is of half a metre
    turn = question.stance.body.rotation
    sizes = [np.linalg.norm(arrow.force) for arrow in (*forces, load)]
    steps = [0.5 / max(sizes) * arrow.force @ turn[:, [1, 0]] * [-1.0, 1.0] for arrow in forces]
    np.testing.assert_allclose((ends[:, 1] - ends[:, 0])[:-1], steps, atol=1e-9)


@pytest.mark.parametrize("name", ["solved", "two hands", "infeasible", "two limbs"])
def test_limbs_are_drawn_where_the_model_has_them(name):
    question, plan = answered(name)
    stance = question.stance
    lines = [line.points for line in drawn_scene(plan, question).lines if line.kind == "limb"]
    limbs = dict(zip(stance.robot.limbs, lines, strict=True))
    space, facing, _ = panels(drawn(name))
    for limb, in_space, from_behind in zip(
        limbs, limb_lines(space), limb_lines(facing), strict=True
    ):
        chain = stance.robot.link_chain(plan.joints, limb)
        np.testing.assert_allclose(limbs[limb], stance.body.apply(chain), atol=1e-9)
        np.testing.assert_allclose(np.transpose(in_space.get_data_3d()), limbs[limb], atol=1e-9)
        if name != "two limbs":
            flat = chain[:, [1, 0]] * [-1.0, 1.0]
            np.testing.assert_allclose(from_behind.get_xydata(), flat, atol=1e-9)
    for hand in stance.hands:
        np.testing.assert_allclose(limbs[hand.limb][-1], hand.pose.position, atol=1e-5)


def test_joints_have_the_colour_and_the_number_of_their_torque():
    _, plan = answered("overloaded")
    figure = drawn("overloaded")
    used = {limb: np.abs(torque) / 100.0 for limb, torque in plan.joint_torque.items()}
    facing, table = figure.axes[1], figure.axes[4]
    dots = [line.get_color() for line in facing.lines if line.get_markeredgecolor() == "0.2"]
    dots = [colour for colour in dots if colour != "0.2"]
    want = [UTILISATION_COLOURS(value) for limb in used for value in np.sort(used[limb])]
    assert dots == want
    assert words(table) == [f"{value:.2f}" for limb in used for value in used[limb]]
    assert table.get_title(loc="right").startswith("utilisation of each joint")


def test_the_table_has_the_utilisation_of_every_tile_tendon_palm_and_hand():
    _, plan = answered("plain")
    table = drawn("plain").axes[3]
    want = []
    for hand in plan.hands:
        for finger in hand.fingers:
            want += [tile.utilisation for tile in finger.tiles if tile.contact != "none"]
            # at rest a motor's current tells first
            want.append(finger.motor_current / HAND.drive.maximum_current)
            assert want[-1] > finger.tendon_tension / 700.0
    assert all(hand.palm.engaged for hand in plan.hands)
    whole = [used for hand in plan.hands for used in (hand.palm.utilisation, hand.utilisation)]
    assert words(table) == [f"{value:.2f}" for value in want + whole]
    assert len(table.get_yticklabels()) == 4 * len(plan.hands)


def test_the_table_tells_that_a_tendon_is_at_its_limit():
    question = replace(answered("plain")[0], limits=Limits(tendon_tension=60.0))
    plan = solve.plan(question)
    assert plan.limiting.limit == "tendon_tension"
    table = draw_plan(plan, question).axes[3].images[0].get_array()
    np.testing.assert_allclose(table[:, 4].max(), plan.utilisation)
    np.testing.assert_allclose(table[:, 4], np.concatenate([h.tensions for h in plan.hands]) / 60.0)


def test_a_palm_has_a_cell_as_high_as_its_hand():
    question, plan = answered("plain")
    first, *others = plan.hands
    used = 0.37
    palms = [structs.replace(first.palm, utilisation=used), *(hand.palm for hand in others)]
    palms[1] = structs.replace(palms[1], engaged=())
    hands = (replace(hand, palm=palm) for hand, palm in zip(plan.hands, palms, strict=True))
    table = draw_plan(replace(plan, hands=tuple(hands)), question).axes[3]
    assert [label.get_text() for label in table.get_xticklabels()][-2] == "palm"
    (cell,) = (text for text in table.texts if text.get_text() == "0.37")
    # in the palm's column, in the middle of the hand's four fingers
    assert cell.get_position() == (5, 1.5)
    column = table.images[0].get_array()[:, 5]
    np.testing.assert_allclose(column[:4], used)
    assert column.mask.tolist() == [False] * 4 + [True] * 4 + [False] * 8


def test_joints_without_a_plan_have_no_colour_and_no_table():
    _, plan = answered("infeasible")
    figure = drawn("infeasible")
    assert len(figure.axes) == 4
    assert plan.joints is not None
    dots = [line for line in figure.axes[1].lines if line.get_color() == "white"]
    assert len(dots) == 4


def test_hands_and_limbs_are_named_and_hands_behind_each_other_share_a_note():
    _, facing, _ = panels(drawn("two hands"))
    assert {"front left", "rear right", "front right (free)"} <= set(words(facing))
    _, facing, side = panels(drawn("solved"))
    assert {"front left", "rear right", "front right", "rear left"} <= set(words(facing))
    assert {"front right,\nfront left", "rear right,\nrear left"} <= set(words(side))
    _, facing, _ = panels(drawn("floating"))
    assert "front right (floats)" in words(facing)


def test_the_load_is_called_a_weight_only_where_it_is_the_robots():
    for name in ("solved", "plain"):
        question, plan = answered(name)
        assert drawn_scene(plan, question).arrows[-1].text == "weight 1082 N"
        assert "weight 1082 N" in words(drawn(name).axes[1])
    question, plan = answered("overloaded")
    load = drawn_scene(plan, question).arrows[-1]
    assert load.text == "load 3924 N"
    np.testing.assert_allclose(load.start, question.stance.body.apply((0.1, 0.2, -0.1)))
    np.testing.assert_allclose(load.force, [0.0, 0.0, -400.0 * 9.81])
    # about B a force and a moment: at the centre of mass the moment is another
    given = Question(question.stance, body_wrench=np.array([500.0, 0, 0, 0, 0, 30.0]))
    com = question.stance.robot.com_at(plan.joints)
    about = -np.array([0.0, 0, 30.0]) + np.cross(com, [500.0, 0, 0])
    load = drawn_scene(solve.plan(given), given).arrows[-1]
    assert load.text == f"load 500 N\nand {np.linalg.norm(about):.0f} N·m"


def test_many_hands_make_the_picture_taller():
    question, plan = answered("plain")
    limbs = [f"leg{i}" for i in range(16)]
    wide = replace(plan, hands=tuple(replace(plan.hands[0], limb=limb) for limb in limbs))
    assert drawn("plain").get_size_inches()[1] == 7.2
    height = draw_plan(wide, question).get_size_inches()[1]
    assert height * (0.875 - 0.075) / 64 > 0.1


def test_what_is_drawn_of_a_finger_and_the_palm_is_in_the_legend():
    settled = HAND.settle(Plane(), ROCK, Grasp())
    panels = list(Figure().subplots(2, 2).ravel())
    hand_plots.draw_fingers(panels, settled, np.full(4, settled.closing_tension))
    named = {line.get_color(): line.get_label() for line in panels[0].get_legend().get_lines()}
    bars = {line.get_color() for line in panels[0].lines if line.get_linewidth() in (3, 4)}
    assert named[PICTURE_SETTINGS.palm] == "palm"
    assert bars <= set(named)


def test_a_plans_spread_is_drawn_where_it_was_asked_for():
    def titles(*want: str) -> list[str]:
        asked, answer = answered("spread")
        if "spread" not in want:
            asked = ask(asked.stance, *want)
            answer = solve.plan(asked)
        axes = draw_plan(answer, asked).axes
        for each in axes:
            if each.get_xlabel() == "load factor [1]":
                heights = [bar.get_height() for bar in each.patches if bar.get_height() > 0.0]
                factors = [f for f in answer.spread.load_factors if f is not None]
                assert sum(round(height) for height in heights[1:]) == len(factors)
                assert each.get_ylabel() == "samples"
            if each.get_xlabel() == "samples":
                answers = [answer.spread, answer.spread.kept, answer.spread.feedback]
                holds, over, without = ([bar.get_width() for bar in c] for c in each.containers)
                assert holds == [each.holds for each in answers]
                rows = [row.get_text().replace("\n", " ") for row in each.get_yticklabels()]
                assert rows == ["planned anew", "tensions kept", "balanced by feedback"]
                assert without == [each.without for each in answers]
                assert np.sum([holds, over, without], axis=0).tolist() == [answer.spread.draws] * 3
        assert len(axes) == before + 2 * ("spread" in want)
        return [each.get_title("left") for each in axes]

    before = len(draw_plan(solve.plan(ask(on_wall())), ask(on_wall())).axes)
    (told,) = (title for title in titles("spread", "load_factor") if "feasible" in title)
    assert re.fullmatch(
        r"feasible where a tile on rock holds \d+ N or more: \d+% of its range",
        told.replace("\n", " "),
    )
    assert not any("feasible" in title for title in titles("load_factor"))


def test_the_heading_of_a_spread_with_a_cap_lies_on_no_label():
    asked, answer = answered("spread")
    figure = draw_plan(replace(answer, spread=structs.replace(answer.spread, cap=0.8)), asked)
    figure.draw_without_rendering()
    (heading,) = (axes._left_title for axes in figure.axes if "feasible" in axes.get_title("left"))
    assert heading.get_text().endswith("(utilisation up to 0.8)")
    box = heading.get_window_extent()
    labels = [label for axes in figure.axes for label in (axes.xaxis.label, axes.yaxis.label)]
    assert not any(box.overlaps(label.get_window_extent()) for label in labels if label.get_text())


def test_numbers_and_legends_of_a_spread_lie_on_nothing_else():
    asked, answer = answered("spread")
    spread = answer.spread
    for holds, without in ((1, 28), (0, 0), (1, spread.draws - 2), (14, 2), (spread.draws - 1, 1)):
        kept = structs.replace(spread.kept, holds=holds, without=without)
        figure = draw_plan(replace(answer, spread=structs.replace(spread, kept=kept)), asked)
        figure.draw_without_rendering()
        small = [
            axes for axes in figure.axes if "samples" in (axes.get_xlabel(), axes.get_ylabel())
        ]
        texts = [text for axes in small for text in (*axes.texts, *axes.get_legend().get_texts())]
        texts += [label for axes in small for label in axes.get_xticklabels()]
        texts += [axes._left_title for axes in small]
        texts += [axes.yaxis.label for axes in figure.axes]
        boxes = [text.get_window_extent() for text in texts if text.get_text()]
        for i, box in enumerate(boxes):
            assert box.x0 > 0.01 * figure.bbox.width
            assert not any(box.overlaps(other) for other in boxes[:i])
        (bars,) = (axes for axes in small if axes.get_xlabel() == "samples")
        shown = [int(text.get_text()) for text in bars.texts]
        answers, draws = (spread, kept, spread.feedback), spread.draws
        parts = [[a.holds, draws - a.holds - a.without, a.without] for a in answers]
        assert shown == [n for each in parts for n in each if n]
