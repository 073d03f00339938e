"""The file of a certificate: written and read again, damaged, and of something else."""

import io
import json
from dataclasses import fields, replace

import numpy as np
import pytest

from hand_models.base import InvalidInputError
from planner.certification import ClimbCertificate
from tests.suite.helpers.certificates import random_climb


def entries(certificate):
    with io.BytesIO() as file:
        certificate.write(file)
        with np.load(io.BytesIO(file.getvalue())) as arrays:
            return {name: arrays[name] for name in arrays.files}


def with_entries(found, **changes):
    file = io.BytesIO()
    np.savez(file, **{**found, **changes})
    return file.getvalue()


def test_is_read_as_it_was_written(tmp_path):
    certificate, path = replace(random_climb(3), multiple=0.7, backward=True), tmp_path / "a.npz"
    certificate.write(path)
    for source in (path, path.read_bytes()):
        found = ClimbCertificate.read(source)
        for each in fields(certificate):
            np.testing.assert_array_equal(
                getattr(found, each.name), getattr(certificate, each.name)
            )
        assert found.digest == certificate.digest


def test_any_change_changes_the_digest():
    certificate = random_climb(3)
    others = {replace(certificate, multiple=1.0 + 1e-15).digest}
    for name in ("points", "reached", "shifts", "wrenches", "directions", "goal_bodies"):
        array = getattr(certificate, name).copy()
        array.flat[0] = 1 - array.flat[0] if array.dtype.kind != "b" else ~array.flat[0]
        others.add(replace(certificate, **{name: array}).digest)
    assert len(others | {certificate.digest}) == 8


def test_a_file_that_was_changed_is_refused():
    found = entries(random_climb(3))
    points = found["points"].copy()
    points[0, 0] += 1e-9
    header = json.loads(str(found["header"]))
    lower = {"header": np.array(json.dumps(header | {"multiple": 0.9}))}
    for changes in ({"points": points}, {"reached": ~found["reached"]}, lower):
        with pytest.raises(InvalidInputError, match="digest: does not agree"):
            ClimbCertificate.read(with_entries(found, **changes))


def test_what_is_no_certificate_is_refused(tmp_path):
    found = entries(random_climb(3))
    header = json.loads(str(found["header"]))
    newer = np.array(json.dumps(header | {"version": 2}))
    for source in (
        b"",
        b"no archive",
        with_entries(found)[:-100],
        with_entries({}, other=np.zeros(3)),
        with_entries(found, header=np.array("{")),
        with_entries(found, header=np.array("[1]")),
        with_entries(found, header=newer),
        with_entries(found, points=np.array([object()])),
    ):
        with pytest.raises(InvalidInputError):
            ClimbCertificate.read(source)
        path = tmp_path / "broken.npz"
        path.write_bytes(source)
        with pytest.raises(InvalidInputError):
            ClimbCertificate.read(path)
    with pytest.raises(InvalidInputError, match="no such file"):
        ClimbCertificate.read(tmp_path / "missing.npz")


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("points", lambda a: a[:-1]),
        ("points", lambda a: a * np.nan),
        ("base", lambda a: a[:-1]),
        ("room", lambda a: -a),
        ("parts", lambda a: a[::-1]),
        ("hands", lambda a: a * 0),
        ("reached", lambda a: a.astype(float)),
        ("shifts", lambda a: a - 1),
        ("start_members", lambda a: a + 99),
        ("own_members", lambda a: np.full((1, 3), 77)),
        ("directions", lambda a: a * np.inf),
        ("multiple", lambda a: -0.1),
        ("multiple", lambda a: np.nan),
    ],
)
@pytest.mark.filterwarnings("ignore:invalid value")
def test_impossible_arrays_are_refused(name, change):
    certificate = random_climb(3)
    with pytest.raises(InvalidInputError):
        replace(certificate, **{name: change(getattr(certificate, name))})
