"""Datasets on disk: schemas, shards, manifest, loader, statistics and dataset card."""

from internav_data.dataset.commit import (
    Retry,
    assemble,
    commit_scenes,
    done_scenes,
    end_staging,
    held_config,
    identity_of,
    open_staging,
)
from internav_data.dataset.decode import from_table
from internav_data.dataset.digest import logical_digest
from internav_data.dataset.encode import to_table
from internav_data.dataset.jsonschemas import (
    schema_folder,
    schema_text,
    schemas,
    write_schemas,
)
from internav_data.dataset.loader import Dataset, load_dataset
from internav_data.dataset.location import dataset_folder
from internav_data.dataset.manifest import (
    DataFile,
    DatasetPart,
    Manifest,
    Quarantined,
    has_manifest,
    locate,
    read_manifest,
    write_manifest,
)
from internav_data.dataset.merging import merge
from internav_data.dataset.outcome_stats import refused_share
from internav_data.dataset.parquet import FileInfo, read_table, write_parquet
from internav_data.dataset.repair import Damage, find_damage, repair_files
from internav_data.dataset.staging import (
    STAGING,
    Identity,
    SceneState,
    Staging,
    any_staged,
    clear_staging,
    is_unfinished,
    read_staged_rows,
    stage_quarantine,
    stage_scene,
    staged_scenes,
)
from internav_data.dataset.stats import compute_stats
from internav_data.dataset.tables import (
    ASSETS,
    EPISODES,
    FORMAT_VERSION,
    SCENES,
    TABLES,
    TableSpec,
)

__all__ = [
    "ASSETS",
    "EPISODES",
    "FORMAT_VERSION",
    "SCENES",
    "STAGING",
    "TABLES",
    "Damage",
    "DataFile",
    "Dataset",
    "DatasetPart",
    "FileInfo",
    "Identity",
    "Manifest",
    "Quarantined",
    "Retry",
    "SceneState",
    "Staging",
    "TableSpec",
    "any_staged",
    "assemble",
    "clear_staging",
    "commit_scenes",
    "compute_stats",
    "dataset_folder",
    "done_scenes",
    "end_staging",
    "find_damage",
    "from_table",
    "has_manifest",
    "held_config",
    "identity_of",
    "is_unfinished",
    "load_dataset",
    "locate",
    "logical_digest",
    "merge",
    "open_staging",
    "read_manifest",
    "read_staged_rows",
    "read_table",
    "refused_share",
    "repair_files",
    "schema_folder",
    "schema_text",
    "schemas",
    "stage_quarantine",
    "stage_scene",
    "staged_scenes",
    "to_table",
    "write_manifest",
    "write_parquet",
    "write_schemas",
]
