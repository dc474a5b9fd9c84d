"""Training on one thread: an update against a per-sample loop, and steps a second; JSON out.

    python benchmarks/trainer.py DATASET [--methods camp,ppo] [--rollouts 3] [--out FILE]

`update`: one PPO update of CaMP at the sizes of the preset `small`, side by side with the same
arithmetic done as in the released code: a Python loop over environments and steps, each sample
through encoder, GRUs and heads for itself. First both learn from one small rollout, and must say
the same losses and gradients to 1e-4. `methods`: steps a second in three tiers (environments alone,
collecting, all of training), the shares of simulator, inference and learning, and what collecting
costs besides environments and networks. Seconds are of processor time, so that neighbours do not
count.
Targets: ten times faster; the simulator under a third; under 50 us a step and environment.
"""

from __future__ import annotations

import argparse
import json
import math
import platform
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import torch

from internav_data.camp.agents import AGENTS, make_agent
from internav_data.camp.agents.hierarchy import ACTIONS_OF, NAVIGATE, STOP
from internav_data.camp.config import from_mapping, preset
from internav_data.camp.ppo import update
from internav_data.camp.rollout import Collector, orders_of, uniforms_of
from internav_data.dataset import load_dataset
from internav_data.envs import InterNavVectorEnv

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from torch import Tensor
    from torch.optim import Optimizer

    from internav_data.camp.agents.hierarchy import Hierarchy
    from internav_data.camp.agents.protocol import Agent, Batch
    from internav_data.camp.config import CampConfig, PPOConfig
    from internav_data.camp.rollout import Rollout

TARGETS = {"update_ratio": 10.0, "simulator_share": 1 / 3, "overhead_us": 50.0}
TOLERANCE = 1e-4
MAX_STEPS = 200
REPEATS = 2
GLOBAL = 3


class Clock:
    """Seconds of processor time that calls took, by name."""

    def __init__(self) -> None:
        self.spent: dict[str, float] = {}

    def timed(self, name: str, call: Callable[..., Any]) -> Callable[..., Any]:
        """Return a function that does the same and is timed."""

        def run(*given: Any, **named: Any) -> Any:  # noqa: ANN401 - as `call` has it
            begin = time.process_time()
            done = call(*given, **named)
            self.spent[name] = self.spent.get(name, 0.0) + time.process_time() - begin
            return done

        return run


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("dataset", type=Path)
    parser.add_argument("--methods", default=",".join(AGENTS))
    parser.add_argument("--rollouts", type=int, default=3)
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    torch.set_num_threads(1)
    config = from_mapping(preset("small"), {"ppo": {"target_kl": None}}, "")  # stops for nobody
    methods = options.methods.split(",")
    method_row(options.dataset, methods[0], config, options.rollouts)  # prepares models, compiles
    result = {
        "benchmark": "trainer",
        "python": platform.python_version(),
        "torch": torch.__version__,
        "threads": 1,
        "targets": TARGETS,
        "environments": config.ppo.num_envs,
        "steps": config.ppo.num_steps,
        "image_size": config.network.image_size,
        "update": update_row(options.dataset, config),
        "methods": {
            method: method_row(options.dataset, method, config, options.rollouts)
            for method in methods
        },
    }
    text = json.dumps(result, indent=2)
    if options.out:
        options.out.write_text(text + "\n", encoding="utf-8")
    print(text)
    return 0 if result["update"]["agree"] else 1


def lived(
    dataset: Path, method: str, config: CampConfig
) -> tuple[Agent, InterNavVectorEnv, Collector]:
    """Return an agent among its environments."""
    agent = make_agent(method, config)
    episodes = load_dataset(dataset, "train")
    size, count = config.network.image_size, config.ppo.num_envs
    env = InterNavVectorEnv(
        count,
        episodes,
        size,
        autoreset_mode="Disabled",
        copy=False,
        sensors=agent.sensors,
        max_steps=MAX_STEPS,
    )
    return agent, env, Collector(env, agent)


def method_row(dataset: Path, method: str, config: CampConfig, rollouts: int) -> dict[str, Any]:
    """Train for some rollouts after one that warms up; say where the time went."""
    agent, env, collector = lived(dataset, method, config)
    collector.loop.reset(seed=0)
    optimiser = torch.optim.Adam(agent.optimised(), config.stages.joint_learning_rate)
    count, steps = config.ppo.num_envs, config.ppo.num_steps

    def train(number: int) -> None:
        rollout = collector.collect(
            uniforms_of(0, number, range(count), steps), config.ppo.chunk_steps
        )
        orders = orders_of(0, number, config.ppo.update_epochs, count)
        update(agent, optimiser, rollout, config.ppo, orders)

    train(0)
    clock, begin, wall = Clock(), time.process_time(), time.perf_counter()
    for name, owner, calls in (
        ("env", env, ("step", "reset")),
        ("agent", agent, ("act", "value")),
        ("collect", collector, ("collect",)),
    ):
        for call in calls:
            setattr(owner, call, clock.timed(name, getattr(owner, call)))
    for number in range(rollouts):
        train(1 + number)
    env.close()
    spent, taken = clock.spent, rollouts * count * steps
    whole = time.process_time() - begin
    other = spent["collect"] - spent["env"] - spent["agent"]
    return {
        "env_steps_per_s": round(taken / spent["env"]),
        "collect_steps_per_s": round(taken / spent["collect"]),
        "steps_per_s": round(taken / whole),
        "wall_steps_per_s": round(taken / (time.perf_counter() - wall)),
        "simulator_share": round(spent["env"] / whole, 3),
        "inference_share": round(spent["agent"] / whole, 3),
        "learning_share": round(1.0 - spent["collect"] / whole, 3),
        "networks_us": round(1e6 * spent["agent"] / taken, 1),
        "overhead_us": round(1e6 * other / taken, 1),
        "parameters": sum(parameter.numel() for parameter in agent.optimised()),
    }


def update_row(dataset: Path, config: CampConfig) -> dict[str, Any]:
    """Time one update both ways, after both gave the same answers on a small one."""
    small = from_mapping(
        config, {"ppo": {"num_envs": 4, "num_minibatches": 2, "num_steps": 12}}, ""
    )
    both = (update, naive_update)
    ours, theirs = (one_update(dataset, small, how)[1] for how in both)
    names = ("policy_loss", "value_loss", "entropy", "grad_norm")
    apart = max(abs(ours[name] - theirs[name]) for name in names)
    one_update(dataset, config, update)  # warms up
    taken = [[one_update(dataset, config, how)[0] for how in both] for _ in range(REPEATS)]
    fast, slow = (min(column) for column in zip(*taken, strict=True))
    return {
        "samples": config.ppo.num_envs * config.ppo.num_steps * config.ppo.update_epochs,
        "internav_s": round(fast, 3),
        "per_sample_s": round(slow, 3),
        "ratio": round(slow / fast, 2),
        "ratios": [round(theirs / ours, 2) for ours, theirs in taken],
        "apart": apart,
        "agree": apart <= TOLERANCE and math.isfinite(apart),
    }


def one_update(
    dataset: Path, config: CampConfig, how: Callable[..., dict[str, float]]
) -> tuple[float, dict[str, float]]:
    """Return the seconds that an update took, and what was said of it."""
    agent, env, collector = lived(dataset, "camp", config)
    collector.loop.reset(seed=0)
    count = config.ppo.num_envs
    rollout = collector.collect(uniforms_of(0, 0, range(count), config.ppo.num_steps))
    env.close()
    optimiser = torch.optim.Adam(agent.optimised(), config.stages.joint_learning_rate)
    begin = time.process_time()
    said = how(
        agent, optimiser, rollout, config.ppo, orders_of(0, 0, config.ppo.update_epochs, count)
    )
    return time.process_time() - begin, said


def naive_update(
    agent: Hierarchy,
    optimiser: Optimizer,
    rollout: Rollout,
    config: PPOConfig,
    orders: Sequence[Sequence[int]],
) -> dict[str, float]:
    """Learn from a rollout one sample at a time; sums are those of `ppo.update`."""
    advantages = rollout.advantages(config)
    returns = advantages + rollout.values
    advantages = (advantages - advantages.mean()) / (advantages.std(correction=0) + 1e-8)
    told: list[dict[str, float]] = []
    size = config.num_envs // config.num_minibatches
    for order in orders:
        for first in range(0, len(order), size):
            parts = []
            for k in order[first : first + size]:
                hidden = rollout.batch.state["hidden"][k]
                for t in range(config.num_steps):
                    log_prob, value, entropy, hidden = naive_step(
                        agent, rollout.batch, t, k, hidden
                    )
                    ratio = (log_prob - rollout.log_probs[t, k]).exp()
                    clipped = ratio.clamp(1.0 - config.clip_coef, 1.0 + config.clip_coef)
                    gain = torch.minimum(ratio * advantages[t, k], clipped * advantages[t, k])
                    parts.append((-gain, 0.5 * (value - returns[t, k]) ** 2, entropy))
            policy, wrong, entropy = (torch.stack(part).mean() for part in zip(*parts, strict=True))
            loss = policy + config.vf_coef * wrong - config.ent_coef * entropy
            optimiser.zero_grad()
            loss.backward()
            norm = torch.nn.utils.clip_grad_norm_(agent.optimised(), config.max_grad_norm)
            optimiser.step()
            said = {"policy_loss": policy, "value_loss": wrong, "entropy": entropy}
            told.append({name: v.item() for name, v in {**said, "grad_norm": norm}.items()})
    return {name: sum(row[name] for row in told) / len(told) for name in told[0]}


def naive_step(
    agent: Hierarchy, batch: Batch, t: int, k: int, hidden: Tensor
) -> tuple[Tensor, Tensor, Tensor, Tensor]:
    """Return log-probability, value, entropy and hidden states (5, hidden) of one sample."""
    if batch.episode_starts[t, k]:
        hidden = torch.zeros_like(hidden)
    now = batch.record.map(lambda values: values[t, k])
    seen = {name: what[t : t + 1, k : k + 1] for name, what in batch.observations.items()}
    view = agent.encoders[0](seen)[0]
    opened = (float(now.open == 1), float(now.open == 2), float(now.used) / 11)
    told = torch.cat([view, torch.tensor([opened])], 1)
    after, acts = list(hidden), []
    for number, policy in enumerate(agent.policies):
        out, last = policy.gru(view if number == NAVIGATE else told, hidden[number][None])
        after[number] = last[0]
        acts.append(torch.log_softmax(policy.actor(out[0]), -1))
    inputs = torch.cat([told, agent.global_policy.embed(now.intent)[None]], 1)
    out, last = agent.global_policy.gru(inputs, hidden[GLOBAL][None])
    after[GLOBAL] = last[0]
    plan = torch.log_softmax(agent.global_policy.actor(out[0]), -1)
    log_prob, entropy = torch.zeros(()), torch.zeros(())
    if now.decide:
        log_prob = log_prob + plan[int(now.option)]
        entropy = entropy - (plan.exp() * plan).sum()
    if now.option != STOP:
        own = acts[int(now.option)]
        log_prob = log_prob + own[ACTIONS_OF[int(now.option)].index(int(now.choice))]
        entropy = entropy - (own.exp() * own).sum()
    return log_prob, agent.global_policy.critic(out[0])[0], entropy, torch.stack(after)


if __name__ == "__main__":
    sys.exit(main())
