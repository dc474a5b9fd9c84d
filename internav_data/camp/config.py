"""Hyperparameters of training with their meanings and bounds; the presets `paper` and `small`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Final, Literal

from internav_data.core import config as values
from internav_data.core.config import MAX_SEED, Bounds, check_bounds
from internav_data.records.errors import UsageError

ExpertColumn = Literal["expert", "blind_expert"]
"""Column of episodes that holds the expert to clone."""
Intent = Literal["integrated", "policy", "recursive", "none"]
TrainPreset = Literal["paper", "small"]
INTERACTION_ACTIONS: Final = 11
"""Maximum number of actions of an interaction (the released code cuts after more than 10)."""
_PAPER_PIXELS: Final = 36
"""Least size of pictures of which the encoder of the paper leaves anything."""


@dataclass(frozen=True, slots=True)
class NetworkConfig:
    """Sizes of the networks."""

    image_size: Annotated[int, Bounds(16, 1024)] = 64
    """Size of the camera's pictures, pixels a side."""
    observation: Literal["camera", "map"] = "camera"
    """Pictures, or a map of the house around the agent (docs/environment.md): for research on
    interaction rather than on seeing."""
    map_occlusion: bool = False
    """Show only what the agent has seen so far on the map."""
    privileged: tuple[Literal["mass", "movable"], ...] = ()
    """Hidden attributes that the map shows besides, for oracles; every table names them."""
    encoder: TrainPreset = "small"
    """"paper": one network for colour and one for depth, fused; "small": one network
    over all four channels."""
    hidden: Annotated[int, Bounds(1, 8192)] = 128
    """Number of features of an encoder, and of units of each GRU."""
    goal_embedding: Annotated[int, Bounds(1, 8192)] = 32
    """Length of the embedded point goal (distance, cos bearing, sin bearing)."""
    shared_encoder: bool = True
    """One encoder for all policies; False: one for Navigate, intent and global, one for Push, one
    for Pick."""
    bf16: bool = True
    """Run encoders in bfloat16 on a GPU; GRUs, heads and losses always use float32."""
    depth_limit_m: Annotated[float, Bounds(0.1, 1000.0)] = 10.0
    """Depth beyond which distances are cut, and by which they are divided."""
    goal_scale_m: Annotated[float, Bounds(0.1, 1000.0)] = 1.0
    """Divisor of the goal's distance. At 10 the last 0.25 m before the goal hardly show, and clones
    end their episodes at a certain time rather than at the goal."""


@dataclass(frozen=True, slots=True)
class AgentConfig:
    """Agent hyperparameters common to all methods."""

    intent: Intent = "integrated"
    """Intent input of the global policy (Table 4): the integrated intent of equation (7); the
    intent policy's option probabilities; equation (7) run twice; or the uniform intent."""
    sync_every: Annotated[int, Bounds(1)] = 3
    """Rollouts between copies of the global policy into the intent policy (K)."""
    hand_back_step: bool = False
    """Let Push and Pick end by an action of their own that waits a step (-0.01). False: their Done
    is the option's termination, drawn on arrival at a state, and costs no step."""
    forbidden: tuple[Literal["push", "pick"], ...] = ()
    """Options that are never opened."""
    initial_done_probability: Annotated[float, Bounds(1e-6, 0.5)] = 0.01
    """Initial probability that a decision ends the episode, the same for every agent. Uniform heads
    would end episodes after about ten steps."""
    initial_interaction_probability: Annotated[float, Bounds(1e-6, 0.49)] = 0.045
    """Initial probability of Push, and of Pick, among the options that do not end the episode;
    Navigate has the rest."""
    nie_objects: Annotated[int, Bounds(1, 64)] = 6
    """Number of objects that `nie` takes: the nearest in sight."""
    nie_weight: Annotated[float, Bounds(0.0)] = 3.0
    """Weight of the L1 loss on `nie`'s predicted keypoints (released code)."""


@dataclass(frozen=True, slots=True)
class PPOConfig:
    """PPO hyperparameters."""

    num_envs: Annotated[int, Bounds(1, 65536)] = 16
    """Number of environments that are stepped side by side."""
    num_steps: Annotated[int, Bounds(1)] = 64
    """Number of steps of each environment in a rollout."""
    update_epochs: Annotated[int, Bounds(1)] = 3
    """Passes over a rollout (the paper's k)."""
    num_minibatches: Annotated[int, Bounds(1)] = 4
    """Number of minibatches a pass, each of whole environments."""
    chunk_steps: Annotated[int, Bounds(0)] = 16
    """Number of steps of a chunk, or more than `num_steps`; 0 for whole rollouts. Chunks are
    replayed side by side from the hidden states of the collection, and no gradient leaves one."""
    clip_coef: Annotated[float, Bounds(0.0)] = 0.2
    """Distance of the probability ratio from 1 beyond which it is clipped."""
    clip_vloss: bool = False
    """Clip values by `clip_coef` too. 0.1 against returns near 10 throttles the critic."""
    vf_coef: Annotated[float, Bounds(0.0)] = 0.5
    """Weight of the value loss, half the squared error of values."""
    scale_values: bool = True
    """Divide the value loss by the running variance of returns. Against returns near 10 its
    gradient takes nearly all that `max_grad_norm` leaves, and most where an episode succeeds."""
    ent_coef: Annotated[float, Bounds(0.0)] = 0.01
    """Weight of the entropy bonus."""
    gamma: Annotated[float, Bounds(0.0, 1.0)] = 0.99
    """Discount a step."""
    gae_lambda: Annotated[float, Bounds(0.0, 1.0)] = 0.95
    """Decay of generalised advantages (lambda)."""
    adam_eps: Annotated[float, Bounds(0.0, exclusive=True)] = 1e-5
    """Epsilon of Adam: gradients far below it make small steps."""
    max_grad_norm: Annotated[float, Bounds(0.0)] = 0.5
    """Maximum norm of the gradient; longer ones are clipped."""
    target_kl: Annotated[float | None, Bounds(0.0)] = 0.03
    """KL divergence from the rollout's policy beyond which an update stops, before the step whose
    minibatch exceeds it; none for no such limit."""
    normalise_advantages: bool = True
    """Normalise advantages to mean 0 and deviation 1, over a rollout."""
    critic_warmup_rollouts: Annotated[int, Bounds(0)] = 10
    """Critic warm-up: number of first rollouts of a new critic that train the critic alone."""


@dataclass(frozen=True, slots=True)
class CloningConfig:
    """Cloning the dataset's expert (`--pretrain bc`)."""

    expert: ExpertColumn = "expert"
    """Expert to clone: the one that knows everything, or, where the dataset holds it, the one that
    learns by failing (`generate --blind-expert`)."""
    frames: Annotated[int, Bounds(1)] = 150_000
    """Number of expert frames in an epoch; the stage replays them `epochs` times."""
    epochs: Annotated[int, Bounds(1)] = 4
    """Passes over the frames."""
    num_envs: Annotated[int, Bounds(1, 65536)] = 16
    """Number of experts that are replayed side by side."""
    num_steps: Annotated[int, Bounds(1)] = 16
    """Number of frames of each in an update; hidden states go on from one update to the next."""
    learning_rate: Annotated[float, Bounds(0.0)] = 1e-3
    """Initial learning rate of Adam; decays linearly to 0."""
    sync_every: Annotated[int, Bounds(1)] = 100
    """Updates between copies of the global policy into the intent policy."""


@dataclass(frozen=True, slots=True)
class StagesConfig:
    """Environment steps, and the stages' shares of them; steps in auxiliary tasks count."""

    total_timesteps: Annotated[int, Bounds(1)] = 300_000
    """Number of environment steps of all stages together, the same for every method."""
    extra_timesteps: Annotated[int, Bounds(0)] = 0
    """Number of environment steps on top, all in the last stage: `--resume` with more `--steps`
    sets it, and leaves the stages before as long as they were."""
    auxiliary_share: Annotated[float, Bounds(0.0, 1.0)] = 0.1
    """Share of the steps in the three auxiliary tasks; for flat methods, on the main task in
    single rooms."""
    min_auxiliary_timesteps: Annotated[int, Bounds(0)] = 1_000_000
    """Number of environment steps below which a run has no auxiliary stage: in a short one most
    of its rollouts train the critics alone."""
    single_room_share: Annotated[float, Bounds(0.0, 1.0)] = 0.1
    """Share of the steps of joint training in scenes of a single room."""
    side_by_side: bool = True
    """Train the auxiliary tasks at once, environments split in three; False: one by one."""
    learning_rate: Annotated[float, Bounds(0.0)] = 3e-4
    """Initial learning rate of auxiliary stages and of flat methods."""
    joint_learning_rate: Annotated[float, Bounds(0.0)] = 1e-4
    """Initial learning rate of a hierarchy's joint training."""
    decay_over: Literal["stage", "all"] = "stage"
    """Span over which the learning rate decays to 0: each stage, or all steps. Each stage has a
    fresh Adam."""


@dataclass(frozen=True, slots=True)
class DataConfig:
    """Selection of episodes, and their rewards."""

    filter: tuple[str, ...] = ()
    """Conditions on columns that all must hold, as "shortest_path_m<=6": training, validation."""
    failed_done_reward: Annotated[float, Bounds(-1000.0, 1000.0)] = 0.0
    """Reward of Done away from the goal (-1 in the released configuration)."""
    house_cache_size: Annotated[int, Bounds(1)] = 512
    """Number of loaded houses that a process caches; those of 1 to 3 rooms take 10 ms and 0.1 MB
    each, and the distances to each of their goals besides."""


@dataclass(frozen=True, slots=True)
class RunConfig:
    """Settings of a run that are no hyperparameters."""

    max_steps: Annotated[int, Bounds(1, 10_000)] = 500
    """Number of steps after which an episode is cut off, in validation too."""
    threads: Annotated[int, Bounds(1, 1024)] = 1
    """Number of torch's threads on a CPU; with one, equal runs are equal to the last bit."""
    workers: Annotated[int, Bounds(0, 1024)] = 0
    """Number of processes that step environments; 0 for this one alone, which is nearly as fast on
    two cores (106 s against 98 s with two, 48,000 steps of CaMP) and leaves one for another run."""
    checkpoint_every: Annotated[int, Bounds(1)] = 10
    """Number of updates between checkpoints."""
    validate_every: Annotated[int, Bounds(0)] = 50
    """Number of updates of a stage between validations, 0 for none in between; stages of the main
    task end with one."""
    validation_episodes: Annotated[int, Bounds(0)] = 64
    """Number of episodes of the validation split that are played, always the same; 0 for no
    validation."""
    window: Annotated[int, Bounds(1, 10_000)] = 100
    """Number of episodes of a logged mean: the last ones that ended."""
    tensorboard: bool = True
    """Write TensorBoard's files too, where `tensorboard` is installed."""


@dataclass(frozen=True, slots=True)
class CampConfig:
    """Training config: equal configs, seeds and datasets give equal runs on one thread."""

    seed: Annotated[int, Bounds(0, MAX_SEED)] = 0
    """Seed that every random number derives from."""
    mine: Mapping[str, Annotated[float, Bounds(-1e6, 1e6)]] = field(default_factory=dict)
    """Hyperparameters of an agent of your own, by name (`--set mine.width=3`)."""
    network: NetworkConfig = field(default_factory=NetworkConfig)
    """Sizes of the networks."""
    agent: AgentConfig = field(default_factory=AgentConfig)
    """Agent hyperparameters common to all methods."""
    ppo: PPOConfig = field(default_factory=PPOConfig)
    """PPO hyperparameters."""
    cloning: CloningConfig = field(default_factory=CloningConfig)
    """Cloning the expert."""
    stages: StagesConfig = field(default_factory=StagesConfig)
    """Environment steps, and the stages' shares of them."""
    data: DataConfig = field(default_factory=DataConfig)
    """Selection of episodes, and their rewards."""
    run: RunConfig = field(default_factory=RunConfig)
    """Settings of a run that are no hyperparameters."""

    def check(self) -> None:
        """Check all values.

        Raises
        ------
        UsageError
            A value is out of its bounds, or values contradict each other.

        """
        check_bounds(self)
        if self.ppo.num_envs % self.ppo.num_minibatches:
            raise UsageError(
                f"ppo.num_minibatches is {self.ppo.num_minibatches}: minibatches are of whole "
                f"environments, so it must divide ppo.num_envs ({self.ppo.num_envs})"
            )
        if self.ppo.num_steps % min(self.ppo.chunk_steps or 1, self.ppo.num_steps):
            raise UsageError(
                f"ppo.chunk_steps is {self.ppo.chunk_steps}: rollouts are cut into equal chunks, "
                f"so it must divide ppo.num_steps ({self.ppo.num_steps}); 0 replays whole rollouts"
            )
        an_update = self.cloning.num_envs * self.cloning.num_steps
        if self.cloning.frames < an_update:
            raise UsageError(
                f"cloning.frames is {self.cloning.frames}: one update replays {an_update} frames "
                "(cloning.num_envs x cloning.num_steps); ask for as many at least"
            )
        most = max(self.ppo.num_envs, self.cloning.num_envs)
        if self.run.workers > most:
            raise UsageError(
                f"run.workers is {self.run.workers}: there are {most} environments (ppo.num_envs) "
                f"to step; ask for {most} processes at most"
            )
        network = self.network
        if network.observation == "camera" and (network.map_occlusion or network.privileged):
            key = "privileged" if network.privileged else "map_occlusion"
            raise UsageError(
                f"network.{key}: pictures have no use for it; leave it out, or set "
                "network.observation to 'map'"
            )
        if network.encoder == "paper" and network.image_size < _PAPER_PIXELS:
            raise UsageError(
                f"network.image_size is {network.image_size}: the 'paper' encoder needs "
                f"{_PAPER_PIXELS} pixels a side at least"
            )
        shares = self.stages.auxiliary_share + self.stages.single_room_share
        if shares > 1.0:
            raise UsageError(f"stages: the shares of the first stages add up to {shares}, above 1")


def preset(name: str) -> CampConfig:
    """Return the config `paper` or `small`.

    Raises
    ------
    UsageError
        There is no such preset.
    """
    if name not in _PRESETS:
        raise UsageError(f"preset {name!r}: expected one of {', '.join(_PRESETS)}")
    return _PRESETS[name]


def from_mapping(config: CampConfig, changes: Mapping[str, Any], where: str) -> CampConfig:
    """Return a checked config with some values replaced.

    Parameters
    ----------
    config
        Config to start from.
    changes
        Values, nested by field name, as JSON or TOML give them.
    where
        Origin of the values, for error messages.

    Raises
    ------
    UsageError
        An unknown key (the nearest known one is named), a wrong type, or a value out of bounds.
    """
    changed = values.from_mapping(config, changes, where)
    changed.check()
    return changed


_PRESETS: Final = {
    "paper": CampConfig(
        network=NetworkConfig(300, encoder="paper", hidden=512, shared_encoder=False),
        ppo=PPOConfig(
            num_envs=12, num_steps=30, update_epochs=1, num_minibatches=1, chunk_steps=0,
            clip_coef=0.1, clip_vloss=True, scale_values=False,
        ),
        stages=StagesConfig(
            total_timesteps=10_000_000, min_auxiliary_timesteps=0, side_by_side=False,
            decay_over="all",
        ),
    ),
    "small": CampConfig(),
}  # fmt: skip
"""Configs by name."""


def config_of(
    name: str,
    file: Path | None = None,
    overrides: Sequence[str] = (),
    options: Mapping[str, Any] | None = None,
) -> CampConfig:
    """Return a checked config: a preset, a TOML file, options by dotted key, `a.b=c`.

    Raises
    ------
    UsageError
        A setting is unknown or out of its bounds; the message names its place.
    """
    config = preset(name)
    if file is not None:
        config = values.from_mapping(config, values.read_settings(file), str(file))
    for key, value in (options or {}).items():
        config = values.from_mapping(config, values.nested(key, value), "option")
    for override in overrides:
        config = values.updated(config, override)
    return from_mapping(config, {}, "config")
