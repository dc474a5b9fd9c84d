"""Several processes that train one agent, each in its share of the environments (`torchrun`).

Every rank holds the same parameters and takes the same steps: whatever an update averages is a sum
over all ranks (`ppo.update`). The first one writes what there is to write.
"""

from __future__ import annotations

import json
import os
from datetime import timedelta
from typing import TYPE_CHECKING, Any

import torch
from torch import distributed

from internav_data.camp.ppo import alone
from internav_data.records.errors import UsageError

if TYPE_CHECKING:
    from torch import Tensor

    from internav_data.camp.ppo import Reduce


_PATIENCE_H = 6
"""Hours that ranks wait for each other: the first one alone validates."""


class DistributedContext:
    """Where a process is among those that train together; alone unless `torchrun` started it.

    Parameters
    ----------
    device
        Where tensors that travel lie.
    rank, size
        Of this process, and of all.
    """

    def __init__(self, device: torch.device, rank: int = 0, size: int = 1) -> None:
        self.device, self.rank, self.size = device, rank, size

    @property
    def first(self) -> bool:
        """Whether it is this one that writes."""
        return self.rank == 0

    @property
    def reduce(self) -> Reduce:
        """What adds over all ranks."""
        return alone if self.size == 1 else self.sum

    def share(self, count: int, what: str) -> range:
        """Return this rank's numbers of `count` environments.

        Raises
        ------
        UsageError
            They cannot be shared out evenly.
        """
        if count % self.size:
            raise UsageError(
                f"{what} is {count}: {self.size} processes share environments out evenly, so it "
                f"must be a multiple of {self.size}"
            )
        own = count // self.size
        return range(self.rank * own, (self.rank + 1) * own)

    def sum(self, tensor: Tensor) -> Tensor:
        """Return a tensor added up over all ranks, without gradient."""
        whole = tensor.detach().to(self.device, copy=True)
        distributed.all_reduce(whole)
        return whole.to(tensor.device)

    def most(self, value: int) -> int:
        """Return the greatest of a number over all ranks."""
        if self.size == 1:
            return value
        greatest = torch.tensor(value, device=self.device)
        distributed.all_reduce(greatest, distributed.ReduceOp.MAX)
        return int(greatest)

    def joined(self, tensor: Tensor, dim: int = 0) -> Tensor:
        """Return the ranks' tensors of equal shape, one after another along a dimension."""
        if self.size == 1:
            return tensor
        own = tensor.contiguous().to(self.device)
        sent = own.to(torch.uint8) if own.dtype == torch.bool else own
        found = [torch.empty_like(sent) for _ in range(self.size)]
        distributed.all_gather(found, sent)
        return torch.cat(found, dim).to(tensor.device, tensor.dtype)

    def listed(self, items: list[Any]) -> list[Any]:
        """Return the ranks' lists of plain JSON, joined in their order."""
        if self.size == 1:
            return items
        own = torch.frombuffer(bytearray(json.dumps(items).encode()), dtype=torch.uint8)
        lengths = self.joined(torch.tensor([len(own)])).tolist()
        padded = torch.zeros(max(lengths), dtype=torch.uint8)
        padded[: len(own)] = own
        rows = self.joined(padded.unsqueeze(0))
        texts = [bytes(row[:length].tolist()) for row, length in zip(rows, lengths, strict=True)]
        return [item for text in texts for item in json.loads(text)]


def ranks_of(device: torch.device) -> DistributedContext:
    """Return this process among its ranks, and meet the others.

    `torchrun` says who it is by the environment variables RANK, WORLD_SIZE and LOCAL_RANK.
    """
    size = int(os.environ.get("WORLD_SIZE", "1"))
    if size == 1:
        return DistributedContext(device)
    if device.type == "cuda":
        device = torch.device("cuda", int(os.environ.get("LOCAL_RANK", "0")))
        torch.cuda.set_device(device)
    if not distributed.is_initialized():
        backend = "nccl" if device.type == "cuda" else "gloo"
        distributed.init_process_group(backend, timeout=timedelta(hours=_PATIENCE_H))
    return DistributedContext(device, distributed.get_rank(), size)


def device_of(name: str) -> torch.device:
    """Return "cpu" or "cuda"; "auto" is a GPU where there is one.

    Raises
    ------
    UsageError
        There is no GPU.
    """
    there = torch.cuda.is_available()
    if name == "cuda" and not there:
        raise UsageError("--device cuda: torch finds no GPU here; choose --device cpu")
    return torch.device("cuda" if name != "cpu" and there else "cpu")


def default_preset(device: str) -> str:
    """Return the preset that suits this machine: `paper` where there is a GPU, else `small`."""
    return "paper" if device != "cpu" and torch.cuda.is_available() else "small"
