"""Upload of a dataset to the Hugging Face hub: a plan first, then one commit.

The folder of a dataset is a dataset repository already. Sending alone needs huggingface_hub.
"""

from __future__ import annotations

import os
import re
from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from internav_data.core.extras import require
from internav_data.core.storage import FolderStore, store_of
from internav_data.dataset.location import folder_to_read
from internav_data.dataset.manifest import read_manifest
from internav_data.dataset.metadata_files import METADATA
from internav_data.dataset.repair import find_damage
from internav_data.records.errors import CorruptDataError, UsageError

if TYPE_CHECKING:
    from pathlib import Path

    from internav_data.dataset.manifest import Manifest

ENDPOINT_VARIABLE: Final = "HF_ENDPOINT"
"""Environment variable by which huggingface_hub finds another hub."""
HUB: Final = "https://huggingface.co"
REPLACED: Final = ("data/*", "schemas/*")
"""Patterns of files that leave the repository when the dataset no longer has them."""
_REPOSITORY = re.compile(r"[A-Za-z0-9][\w.-]{0,95}/[A-Za-z0-9][\w.-]{0,95}")


@dataclass(frozen=True, slots=True)
class UploadPlan:
    """Files of a dataset, and the repository that they are to go to."""

    folder: Path
    """Folder of the dataset."""
    repository: str
    """Repository, as `user/name`."""
    private: bool
    """Whether a repository that is made is private."""
    files: tuple[str, ...]
    """Names of the files, relative to the folder: those of the manifest and no others."""
    bytes: int
    """Size of the files together."""
    message: str
    """Message of the commit."""

    def summary(self) -> str:
        """Return the plan as text: place, files, size, commit."""
        groups = Counter(name.partition("/")[0] + "/" * ("/" in name) for name in self.files)
        named = ", ".join(
            f"{group} ({count})" if group.endswith("/") else group
            for group, count in sorted(groups.items())
        )
        kind = "private" if self.private else "public"
        return "\n".join(
            (
                f"from     {self.folder}",
                f"to       {hub_address()}/datasets/{self.repository}",
                f"         (made {kind} if it is not there; data/ and schemas/ are replaced)",
                f"files    {len(self.files)}, {self.bytes / 1e6:.1f} MB: {named}",
                f"commit   {self.message}",
            )
        )


def hub_address() -> str:
    """Return the address of the hub: huggingface.co unless the environment names another one."""
    return (os.environ.get(ENDPOINT_VARIABLE) or HUB).rstrip("/")


def plan_upload(
    dataset: str | Path | None, repository: str, *, private: bool = False, message: str = ""
) -> UploadPlan:
    """Return what an upload would send; nothing is sent and nothing but the folder is needed.

    Parameters
    ----------
    dataset
        Folder of a finished dataset, as `load_dataset` takes it.
    repository
        Repository of the hub, as `user/name`.
    private
        Whether a repository that is made is private.
    message
        Message of the commit; not given: the numbers of scenes and episodes.

    Raises
    ------
    CorruptDataError
        There is no dataset, or a file is missing, truncated or edited.
    UsageError
        The repository's name is none, or the dataset is in a bucket.
    """
    if not _REPOSITORY.fullmatch(repository):
        raise UsageError(f"repository {repository!r}: expected USER/NAME, as in me/my-houses")
    folder = folder_to_read(dataset)
    if not isinstance(store := store_of(folder), FolderStore):
        raise UsageError(
            f"{store.at('')}: upload sends a folder: copy the dataset into one (`aws s3 sync`)"
        )
    manifest = read_manifest(folder)
    damage = find_damage(store)
    if damage is not None:
        raise CorruptDataError(
            f"{folder / damage.paths[0]}: edited or damaged since the dataset was made or missing: "
            "nothing was uploaded; `internav-gen generate` with the same options writes it again"
        )
    names = manifest.paths() | _unlisted(folder, manifest)
    return UploadPlan(
        folder,
        repository,
        private,
        tuple(sorted(names)),
        sum((folder / name).stat().st_size for name in names),
        message or _message(manifest),
    )


def _unlisted(folder: Path, manifest: Manifest) -> set[str]:
    """Return the files that an earlier release put beside data without listing them."""
    if manifest.metadata is not None:
        return set()
    return {name for name in METADATA if (folder / name).is_file()}


def _message(manifest: Manifest) -> str:
    scenes = sum(count.scenes for count in manifest.counts.values())
    episodes = sum(count.episodes for count in manifest.counts.values())
    return (
        f"{manifest.generator} {manifest.generator_version}: {episodes:,} episodes in {scenes:,} "
        f"scenes, seed {manifest.seed}"
    )


def upload(plan: UploadPlan) -> str:
    """Send a plan's files in one commit, and return the address of the repository.

    The token is huggingface_hub's: that of `hf auth login`, or the environment's HF_TOKEN.

    Raises
    ------
    ModuleNotFoundError
        huggingface_hub is missing.
    UsageError
        There is no token, or the hub refuses or does not answer.
    """
    require("huggingface_hub")
    import huggingface_hub  # noqa: PLC0415 - for this alone

    if huggingface_hub.get_token() is None:
        raise UsageError(
            "no token of the hub: run `hf auth login`, or set HF_TOKEN to one that may write"
        )
    try:
        _send(huggingface_hub.HfApi(endpoint=hub_address()), plan)
    except Exception as error:
        if not _is_the_hubs(error):
            raise
        said = " ".join(str(error).split())[:300]
        raise UsageError(
            f"{hub_address()} did not take {plan.repository}: {said}: see that it can be "
            "reached and that the token may write there, then upload again"
        ) from error
    return f"{hub_address()}/datasets/{plan.repository}"


def _send(api: Any, plan: UploadPlan) -> None:  # noqa: ANN401 - of an optional package
    api.create_repo(plan.repository, repo_type="dataset", private=plan.private, exist_ok=True)
    api.upload_folder(
        repo_id=plan.repository,
        repo_type="dataset",
        folder_path=str(plan.folder),
        allow_patterns=list(plan.files),
        delete_patterns=list(REPLACED),
        commit_message=plan.message,
    )


def _is_the_hubs(error: Exception) -> bool:
    """Return whether an error is the hub's or the network's, and no bug of ours."""
    modules = {each.__module__.partition(".")[0] for each in type(error).__mro__}
    return isinstance(error, OSError) or bool(
        modules & {"huggingface_hub", "httpx", "httpx2", "httpcore2", "requests"}
    )
