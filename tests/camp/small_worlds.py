"""Tasks small enough to be learnt in minutes, with the protocol of `collect.Environments`."""

import numpy as np

AHEAD, LEFT, RIGHT, PUSH, PICKUP, DROP, DONE = 0, 1, 2, 5, 9, 10, 11
BOX, THING, BLOCK = range(3)
KINDS = ("box", "thing", "block")
SIZE = 32
_COLOURS = ((220, 40, 40), (40, 200, 60), (150, 150, 150), (110, 80, 50))
"""Of a box, a thing, a block; of walls."""
_WALL, _SIGHT, _LONGEST = 3, 3, 40
_CELL_M, _FAR_M = 0.25, 5.0
_SPAN = {BOX: (8, 24, 8, 24), THING: (20, 28, 12, 20), BLOCK: (0, 32, 8, 24), _WALL: (0, 32, 4, 28)}
"""Rows and columns of what is one cell ahead; farther things are smaller."""


def _pictures():
    """Return pictures, depths and ids by (what lies ahead, open to the left, to the right).

    What lies ahead is 0 for nothing, else 1 + 3 * what + cells to it - 1.
    """
    count = 1 + _SIGHT * len(_COLOURS)
    rgb = np.full((count, 2, 2, SIZE, SIZE, 3), 60, np.uint8)
    depth = np.full((count, 2, 2, SIZE, SIZE, 1), _FAR_M, np.float32)
    ids = np.full((count, 2, 2, SIZE, SIZE), -1, np.int32)
    for what, colour in enumerate(_COLOURS):
        top, bottom, left, right = (edge - SIZE // 2 for edge in _SPAN[what])
        for far in range(_SIGHT):
            own = 1 + _SIGHT * what + far
            rows = slice(SIZE // 2 + top // (far + 1), SIZE // 2 + bottom // (far + 1))
            columns = slice(SIZE // 2 + left // (far + 1), SIZE // 2 + right // (far + 1))
            rgb[own, :, :, rows, columns] = colour
            depth[own, :, :, rows, columns] = _CELL_M * (far + 1)
            if what != _WALL:
                ids[own, :, :, rows, columns] = 1 + what
    for opened in range(2):
        rgb[:, opened, :, :, :4] = rgb[:, :, opened, :, -4:] = 230 if opened else 20
        depth[:, opened, :, :, :4] = depth[:, :, opened, :, -4:] = 1.0 if opened else 0.25
    return rgb, depth, ids


class Mixed:
    """A corridor with one of three things in the way, told apart by sight; a goal round its end.

    A red box is pushed away (PushAhead, faced from the next cell); a small green thing is picked up
    and may be put down again; beside a grey block another lane leads to the goal, seen as a bright
    opening all along. Rewards are those of the real environment: for moves the drop of the distance
    that does not see obstacles, +1 for opening the way and -1 for closing it, 10 for Done at the
    goal, -0.01 a step.

    Parameters
    ----------
    count
        Environments.
    seed
        Seed of the episodes.
    ids
        Show instance ids too, for `nie`.
    """

    def __init__(self, count, seed=0, *, ids=False):
        self.num_envs, self._ids = count, ids
        self._rng = np.random.default_rng(seed)
        self._pictures = _pictures()
        zeros = np.zeros((9, count), int)
        # The corridor is lane 0; the goal is at far = 0 beside it, on the side `side` (1: right).
        self.far, self.lane, self.turns, self.kind, self.at, self.side = zeros[:6]
        self.there, self._held, self._age = zeros[6:]

    @property
    def _blocked(self):
        return (self.there > 0) & (self.at < self.far)

    def _metres(self, far, lane):
        return _CELL_M * np.hypot(far, lane - self.side)

    def _cell(self, steps):
        """Return the cell so many steps ahead."""
        far = self.far - steps * np.array([1, 0, -1, 0])[self.turns]
        return far, self.lane + steps * np.array([0, 1, 0, -1])[self.turns]

    def _what(self, far, lane):
        """Return what lies in cells: -1 for nothing."""
        beside = (lane == self.side) & ((self.kind == BLOCK) | (far == 0))
        free = (far >= 0) & (far <= 8) & ((lane == 0) | beside)
        taken = (self.there > 0) & (lane == 0) & (far == self.at)
        return np.where(taken, self.kind, np.where(free, -1, _WALL))

    def look(self):
        ahead = np.zeros(self.num_envs, int)
        for steps in range(_SIGHT, 0, -1):
            what = self._what(*self._cell(steps))
            ahead = np.where(what < 0, ahead, 1 + _SIGHT * what + steps - 1)
        left, right = (self._lane_open(turn) for turn in (3, 1))
        rgb, depth, ids = (pictures[ahead, left, right] for pictures in self._pictures)
        bearing = np.arctan2(self.lane - self.side, self.far) + np.pi / 2 * self.turns
        bearing = (bearing + np.pi) % (2 * np.pi) - np.pi
        goal = np.stack([self._metres(self.far, self.lane), bearing], 1).astype(np.float32)
        seen = {"rgb": rgb, "depth": depth, "goal": goal, "held": self._held.copy()}
        seen |= {"horizon": np.ones(self.num_envs, np.int64)}
        return {**seen, "ids": ids} if self._ids else seen

    def _lane_open(self, turn):
        """Return where the cell beside is free."""
        turns = (self.turns + turn) % 4
        far = self.far - np.array([1, 0, -1, 0])[turns]
        return (self._what(far, self.lane + np.array([0, 1, 0, -1])[turns]) < 0).astype(int)

    def reset(self, *, seed=None, options=None):
        mask = (options or {}).get("reset_mask", np.ones(self.num_envs, bool))
        count, draw = int(mask.sum()), self._rng.integers
        self.far[mask] = draw(2, 7, count)
        self.turns[mask], self.kind[mask] = draw(0, 4, count), draw(0, 3, count)
        self.at[mask] = np.maximum(self.far[mask] - draw(1, 4, count), 1)
        self.side[mask] = draw(0, 2, count) * 2 - 1
        self.there[mask] = 1
        self.lane[mask] = self._held[mask] = self._age[mask] = 0
        return self.look(), {"seed": seed}

    def step(self, actions):
        far, lane = self._cell(1)
        what, blocked = self._what(far, lane), self._blocked
        before = self._metres(self.far, self.lane)
        moved = (actions == AHEAD) & (what < 0)
        pushed = (actions == PUSH) & (what == BOX)
        picked = (actions == PICKUP) & (what == THING)
        dropped = (actions == DROP) & (self._held > 0) & (what < 0) & (lane == 0)
        reached = (actions == DONE) & (self.far == 0) & (self.lane == self.side)
        self.there[pushed | picked] = 0
        self.there[dropped], self.at[dropped] = 1, far[dropped]
        self._held += picked.astype(int) - dropped
        opened = blocked.astype(int) - self._blocked
        self.far[moved], self.lane[moved] = far[moved], lane[moved]
        self.turns = (self.turns + (actions == RIGHT) - (actions == LEFT)) % 4
        self._age += 1
        nearer = before - self._metres(self.far, self.lane)
        rewards = 10.0 * reached + opened * (pushed | picked | dropped) + nearer - 0.01
        ended = actions == DONE
        cut = (self._age >= _LONGEST) & ~ended
        infos = {"metrics": {"success": reached, "kind": self.kind.copy()}}
        return self.look(), rewards, ended, cut, infos


class Cue:
    """Environment whose first step alone shows the right one of two paths.

    The agent is carried along whatever it does (it cannot leave itself a sign), and at the fork a
    rotation chooses a way: 10 if it is the right one. Done ends the episode.

    Parameters
    ----------
    count
        Environments.
    """

    steps_to_fork = 3

    def __init__(self, count):
        self.num_envs = count
        self._rng = np.random.default_rng(0)
        self.right, self._age = np.zeros((2, count), int)

    def look(self):
        shape = (self.num_envs, SIZE, SIZE)
        rgb, depth = np.full((*shape, 3), 60, np.uint8), np.full((*shape, 1), _FAR_M, np.float32)
        for right, columns in enumerate((slice(2, 14), slice(18, 30))):
            rgb[(self._age == 0) & (self.right == right), 10:22, columns] = _COLOURS[right]
        left = np.maximum(self.steps_to_fork - self._age, 0)
        goal = np.stack([_CELL_M * left, np.zeros(self.num_envs)], 1).astype(np.float32)
        nothing = np.zeros(self.num_envs, np.int64)
        return {"rgb": rgb, "depth": depth, "goal": goal, "held": nothing, "horizon": nothing + 1}

    def reset(self, *, seed=None, options=None):
        mask = (options or {}).get("reset_mask", np.ones(self.num_envs, bool))
        self.right[mask] = self._rng.integers(0, 2, int(mask.sum()))
        self._age[mask] = 0
        return self.look(), {"seed": seed}

    def step(self, actions):
        chosen = (self._age >= self.steps_to_fork) & ((actions == LEFT) | (actions == RIGHT))
        reached = chosen & ((actions == RIGHT) == (self.right > 0))
        self._age += 1
        ended = chosen | (actions == DONE)
        cut = (self._age >= 3 * self.steps_to_fork) & ~ended
        infos = {"metrics": {"success": reached}}
        return self.look(), 10.0 * reached - 0.01, ended, cut, infos
