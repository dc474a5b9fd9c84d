"""Values that no generator writes, in every column: findings, never an error, in bounded time."""

from __future__ import annotations

import time
from dataclasses import asdict
from pathlib import Path

import builders
import pyarrow as pa
import pytest
from manifests import edit_manifest
from scenery import ASSETS, small_scenes, write_dataset
from strategies import rng

from internav_data.dataset import TABLES, read_manifest, read_table
from internav_data.dataset.parquet import write_table
from internav_data.records import Pose
from internav_data.records.errors import InternavError
from internav_data.verification import validate
from internav_data.verification.overlaps import MAX_INTRUSIONS, Solids, intrusions
from internav_data.verification.shapes import Shapes

FLOATS = (float("nan"), float("inf"), -float("inf"), 1e308, -1e308, 1e5, -1e5, 0.0, -0.0, 1e-300)
INTEGERS = (-1, -(2**15), 2**15 - 1, 0)
TEXTS = ("", "x" * 100_000, "a|b\n`c`<b>", "../..", "scene-" + "9" * 5000, "\u202e", "none", "hull")
LISTS = (0, 1, 2, 500)
"""Lengths of lists: emptied, cut, or their first items again and again."""
MAX_S = 20.0
"""CPU time of a validation of three small houses, whatever is in them."""


@pytest.fixture(scope="module")
def valid(tmp_path_factory):
    root = tmp_path_factory.mktemp("valid") / "ds"
    write_dataset(root, small_scenes())
    validate(root, "physics")  # compiles kernels, which no measured time is to hold
    return root


def nodes(kind, path=()):
    """Yield path and type of every value inside a type, lists themselves too."""
    if pa.types.is_struct(kind):
        for field in kind:
            yield from nodes(field.type, (*path, field.name))
    else:
        yield path, kind
        if pa.types.is_list(kind):
            yield from nodes(kind.value_type, (*path, 0))


def hostile(kind):
    """Return the changes of a value of a type: functions of the value."""
    if pa.types.is_list(kind):
        return [
            lambda old, n=n: [(old or [None])[k % len(old or [0])] for k in range(n)] for n in LISTS
        ]
    if pa.types.is_floating(kind):
        return [(lambda _, new=new: new) for new in FLOATS] + [lambda old: (old or 1.0) * 1e5]
    if pa.types.is_integer(kind):
        most = 2 ** (kind.bit_width - 1) - 1
        return [(lambda _, new=new: new) for new in (*INTEGERS, most, -most)]
    if pa.types.is_string(kind):
        return [(lambda _, new=new: new) for new in TEXTS]
    return [lambda old: not old]


def changed(value, path, change):
    """Return a value with what stands at a path changed; None where the path ends early."""
    if not path:
        return change(value)
    if value is None or (isinstance(value, list) and not value):
        return None
    copy = list(value) if isinstance(value, list) else dict(value)
    copy[path[0]] = changed(copy[path[0]], path[1:], change)
    return copy


def campaign():
    """Return every mutation: table, path and number of the change."""
    return [
        (spec, path, kind, k)
        for spec in TABLES
        for path, kind in nodes(pa.struct(list(spec.schema)))
        for k in range(len(hostile(kind)))
    ]


def judge(valid, tmp_path, mutation, level):
    """Validate a dataset with one mutation in the first and last rows of its first file."""
    spec, path, kind, k = mutation
    root = tmp_path / "ds"
    for part in sorted(valid.rglob("*")):
        target = root / part.relative_to(valid)
        if part.is_dir():
            target.mkdir(parents=True, exist_ok=True)
        elif part.suffix == ".parquet" or part.name == "manifest.json":
            target.write_bytes(part.read_bytes())
    file = read_manifest(root).of(spec.name)[0]
    rows = read_table(root / file.path, spec).to_pylist()
    for row in {0, len(rows) - 1}:
        rows[row] = changed(rows[row], path, hostile(kind)[k])
    try:
        table = pa.Table.from_pylist(rows, spec.schema)
        table.validate(full=True)
        info = write_table(Path(root / file.path), table, spec)
    except (pa.ArrowException, TypeError, ValueError, OverflowError, InternavError):
        return None  # the column's type cannot hold it
    written = asdict(info) | {"path": file.path}

    def fits(manifest):
        entry = next(f for f in manifest["files"] if f["path"] == file.path)
        entry |= {key: written[key] for key in entry.keys() & written.keys()}

    edit_manifest(root, fits)
    start = time.process_time()
    try:
        return validate(root, level)
    except InternavError:
        return None  # the manifest says that it does not fit
    finally:
        assert time.process_time() - start < MAX_S


def test_hundreds_of_copies_in_one_place_are_not_all_compared():
    asset_id, spot = next(iter(ASSETS)), Pose(1.0, 1.0, 0.0, builders.UPRIGHT)
    slabs = Shapes(ASSETS).slabs(asset_id, spot)
    copies = Solids.of((number, slabs) for number in range(500))
    assert len(intrusions(copies, copies)) == MAX_INTRUSIONS


def test_values_that_no_generator_writes_are_findings(valid, tmp_path):
    """A sample; the slow test below tries all of them."""
    mutations = campaign()
    for number in rng(11).permutation(len(mutations))[:8].tolist():
        judge(valid, tmp_path, mutations[number], "geometry")


@pytest.mark.parametrize(
    ("table", "path", "value"),
    [
        ("scenes", ("outline", 0, "x"), 1e5),
        ("scenes", ("rooms", 0, "polygon", 0, "x"), float("nan")),
        ("scenes", ("walls", 0, "x_max"), 1e308),
        ("scenes", ("objects", 0, "quaternion", "w"), 0.0),
        ("episodes", ("obstacles", 0, "x"), float("inf")),
        ("episodes", ("node_paths", 0, "points", 0, "x"), 1e5),
        ("assets", ("parts", 0, "centre", "x"), float("nan")),
        ("assets", ("mass_kg",), -1.0),
    ],
)
def test_hostile_numbers_are_found_and_end_no_validation(valid, tmp_path, table, path, value):
    spec = next(spec for spec in TABLES if spec.name == table)
    kinds = dict(nodes(pa.struct(list(spec.schema))))
    k = FLOATS.index(value) if value in FLOATS else 0
    mutation = (spec, path, kinds[path], k)
    findings = judge(valid, tmp_path, mutation, "geometry")
    assert findings is not None
    assert not findings.ok


@pytest.mark.parametrize(
    ("table", "path", "change"),
    [("scenes", ("doors", 0, "rooms"), 0), ("assets", ("parts", 0, "shape"), 5)],
)
def test_an_error_of_a_check_is_a_finding(valid, tmp_path, table, path, change):
    """Values of right types and ranges, for which a check was not written."""
    spec = next(spec for spec in TABLES if spec.name == table)
    kind = dict(nodes(pa.struct(list(spec.schema))))[path]
    findings = judge(valid, tmp_path, (spec, path, kind, change), "geometry")
    assert any(name.endswith(".checkable") for name in findings.by_predicate)


@pytest.mark.slow
@pytest.mark.parametrize("level", ["schema", "geometry", "physics"])
def test_every_hostile_value_in_every_column_is_a_finding(valid, tmp_path, level):
    for mutation in campaign():
        judge(valid, tmp_path, mutation, level)
