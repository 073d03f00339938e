"""Sets of numbers that meet the data, and what draws they make."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import norm, qmc, spearmanr, truncnorm

from hand_models.base import InvalidInputError
from hand_models.hand import HandModel
from hand_models.parameters import (
    ParameterTable,
    bundled_draws,
    draw_table,
    draws_of,
    even_quantiles,
    hand_table,
    own_draw,
    own_hand,
    own_surfaces,
    surface_table,
)
from hand_models.tile import Surface


def changed(section: str, name: str, **parts) -> ParameterTable:
    """The bundled sets with parts of an entry changed; without the entry if there are none."""
    raw = {
        key: {
            entry: {"value": q.value, "unit": q.unit, "source": q.source}
            for entry, q in entries.items()
        }
        for key, entries in draw_table().sections.items()
    }
    entry = raw.setdefault(section, {}).pop(name, {"unit": "1", "source": "assumed"})
    if parts:
        raw[section][name] = entry | parts
    return ParameterTable.of(raw)


def own(value: float, unit: str) -> dict[str, object]:
    return {"value": value, "unit": unit, "source": "assumed"}


def test_each_set_is_a_draw_with_its_own_numbers():
    sets, draws = draw_table(), bundled_draws()
    assert len(draws) == len(sets.vector("fit", "misfit")) >= 30
    # off by about as much as they may be: not by far more, and not by nothing
    assert 0.2 < np.mean(sets.vector("fit", "misfit")) < 1.5
    proximal = hand_table().vector("finger", "pulley_radii")[0]
    for k, draw in enumerate(draws):
        radii = [proximal, *(sets.vector("finger", f"pulley_radii[{i}]")[k] for i in (1, 2))]
        assert draw.hand.vector("finger", "pulley_radii") == tuple(radii)
        engagement = tuple(sets.vector("tile", f"engagement[{i}]")[k] for i in range(3))
        assert draw.hand.vector("tile", "engagement") == engagement
        assert draw.hand.scalar("tile", "base_engagement") == engagement[0]
        assert draw.surfaces.scalar("sandpaper-36", "shear_limit") == pytest.approx(
            sets.vector("sandpaper-36", "shear_limit")[k]
        )


def test_every_draw_is_a_possible_hand_on_every_surface():
    for draw in bundled_draws():
        HandModel(own_hand(draw.hand))
        surfaces = own_surfaces(draw.surfaces)
        for name in ("sandpaper-36", "rock", "concrete-fine", "concrete-coarse"):
            drawn = Surface.named(name, surfaces)
            ratio = draw.surfaces.scalar("defaults", "pull_off_ratio")
            assert drawn.pull_off_limit == pytest.approx(ratio * drawn.shear_limit)
            assert drawn.name == name


def test_what_has_a_range_is_spread_evenly_over_it():
    draws, sets = bundled_draws(), draw_table()
    even = (np.arange(len(draws)) + 0.5) / len(draws)
    tiles = np.array([draw.surfaces.scalar("sandpaper-36", "shear_limit") for draw in draws])
    rock = np.array([draw.surfaces.scalar("rock", "shear_limit") for draw in draws])
    least, most = sets.vector("ranges", "rock_ratio")
    np.testing.assert_allclose(np.sort(rock / tiles), least + (most - least) * even)
    for name, deviation in (("concrete-fine", 8.5), ("concrete-coarse", 18.0)):
        mean = surface_table().scalar(name, "shear_limit")
        drawn = np.sort([draw.surfaces.scalar(name, "shear_limit") for draw in draws])
        # what the figure's bars say, cut off below a fifth of the mean
        told = truncnorm(-0.8 * mean / deviation, np.inf, mean, deviation)
        np.testing.assert_allclose(drawn, told.ppf(even), rtol=5e-3)
    seats = np.sort([draw.hand.scalar("finger", "seated_contact") for draw in draws])
    np.testing.assert_allclose(seats, 0.0247 + 0.001 * (2.0 * even - 1.0), rtol=1e-9)
    # 0.5 to 8, and 0.2 to 2, of which the logarithms are even
    laws = np.sort([draw.hand.scalar("tile", "engagement_exponent") for draw in draws])
    np.testing.assert_allclose(laws, 0.5 * 16.0**even)
    palms = [draw.hand.vector("palm", "contact_stiffness") for draw in draws]
    np.testing.assert_allclose(np.sort([palm[0] for palm in palms]), 2e3 * 10.0**even)
    assert all(len(palm) == 8 and len(set(palm)) == 1 for palm in palms)
    counts = np.bincount([draw.half_planes for draw in draws])
    assert (np.abs(counts - len(draws) * np.array([0.0, 0.5, 0.25, 0.0, 0.25])) < 1.0).all()


def test_the_models_discrepancy_is_log_normal_with_a_common_part():
    draws, sets = bundled_draws(), draw_table()
    told, shared = (sets.scalar("ranges", n) for n in ("discrepancy", "discrepancy_common"))
    factors = np.log([draw.discrepancy for draw in draws])
    even = (np.arange(len(draws)) + 0.5) / len(draws)
    for column, share in zip(factors.T, [shared] + [1.0 - shared] * 8, strict=True):
        normal = norm.ppf(even, 0.0, told * np.sqrt(share))
        np.testing.assert_allclose(np.sort(column), normal, atol=1e-9)
    whole = factors[:, :1] + factors[:, 1:]
    np.testing.assert_allclose(whole.std(axis=0), told, rtol=0.12)
    # of two hands' strengths, that share is common
    assert np.corrcoef(whole[:, 0], whole[:, 1])[0, 1] == pytest.approx(shared, abs=0.12)


def test_no_range_goes_up_or_down_with_another():
    draws = bundled_draws(wrists_move=True)
    columns = [
        *(
            [draw.surfaces.scalar(name, "shear_limit") for draw in draws]
            for name in ("concrete-fine", "concrete-coarse")
        ),
        [draw.hand.scalar("finger", "seated_contact") for draw in draws],
        [draw.hand.scalar("tile", "engagement_exponent") for draw in draws],
        [draw.hand.scalar("tile", "rock_stiffness_ratio") for draw in draws],
        [draw.hand.vector("palm", "contact_stiffness")[0] for draw in draws],
        [
            draw.surfaces.scalar("rock", "shear_limit")
            / draw.surfaces.scalar("sandpaper-36", "shear_limit")
            for draw in draws
        ],
        *np.transpose([draw.discrepancy for draw in draws]),
    ]
    found = np.abs(spearmanr(np.transpose(columns)).statistic - np.eye(len(columns)))
    assert found.max() < 0.15


@pytest.mark.parametrize("count", [30, 37, 64])
def test_quantiles_fill_their_cube_as_evenly_as_a_known_sequence(count):
    quantiles = even_quantiles(count, 4)
    even = (np.arange(count) + 0.5) / count
    for column in quantiles.T:
        np.testing.assert_allclose(np.sort(column), even)
    known = qmc.Halton(4, scramble=False).random(count + 1)[1:]
    assert qmc.discrepancy(quantiles) < qmc.discrepancy(known)
    np.testing.assert_array_equal(quantiles, even_quantiles(count, 4))


def test_where_wrists_move_only_the_stiffness_on_rock_is_drawn_besides():
    usual, moving = bundled_draws(), bundled_draws(wrists_move=True)
    ratios = []
    for without, draw in zip(usual, moving, strict=True):
        assert draw.surfaces == without.surfaces
        added = draw.hand.difference(without.hand)
        assert {name: set(entries) for name, entries in added.sections.items()} == {
            "tile": {"rock_stiffness_ratio"}
        }
        ratios.append(added.scalar("tile", "rock_stiffness_ratio"))
    # 0.5 to 2, of which the logarithm is even
    even = (np.arange(len(usual)) + 0.5) / len(usual)
    np.testing.assert_allclose(np.sort(np.log2(ratios)), 2.0 * even - 1.0)
    # it goes up or down with no other quantity that is drawn by a range
    others = [
        *(
            [draw.surfaces.scalar(name, "shear_limit") for draw in usual]
            for name in ("rock", "concrete-fine", "concrete-coarse")
        ),
        [draw.hand.scalar("finger", "seated_contact") for draw in usual],
    ]
    for other in others:
        assert abs(spearmanr(ratios, other).statistic) < 0.2


@pytest.mark.parametrize(
    ("name", "value", "unit"),
    [
        ("rock_stiffness_ratio", 1.2, "1"),
        ("contact_stiffness", [4e3, 6e3, 9e3], "N/m"),
    ],
)
def test_a_stiffness_that_the_caller_knows_is_not_drawn_on_rock(name, value, unit):
    mine = own_hand(ParameterTable.of({"tile": {name: own(value, unit)}}))
    assert bundled_draws(mine, wrists_move=True) == bundled_draws(mine)


def test_numbers_that_the_caller_knows_are_not_drawn():
    mine = {"finger": {"pulley_radii": {"value": [0.0055, 0.003, 0.002], "unit": "m"}}}
    mine["finger"]["seated_contact"] = own(0.022, "m")
    mine["finger"]["pulley_radii"] |= {"source": "measured"}
    for draw in bundled_draws(own_hand(ParameterTable.of(mine))):
        assert "finger" not in draw.hand.sections
        assert set(draw.hand.sections["tile"]) == {
            "engagement",
            "base_engagement",
            "contact_stiffness",
            "engagement_exponent",
        }


def test_laws_and_palms_that_the_caller_knows_are_not_drawn():
    mine = {
        "tile": {"engagement_exponent": own(2.0, "1")},
        "palm": {"contact_stiffness": own([5e3] * 8, "N/m")},
    }
    for draw in bundled_draws(own_hand(ParameterTable.of(mine))):
        assert "engagement_exponent" not in draw.hand.sections["tile"]
        assert "palm" not in draw.hand.sections


def test_where_engagement_is_known_so_is_that_of_base_tiles():
    mine = {"tile": {"engagement": own([0.13, 0.19, 0.21], "1")}}
    for draw in bundled_draws(own_hand(ParameterTable.of(mine))):
        assert set(draw.hand.sections["tile"]) == {"contact_stiffness", "engagement_exponent"}


@pytest.mark.parametrize(
    ("table", "field"),
    [
        (changed("fit", "misfit"), "fit.misfit"),
        (changed("gripper", "added_radius"), "gripper.added_radius"),
        (changed("gripper", "tile_height", value=[4e-3] * 29), "gripper.tile_height"),
        (changed("ranges", "rock_ratio", value=[2.0]), "ranges.rock_ratio"),
        (changed("sandpaper-36", "shear_limit"), "sandpaper-36.shear_limit"),
        (changed("tile", "engagement[0]", value=[0.1] * 31), "tile.engagement[0]"),
        (changed("tile", "engagement[3]", value=[0.1] * 30), "tile.engagement[3]"),
        (changed("tile", "engagement", value=[0.1] * 30), "tile.engagement"),
        (changed("tile", "spine_travel[0]", value=[5e-3] * 30), "tile.spine_travel[0]"),
        (changed("tile", "contact_stiffness[1]", unit="N/mm"), "tile.contact_stiffness[1]"),
        (changed("tile", "softness", value=[1e4] * 30), "tile.softness"),
        (changed("concrete-fine", "shear_limit", value=[30.0] * 30), "concrete-fine.shear_limit"),
        (changed("finger", "pulley_radii[1]", value=[3.0] * 30), "[0].hand.finger.pulley_radii"),
        (changed("ranges", "seated_contact"), "ranges.seated_contact"),
        (changed("ranges", "rock_stiffness", value=[0.5]), "ranges.rock_stiffness"),
        (changed("ranges", "palm_stiffness", value=[0.5]), "ranges.palm_stiffness"),
        (changed("ranges", "engagement_exponent"), "ranges.engagement_exponent"),
        (changed("ranges", "half_planes", value=[1.0, 1.5]), "ranges.half_planes.value[1]"),
        (changed("ranges", "discrepancy", value=-0.1), "ranges.discrepancy"),
        (changed("ranges", "discrepancy_common", value=1.1), "ranges.discrepancy_common"),
    ],
)
def test_a_table_that_makes_no_draws_is_refused_by_its_entry(table, field):
    with pytest.raises(InvalidInputError) as caught:
        draws_of(table)
    assert caught.value.field == field


def test_few_sets_are_refused():
    few = {
        section: {
            name: {
                "value": q.value[:29] if section != "ranges" else q.value,
                "unit": q.unit,
                "source": q.source,
            }
            for name, q in entries.items()
        }
        for section, entries in draw_table().sections.items()
    }
    with pytest.raises(InvalidInputError, match="at least 30 sets are needed, got 29"):
        draws_of(ParameterTable.of(few))


@pytest.mark.parametrize(
    ("raw", "field", "message"),
    [
        ({}, None, "at least one entry"),
        ({"hands": {}}, "hands", "a sample has hand and surfaces"),
        ({"hand": {"finger": {"reach": own(1.0, "m")}}}, "hand.finger.reach", "unknown entry"),
        ({"hand": {"toe": {}}}, "hand.toe", "unknown section"),
        (
            {"surfaces": {"rock": {"shear_limit": own(63.0, "kN")}}},
            "surfaces.rock.shear_limit",
            "must be in 'N', got 63.0 in 'kN'",
        ),
        ({"surfaces": {"ice": {}}}, "surfaces.ice", "known are"),
        ({"surfaces": {"bounds": {}}}, "surfaces.bounds", "known are"),
        ({"surfaces": {"defaults": {"shear_limit": own(1.0, "N")}}}, None, "unknown entry"),
    ],
)
def test_a_callers_draw_is_refused_by_its_entry(raw, field, message):
    with pytest.raises(InvalidInputError, match=message) as caught:
        own_draw(raw)
    assert field is None or caught.value.field == field


def test_a_presets_ratio_may_be_the_callers_own():
    draw = own_draw({"surfaces": {"rock": {"lateral_ratio": own(0.5, "1")}}})
    surfaces = own_surfaces(draw.surfaces)
    assert Surface.named("rock", surfaces).lateral_limit == pytest.approx(0.5 * 68.1)
    fine = Surface.named("concrete-fine", surfaces)
    assert fine == Surface.named("concrete-fine")
