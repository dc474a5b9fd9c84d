"""Distributed training: several processes train one agent, each in its share of the environments.

`torchrun` starts them. Every rank holds the same parameters and takes the same steps, as each mean
of an update is a sum across ranks (`ppo.update`). The first rank writes the run's files.
"""

from __future__ import annotations

import atexit
import gc
import os
from datetime import timedelta
from typing import Any

import torch
from torch import Tensor, distributed

from internav_data.camp.ppo import Reduce, alone
from internav_data.records.errors import UsageError

_TIMEOUT_H = 6
"""Hours that ranks wait for each other: the first one alone validates."""


class DistributedContext:
    """Rank of this process among those that train together; 0 of 1 unless `torchrun` started it.

    Parameters
    ----------
    device
        Device of the tensors that ranks exchange.
    rank, size
        Number of this process, and of all.
    """

    def __init__(self, device: torch.device, rank: int = 0, size: int = 1) -> None:
        self.device, self.rank, self.size = device, rank, size

    @property
    def first(self) -> bool:
        """Whether this rank writes the run's files."""
        return self.rank == 0

    @property
    def reduce(self) -> Reduce:
        """All-reduce sum across ranks, of tensors of any shape."""
        return alone if self.size == 1 else self.all_reduce

    def share(self, count: int, setting: str) -> range:
        """Return this rank's numbers of `count` environments.

        Raises
        ------
        UsageError
            The number, of a named setting, is no multiple of the number of ranks.
        """
        if count % self.size:
            raise UsageError(
                f"{setting} is {count}: {self.size} processes share environments out evenly, so it "
                f"must be a multiple of {self.size}"
            )
        own = count // self.size
        return range(self.rank * own, (self.rank + 1) * own)

    def all_reduce(self, tensor: Tensor) -> Tensor:
        """Return the sum of a tensor of any shape across ranks, without gradient."""
        total = tensor.detach().to(self.device, copy=True)
        distributed.all_reduce(total)
        return total.to(tensor.device)

    def all_gather(self, tensor: Tensor, dim: int = 0) -> Tensor:
        """Return the ranks' tensors of equal shape, concatenated along a dimension."""
        if self.size == 1:
            return tensor
        own = tensor.contiguous().to(self.device)
        sent = own.to(torch.uint8) if own.dtype == torch.bool else own
        found = [torch.empty_like(sent) for _ in range(self.size)]
        distributed.all_gather(found, sent)
        return torch.cat(found, dim).to(tensor.device, tensor.dtype)

    def all_gather_items(self, items: list[Any]) -> list[Any]:
        """Return the ranks' lists, concatenated in the order of ranks."""
        found: list[list[Any]] = [items] * self.size
        if self.size > 1:
            distributed.all_gather_object(found, items)
        return [item for own in found for item in own]


def distributed_context(device: torch.device) -> DistributedContext:
    """Return this process among its ranks, once all have met.

    `torchrun` sets the environment variables RANK, WORLD_SIZE and LOCAL_RANK.
    """
    size = int(os.environ.get("WORLD_SIZE", "1"))
    if size == 1:
        return DistributedContext(device)
    if device.type == "cuda":
        device = torch.device("cuda", int(os.environ.get("LOCAL_RANK", "0")))
        torch.cuda.set_device(device)
    if not distributed.is_initialized():
        backend = "nccl" if device.type == "cuda" else "gloo"
        distributed.init_process_group(backend, timeout=timedelta(hours=_TIMEOUT_H))
        atexit.register(_leave)
    return DistributedContext(device, distributed.get_rank(), size)


def _leave() -> None:
    """Leave the process group: its threads must have ended before the interpreter does.

    They end with the last reference to it, and one in a cycle may live on.
    """
    distributed.destroy_process_group()
    gc.collect()


def is_first_rank() -> bool:
    """Return whether this process is the only rank or the first, before the ranks have met."""
    return os.environ.get("RANK", "0") == "0"


def device_of(name: str) -> torch.device:
    """Return the device "cpu" or "cuda"; "auto" is a GPU where there is one.

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
    """Return the preset that suits this machine: `paper` with a GPU, else `small`."""
    return "paper" if device != "cpu" and torch.cuda.is_available() else "small"
