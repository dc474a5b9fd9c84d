"""Environment slots: the order of episodes, the run of the present one, and its snapshot."""

from __future__ import annotations

import contextlib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final, TypedDict, cast

from internav_data.envs.auxiliary import next_start
from internav_data.envs.episode import WHOLE, EpisodeRun, check_actions
from internav_data.envs.sensors import observed
from internav_data.envs.source import HOUSE_CACHE_SIZE, LOADED_HOUSES, Source, open_source
from internav_data.envs.tasks import TASKS, Task, TaskConfig
from internav_data.records.errors import CorruptDataError, UsageError

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence
    from pathlib import Path

    from internav_data.dataset import Dataset
    from internav_data.envs.house_map import Privilege
    from internav_data.envs.order import EpisodeOrder
    from internav_data.envs.sensors import Observation, Sensor
    from internav_data.envs.tasks import TaskStep
    from internav_data.records import Episode, PushModel
    from internav_data.world.config import Hands


class Arguments(TypedDict, total=False):
    """Arguments of all environments; `docs/environment.md` has them with their defaults."""

    split: str | None
    filters: list[tuple[str, str, object]] | None
    agreed_only: bool
    task: str | type[Task] | Sequence[str | type[Task]]
    max_steps: int
    failed_done_reward: float
    push_model: PushModel
    hands: Hands
    episodes_per_house: int
    shuffle: bool
    house_cache_size: int
    observation: Observation
    map_occlusion: bool
    privileged: Sequence[Privilege]


_OWN_ARGUMENTS: Final = ("dataset", "image_size", "render_mode", "sensors")
"""Arguments that environments take besides, each by itself."""
_MAX_ACTIONS: Final = 100_000
"""Number of actions of a snapshot that are read: more are no episode."""


@dataclass(frozen=True, slots=True)
class EpisodeSnapshot:
    """Episode, actions and place in the order: any process can rebuild an environment from it."""

    episode_id: str
    actions: tuple[int, ...]
    """Actions so far; -1 waits."""
    seed: int
    """Seed of the order of episodes."""
    position: int
    """Position in that order of the episode that comes next."""
    start: tuple[int, int, int] | None = None
    """Node i, j and quarter turn, where it did not begin at the episode's own start."""

    @staticmethod
    def from_json(values: Mapping[str, Any]) -> EpisodeSnapshot:
        """Read a snapshot that `dataclasses.asdict` and JSON have written.

        Raises
        ------
        CorruptDataError
            A value is missing or of another type.
        """
        try:
            actions = tuple(int(action) for action in values["actions"][:_MAX_ACTIONS])
            start = values["start"]
            node = None if start is None else (int(start[0]), int(start[1]), int(start[2]))
            seed, position = int(values["seed"]), int(values["position"])
            return EpisodeSnapshot(str(values["episode_id"]), actions, seed, position, node)
        except (KeyError, TypeError, ValueError, IndexError, OverflowError) as error:
            raise CorruptDataError(
                f"environments: {error!r}: no state of an environment"
            ) from error


class EnvSlot:
    """One environment of a batch, without its pictures.

    Parameters
    ----------
    source
        Episodes.
    task
        Reward, end and metrics of each episode.
    config
        Settings of the task.
    episodes_per_house
        Episodes of one house in a row.
    shuffle
        Whether houses are shuffled; False keeps the order on disk.
    """

    __slots__ = (
        "_config",
        "_current",
        "_episodes_per_house",
        "_order",
        "_position",
        "_seed",
        "_shuffle",
        "_task",
        "source",
    )

    def __init__(
        self,
        source: Source,
        task: type[Task],
        config: TaskConfig,
        *,
        episodes_per_house: int,
        shuffle: bool,
    ) -> None:
        self.source, self._task, self._config = source, task, config
        # Few episodes have an obstacle to push: those tasks take any house next.
        beside = task.start_beside is not None
        self._episodes_per_house = 1 if beside else episodes_per_house
        self._shuffle = shuffle or beside
        self._order: EpisodeOrder | None = None
        self._seed = self._position = 0
        self._current: EpisodeRun | None = None

    @staticmethod
    def make(
        count: int, dataset: str | Path | Dataset[Episode], arguments: Arguments
    ) -> list[EnvSlot]:
        """Make slots that share one source.

        Raises
        ------
        UsageError
            An argument is out of its bounds or unknown.
        """
        _check_names(arguments)
        episodes_per_house = arguments.get("episodes_per_house", 4)
        kept = arguments.get("house_cache_size", HOUSE_CACHE_SIZE)
        if min(count, episodes_per_house, kept) < 1:
            raise UsageError(
                f"num_envs, episodes_per_house and house_cache_size: expected at least 1 each, "
                f"got {count}, {episodes_per_house} and {kept}"
            )
        tasks = task_classes(arguments, count)
        LOADED_HOUSES.capacity = max(LOADED_HOUSES.capacity, kept)
        source = open_source(
            dataset,
            arguments.get("split"),
            arguments.get("filters"),
            agreed_only=arguments.get("agreed_only", False),
        )
        world = source.world_config
        if "push_model" in arguments:
            world = replace(world, push_model=arguments["push_model"])
        if "hands" in arguments:
            world = replace(world, hands=arguments["hands"])
        config = TaskConfig(
            arguments.get("max_steps", TaskConfig().max_steps),
            arguments.get("failed_done_reward", 0.0),
            world,
        )
        config.check()
        shuffle = arguments.get("shuffle", True)
        return [
            EnvSlot(source, task, config, episodes_per_house=episodes_per_house, shuffle=shuffle)
            for task in tasks
        ]

    @property
    def ordered(self) -> bool:
        """Whether the slot has an order of episodes."""
        return self._order is not None

    @property
    def has_episode(self) -> bool:
        """Whether an episode is under way or over."""
        return self._current is not None

    @property
    def run(self) -> EpisodeRun:
        """Run of the present episode.

        Raises
        ------
        UsageError
            No episode has begun.
        """
        if self._current is None:
            raise UsageError("InterNav: nothing is played yet; call reset() first")
        return self._current

    def seed(self, seed: int) -> None:
        """Start an order of episodes from its beginning."""
        self._seed, self._position = int(seed), self._task.first_position
        self._order = self.source.order(
            self._seed, episodes_per_house=self._episodes_per_house, shuffle=self._shuffle
        )

    def begin(
        self,
        episode_id: str | None = None,
        actions: Iterable[int] = (),
        start: Sequence[int] | None = None,
    ) -> EpisodeRun:
        """Begin the next episode, or a named one, which leaves the order as it is.

        Parameters
        ----------
        episode_id
            Id of an episode; None for the next of the order.
        actions
            Actions to take at once.
        start
            Node i, j and quarter turn, for a named episode alone; None for the start that the task
            chooses.

        Raises
        ------
        UsageError
            No such episode, or no order yet.
        """
        if episode_id is not None:
            number = self.source.number_of(episode_id)
        else:
            number, start = self._next()
        episode, assets = self.source.episode(number), self.source.dataset.assets
        loaded_house = self.source.loaded_house(episode)
        run = EpisodeRun(
            *(episode, loaded_house, assets, self._config, start, self._task),
            stored_outcomes=self.source.outcomes_hold(self._config.world),
        )
        for action in actions:
            run.step(int(action))
        self._current = run
        return run

    def state(self) -> EpisodeSnapshot:
        """Return a snapshot of the environment."""
        run = self.run
        return EpisodeSnapshot(
            run.episode.episode_id, tuple(run.actions), self._seed, self._position, run.start
        )

    def restore(self, state: EpisodeSnapshot) -> EpisodeRun:
        """Become the environment of a snapshot."""
        self.seed(state.seed)
        self._position = state.position
        return self.begin(state.episode_id, state.actions, state.start)

    def _next(self) -> tuple[int, Sequence[int] | None]:
        """Return the number of the next episode, and its start (None for the episode's own)."""
        if self._order is None:
            raise UsageError("InterNav: no order of episodes yet; call reset() first")
        kind = self._task.start_beside
        if kind is None:
            self._position += 1
            return self._order.number(self._position - 1), None
        number, start, self._position = next_start(
            self.source, self._order, self._seed, self._position, kind
        )
        return number, (start.i, start.j, start.quarter)


def task_classes(arguments: Mapping[str, Any], count: int) -> list[type[Task]]:
    """Return the task of each environment: one for all, or one each, by name or as a class.

    Raises
    ------
    UsageError
        There is no such task, or another number of them.
    """
    given = arguments.get("task", "interactive")
    each = [given] * count if isinstance(given, str | type) else list(given)
    tasks = [TASKS.get(task) if isinstance(task, str) else task for task in each]
    if len(tasks) != count or not all(isinstance(t, type) and issubclass(t, Task) for t in tasks):
        raise UsageError(
            f"task: expected one of {list(TASKS)}, a subclass of Task, or {count} of them; "
            f"got {given!r}"
        )
    return cast("list[type[Task]]", tasks)


def take_sensors(
    sensors: Sequence[str | Sensor] | None, arguments: Arguments
) -> Sequence[str | Sensor]:
    """Return an environment's sensors; take `observation` and what belongs to it out of arguments.

    Raises
    ------
    UsageError
        Both `sensors` and `observation` are given, or one of them cannot be.
    """
    given = arguments.keys() & {"observation", "map_occlusion", "privileged"}
    if sensors is not None and given:
        raise UsageError(f"{min(given)}: sensors are given, too; leave one of them out")
    found = observed(
        arguments.pop("observation", "camera"),
        map_occlusion=arguments.pop("map_occlusion", False),
        privileged=arguments.pop("privileged", ()),
    )
    return found if sensors is None else sensors


def step_info(run: EpisodeRun, step: TaskStep) -> dict[str, Any]:
    """Return the `info` of a step; with metrics at an episode's end."""
    last = run.last
    if last is None:
        return {}
    info: dict[str, Any] = {
        "action_success": last.success,
        "reason": last.reason,
        "target": last.target,
    }
    if step.terminated or step.truncated:
        info["metrics"] = run.task.metrics()
    return info


def check_render_mode(render_mode: str | None) -> None:
    """Refuse what `render` cannot do.

    Raises
    ------
    UsageError
        It is neither None nor "rgb_array".
    """
    if render_mode not in {None, "rgb_array"}:
        raise UsageError(f"render_mode: expected None or 'rgb_array', got {render_mode!r}")


def check_options(options: Mapping[str, Any] | None, known: tuple[str, ...]) -> dict[str, Any]:
    """Return the options of `reset`.

    Raises
    ------
    UsageError
        An option is unknown, or needs an episode's id.
    """
    if options is None:
        return {}
    if not isinstance(options, Mapping):
        raise UsageError(f"options: expected a dictionary, got {type(options).__name__}")
    unknown = sorted(set(options) - set(known), key=str)
    if unknown:
        raise UsageError(f"options: no option {unknown[0]!r}; there are {list(known)}")
    for name in ("actions", "start"):
        if name in options and options.get("episode_id") is None:
            raise UsageError(f"options[{name!r}]: say of which episode, by options['episode_id']")
    return dict(options)


def check_seed(seed: object) -> int | None:
    """Return a seed as an integer; None stays.

    Raises
    ------
    UsageError
        It is no whole number of 0 or more.
    """
    if seed is None:
        return None
    if not isinstance(seed, WHOLE) or seed < 0:
        raise UsageError(f"seed: expected a whole number of 0 or more, got {seed!r}")
    return int(seed)


def check_choice(
    episode_id: str | None, actions: object, start: object
) -> tuple[list[int], tuple[int, int, int] | None]:
    """Return the actions to take at once and the start that `reset` is asked for in one slot.

    Raises
    ------
    UsageError
        The actions or the start are wrong, or the start comes without an episode's id.
    """
    name = "options['actions']"
    taken = check_actions(as_list(actions, name, "a list of actions"), name)
    if start is None:
        return taken, None
    name = "options['start']"
    if episode_id is None:
        raise UsageError(f"{name}: say of which episode, by options['episode_id']; got {start!r}")
    node = as_list(start, name, "(i, j, quarter)")
    if len(node) != 3 or not all(isinstance(number, WHOLE) for number in node):  # noqa: PLR2004
        raise UsageError(f"{name}: expected (i, j, quarter), whole numbers; got {start!r}")
    return taken, (int(node[0]), int(node[1]), int(node[2]))


def as_list(values: object, name: str, expected: str) -> list[Any]:
    """Return the elements of a list, tuple, array or other iterable; text is none.

    Raises
    ------
    UsageError
        It has no elements.
    """
    if not isinstance(values, str):
        with contextlib.suppress(TypeError):
            return list(cast("Iterable[Any]", values))
    raise UsageError(f"{name}: expected {expected}, got {values!r}")


def _check_names(arguments: Mapping[str, Any]) -> None:
    known = Arguments.__annotations__
    unknown = sorted(set(arguments) - set(known))
    if unknown:
        raise UsageError(
            f"InterNav: no argument {unknown[0]!r}; there are {sorted({*known, *_OWN_ARGUMENTS})}"
        )
