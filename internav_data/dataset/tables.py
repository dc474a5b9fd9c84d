"""The three tables of a dataset and their Arrow schemas.

`EPISODES`, `SCENES` and `ASSETS` are all that other packages need: they go with
`to_table(records, spec)`, `from_table(table, spec)` and `write_parquet(path, records, spec)`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Generic, TypeVar

import pyarrow as pa

from internav_data.dataset.nodes import Coordinates, Field, Keyed, Leaf, Node, Record, record_node
from internav_data.records import Asset, Episode, House

if TYPE_CHECKING:
    from collections.abc import Mapping

R = TypeVar("R")

_LEAVES: dict[str, pa.DataType] = {
    "string": pa.string(),
    "bool": pa.bool_(),
    "float64": pa.float64(),
    "int8": pa.int8(),
    "uint8": pa.uint8(),
    "int16": pa.int16(),
    "int32": pa.int32(),
    "int64": pa.int64(),
}

FORMAT_VERSION = 2
"""Version of the format; raised whenever an older reader would misunderstand the files.

From version 2 on columns and manifest keys are only added, nullable or with a default.
"""


@dataclass(frozen=True, slots=True)
class TableSpec(Generic[R]):
    """A table: its name, what one row is, and the columns that carry row group statistics."""

    name: str
    cls: type[R]
    filters: tuple[str, ...]
    """Top-level scalars that readers prune row groups by."""
    plain: tuple[str, ...] = ()
    """Parquet paths of structs whose numbers hardly ever repeat: a dictionary makes them larger."""

    @property
    def node(self) -> Record:
        """The shape of one row."""
        return record_node(self.cls)

    @property
    def schema(self) -> pa.Schema:
        """The Arrow schema of the table: every field that cannot be None is not nullable."""
        return arrow_schema(self.cls)


_known: dict[type[Any], pa.Schema] = {}


def arrow_schema(cls: type[Any]) -> pa.Schema:
    """Return the Arrow schema of a dataclass."""
    if cls not in _known:
        _known[cls] = pa.schema([arrow_field(field) for field in record_node(cls).fields])
    return _known[cls]


def arrow_field(field: Field) -> pa.Field:
    """Return the Arrow field of a record's field."""
    return pa.field(field.name, arrow_type(field.node), nullable=field.nullable)


def arrow_type(node: Node) -> pa.DataType:
    """Return the Arrow type of a node.

    Raises
    ------
    TypeError
        The node is, or holds, a mapping, which has no columns.

    """
    if isinstance(node, Leaf):
        return _LEAVES[node.kind]
    if isinstance(node, Coordinates):
        leaf = arrow_type(node.leaf)
        return pa.struct([pa.field(name, leaf, nullable=False) for name in node.names])
    if isinstance(node, Record):
        return pa.struct([arrow_field(field) for field in node.fields])
    if isinstance(node, Keyed):
        raise TypeError("a mapping has no columns")
    return pa.list_(pa.field("element", arrow_type(node.item), nullable=False))


_OUTCOME = "obstacles.list.element.outcomes.list.element"
EPISODES: TableSpec[Episode] = TableSpec(
    "episodes",
    Episode,
    (
        *("episode_id", "scene_id", "index", "room_count", "mode", "sealed", "rooms_on_path"),
        *(
            "obstacle_count",
            "shortest_path_m",
            "shortest_path_steps",
            "obstructed_path_m",
            "obstructed_path_steps",
            "agreed",
        ),
    ),
    tuple(f"{_OUTCOME}.{name}" for name in ("pose.", "moved.list.element.pose.", "other_pose.")),
)
SCENES: TableSpec[House] = TableSpec("scenes", House, ("scene_id", "scene", "area_m2"))
ASSETS: TableSpec[Asset] = TableSpec("assets", Asset, ("asset_id",))
TABLES: tuple[TableSpec[Any], ...] = (EPISODES, SCENES, ASSETS)
SPECS: Mapping[str, TableSpec[Any]] = {spec.name: spec for spec in TABLES}
"""Tables by name."""
