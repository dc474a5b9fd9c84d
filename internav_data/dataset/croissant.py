"""croissant.json: the dataset in the vocabulary of ML Commons' Croissant 1.1."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from internav_data.core.field_docs import descriptions
from internav_data.dataset.nodes import Coordinates, Keyed, Leaf, Node, Record, Sequence
from internav_data.dataset.tables import EPISODES, FORMAT_VERSION, SCENES, TableSpec

if TYPE_CHECKING:
    from internav_data.dataset.manifest import DataFile, Manifest

_PARQUET = "application/x-parquet"
_CONTEXT: dict[str, Any] = {
    "@language": "en",
    "@vocab": "https://schema.org/",
    "sc": "https://schema.org/",
    "cr": "http://mlcommons.org/croissant/",
    "rai": "http://mlcommons.org/croissant/RAI/",
    "dct": "http://purl.org/dc/terms/",
    "arrayShape": "cr:arrayShape",
    "citeAs": "cr:citeAs",
    "column": "cr:column",
    "conformsTo": "dct:conformsTo",
    "containedIn": "cr:containedIn",
    "data": {"@id": "cr:data", "@type": "@json"},
    "dataType": {"@id": "cr:dataType", "@type": "@vocab"},
    "description": {"@container": "@language"},
    "equivalentProperty": "cr:equivalentProperty",
    "examples": {"@id": "cr:examples", "@type": "@json"},
    "extract": "cr:extract",
    "field": "cr:field",
    "fileObject": "cr:fileObject",
    "fileProperty": "cr:fileProperty",
    "fileSet": "cr:fileSet",
    "format": "cr:format",
    "includes": "cr:includes",
    "isArray": "cr:isArray",
    "isLiveDataset": "cr:isLiveDataset",
    "jsonPath": "cr:jsonPath",
    "key": "cr:key",
    "md5": "cr:md5",
    "name": {"@container": "@language"},
    "parentField": "cr:parentField",
    "path": "cr:path",
    "recordSet": "cr:recordSet",
    "references": "cr:references",
    "regex": "cr:regex",
    "repeated": "cr:repeated",
    "replace": "cr:replace",
    "samplingRate": "cr:samplingRate",
    "separator": "cr:separator",
    "source": "cr:source",
    "subField": "cr:subField",
    "transform": "cr:transform",
}
LICENCE = "Apache-2.0"
"""SPDX identifier of the licence of what is generated; meshes of a user's own keep theirs."""
_TYPES = {"string": "sc:Text", "bool": "sc:Boolean", "float64": "sc:Float"}


def croissant(manifest: Manifest) -> dict[str, Any]:
    """Return the Croissant description of a dataset: its files, their digests and its fields."""
    tables = [spec for spec in (EPISODES, SCENES) if manifest.of(spec.name)]
    return {
        "@context": _CONTEXT,
        "@type": "sc:Dataset",
        "name": "interactive-navigation-episodes",
        "description": "Interactive-navigation episodes in generated houses: obstacles, settled "
        "by physics, block or lengthen an agent's path to its goal.",
        "conformsTo": "http://mlcommons.org/croissant/1.1",
        "license": f"https://spdx.org/licenses/{LICENCE}.html",
        "citeAs": citation(manifest),
        "isLiveDataset": False,
        "version": f"{FORMAT_VERSION}.0.0",
        "distribution": [_file(f) for f in manifest.files]
        + [_file_set(spec, manifest) for spec in tables],
        "recordSet": [_record_set(spec) for spec in tables],
    }


def citation(manifest: Manifest) -> str:
    """Return a BibTeX entry of a dataset, without a date: the same seed gives the same bytes."""
    return (
        "@misc{internav_data, author = {The internav authors}, "
        f"title = {{internav-data {manifest.generator_version}: interactive-navigation episodes, "
        f"seed {manifest.seed}}}}}"
    )


def _file(file: DataFile) -> dict[str, Any]:
    return {
        "@type": "cr:FileObject",
        "@id": file.path,
        "name": file.path,
        "contentUrl": file.path,
        "contentSize": f"{file.bytes} B",
        "encodingFormat": _PARQUET,
        "sha256": file.sha256,
    }


def _file_set(spec: TableSpec[Any], manifest: Manifest) -> dict[str, Any]:
    return {
        "@type": "cr:FileSet",
        "@id": f"{spec.name}-files",
        "name": f"{spec.name}-files",
        "encodingFormat": _PARQUET,
        "includes": [file.path for file in manifest.of(spec.name)],
    }


def _record_set(spec: TableSpec[Any]) -> dict[str, Any]:
    notes = descriptions(spec.cls)
    fields = []
    for field in spec.node.fields:
        source = {"fileSet": {"@id": f"{spec.name}-files"}, "extract": {"column": field.name}}
        made = _field(field.node, f"{spec.name}/{field.name}", source, "$")
        if field.name in notes:
            made["description"] = " ".join(notes[field.name].split())
        if made.get("subField") != []:
            fields.append(made)
    return {
        "@type": "cr:RecordSet",
        "@id": spec.name,
        "name": spec.name,
        "key": {"@id": f"{spec.name}/{'episode_id' if spec is EPISODES else 'scene_id'}"},
        "field": fields,
    }


def _field(node: Node, path: str, source: dict[str, Any], where: str) -> dict[str, Any]:
    made: dict[str, Any] = {"@type": "cr:Field", "@id": path, "name": path.rsplit("/", 1)[-1]}
    while isinstance(node, Sequence):
        made["repeated"] = True
        node, where = node.item, f"{where}[*]"
    if isinstance(node, Leaf):
        made["dataType"] = _TYPES.get(node.kind, "sc:Integer")
        step = {} if not where.strip("$[*]") else {"transform": {"jsonPath": where}}
        return made | {"source": source | step}
    members: list[tuple[str, Node]] = []
    if isinstance(node, Coordinates):
        members = [(name, node.leaf) for name in node.names]
    elif isinstance(node, Record):
        # The reference reader has no word for lists within lists of structs: schemas/ has.
        members = [
            (field.name, field.node)
            for field in node.fields
            if not isinstance(field.node, Sequence)
        ]
    elif isinstance(node, Keyed):
        raise TypeError(f"{path}: a mapping has no columns")
    made["subField"] = [
        _field(member, f"{path}/{name}", source, f"{where}.{name}") for name, member in members
    ]
    return made
