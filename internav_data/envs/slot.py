"""Who plays on: the order of episodes, the one that is played now, and its state."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, TypedDict

from internav_data.envs.episode import EpisodeRun, TaskConfig
from internav_data.envs.source import HOUSE_CACHE_SIZE, LOADED_HOUSES, Source, open_source
from internav_data.records.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence
    from pathlib import Path

    from internav_data.dataset import Dataset
    from internav_data.envs.episode import TaskStep
    from internav_data.envs.order import EpisodeOrder
    from internav_data.records import Episode, PushModel


class Arguments(TypedDict, total=False):
    """Arguments of all environments; `docs/environment.md` has them with their defaults."""

    split: str | None
    filters: list[tuple[str, str, object]] | None
    max_steps: int
    failed_done_reward: float
    push_model: PushModel
    episodes_per_house: int
    shuffle: bool
    house_cache_size: int


_RENAMED: Final = {"houses_kept": "house_cache_size"}
"""Arguments of earlier versions, and their names today."""


@dataclass(frozen=True, slots=True)
class EpisodeSnapshot:
    """All that an environment is: from it, any process can build it again."""

    episode_id: str
    actions: tuple[int, ...]
    """So far, -1 for `wait`."""
    seed: int
    """Of the order of episodes."""
    position: int
    """In that order, of the episode that comes next."""
    start: tuple[int, int, int] | None = None
    """Node i, j and quarter turn, where it did not begin at the episode's own start."""


class EnvSlot:
    """One environment without its pictures."""

    __slots__ = (
        "_config",
        "_episodes_per_house",
        "_order",
        "_position",
        "_seed",
        "_shuffle",
        "current",
        "source",
    )

    def __init__(
        self, source: Source, config: TaskConfig, *, episodes_per_house: int, shuffle: bool
    ) -> None:
        self.source, self._config = source, config
        self._episodes_per_house, self._shuffle = episodes_per_house, shuffle
        self._order: EpisodeOrder | None = None
        self._seed = self._position = 0
        self.current: EpisodeRun | None = None

    @staticmethod
    def make(
        count: int, dataset: str | Path | Dataset[Episode], arguments: Arguments
    ) -> list[EnvSlot]:
        """Make slots that share one source.

        Raises
        ------
        UsageError
            An argument that cannot be meant, or is unknown.
        """
        unknown = sorted(set(arguments) - set(Arguments.__annotations__))
        if unknown and unknown[0] in _RENAMED:
            raise UsageError(f"InterNav: {unknown[0]} is now called {_RENAMED[unknown[0]]}")
        if unknown:
            raise UsageError(
                f"InterNav: no argument {unknown[0]!r}; there are "
                f"{sorted(Arguments.__annotations__)}"
            )
        episodes_per_house = arguments.get("episodes_per_house", 4)
        kept = arguments.get("house_cache_size", HOUSE_CACHE_SIZE)
        if min(count, episodes_per_house, kept) < 1:
            raise UsageError(
                f"num_envs, episodes_per_house and house_cache_size: expected at least 1 each, "
                f"got {count}, {episodes_per_house} and {kept}"
            )
        LOADED_HOUSES.capacity = max(LOADED_HOUSES.capacity, kept)
        source = open_source(dataset, arguments.get("split"), arguments.get("filters"))
        config = TaskConfig(
            arguments.get("max_steps", 500),
            arguments.get("failed_done_reward", 0.0),
            arguments.get("push_model", source.push_model),
        )
        config.check()
        shuffle = arguments.get("shuffle", True)
        return [
            EnvSlot(source, config, episodes_per_house=episodes_per_house, shuffle=shuffle)
            for _ in range(count)
        ]

    @property
    def ordered(self) -> bool:
        """Whether it knows its order."""
        return self._order is not None

    @property
    def run(self) -> EpisodeRun:
        """The episode being played."""
        if self.current is None:
            raise UsageError("InterNav: nothing is played yet; call reset() first")
        return self.current

    def seed(self, seed: int) -> None:
        """Start an order of episodes from its beginning."""
        self._seed, self._position = int(seed), 0
        self._order = self.source.order(
            self._seed, episodes_per_house=self._episodes_per_house, shuffle=self._shuffle
        )

    def begin(
        self,
        episode_id: str | None = None,
        actions: Iterable[int] = (),
        start: Sequence[int] | None = None,
    ) -> EpisodeRun:
        """Begin the next episode, or a named one (which leaves the order where it is)."""
        if episode_id is not None:
            number = self.source.number_of(episode_id)
        elif self._order is None:
            raise UsageError("InterNav: no order of episodes yet; call reset() first")
        else:
            number = self._order.number(self._position)
            self._position += 1
        episode = self.source.episode(number)
        loaded_house, assets = self.source.loaded_house(episode), self.source.dataset.assets
        self.current = EpisodeRun(episode, loaded_house, assets, self._config, start)
        for action in actions:
            self.current.step(int(action))
        return self.current

    def state(self) -> EpisodeSnapshot:
        """Return all that this is."""
        run = self.run
        return EpisodeSnapshot(
            run.episode.episode_id, tuple(run.actions), self._seed, self._position, run.start
        )

    def restore(self, state: EpisodeSnapshot) -> EpisodeRun:
        """Become what a state says."""
        self.seed(state.seed)
        self._position = state.position
        return self.begin(state.episode_id, state.actions, state.start)


def step_info(run: EpisodeRun, step: TaskStep) -> dict[str, Any]:
    """Return what is said about a step."""
    last = run.last
    if last is None:
        return {}
    info: dict[str, Any] = {
        "action_success": last.success,
        "reason": last.reason,
        "target": last.target,
    }
    if step.terminated or step.truncated:
        info["metrics"] = run.metrics()
    return info


def check_options(options: Mapping[str, Any] | None, known: tuple[str, ...]) -> dict[str, Any]:
    """Return reset's options, refused where they cannot be meant."""
    if options is None:
        return {}
    if not isinstance(options, Mapping):
        raise UsageError(f"options: expected a dictionary, got {type(options).__name__}")
    unknown = sorted(set(options) - set(known))
    if unknown:
        raise UsageError(f"options: no option {unknown[0]!r}; there are {list(known)}")
    for name in ("actions", "start"):
        if name in options and options.get("episode_id") is None:
            raise UsageError(f"options[{name!r}]: say of which episode, by options['episode_id']")
    return dict(options)
