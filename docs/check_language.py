"""Check the language of the code: docstrings, `Raises` sections, names.

    python docs/check_language.py                       # findings; exit status 1 if there are any
    python docs/check_language.py internav_data/camp    # of one room
    python docs/check_language.py --report              # figures per room; exit status 0

Rules, each with its tables below:

fragment  a public docstring, or a description under `Parameters` or `Attributes`, begins with a
          word that needs a sentence before it ("Of the run.", "How.")
raises    a public function raises by name and its docstring has no `Raises` section that says so
dialect   a class, function, argument, attribute, module or module constant has a name that was
          replaced by the field's word
meaning   one class name or type alias is defined in two modules of the package
shapes    a public function of arrays states no shape in its docstring
length    a function has more than 50 lines of code, docstrings and comments not counted
"""

from __future__ import annotations

import argparse
import ast
import inspect
import itertools
import re
import statistics
import sys
from collections import Counter, defaultdict
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, TypeGuard

from code_lines import (
    FOLDERS,
    ROOT,
    Function,
    code_lines,
    comment_count,
    function_lengths,
    python_files,
    room_of,
)

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

# ---------------------------------------------------------------------------------------------
# Tables: what the rules look for. Change the language here.

SCRIPTS = frozenset(FOLDERS) - {"cli"}
"""Rooms beside the package, each file of which is a program of its own."""
DEFAULT_PATHS = ("internav_data", "cli", "benchmarks", "docs", "examples")
"""Checked when no path is given, below the root of the repository."""
LONG_FUNCTION = 50
"""Largest number of lines of code of a function."""

FRAGMENTS = {
    "Of": "name the thing itself: 'Of the run.' is 'Run configuration.'",
    "Who": "begin with the noun: 'Who plays' is 'Policy under evaluation'",
    "Whose": "begin with the noun: 'Whose values' is 'Agent whose values'",
    "What": "begin with the noun: 'What it costs' is 'Cost'",
    "How": "begin with the quantity: 'How many' is 'Number of', 'How often' is 'Count of'",
    "Where": "begin with the noun: 'Where it lies' is 'Position'",
    "That": "begin with the noun that 'That' stands for",
    "Which": "begin with the noun: 'Which engine' is 'Name of the engine'",
    "Why": "begin with the noun: 'Why it failed' is 'Reason of the failure'",
    "When": "begin with the noun: 'When it ended' is 'End time'",
    "By": "begin with the noun: 'By split' is 'Counts by split'",
    "As": "say what it does, then 'see `name`'",
    "So": "begin with the noun: 'So many' is 'Maximum number of'",
    "For": "begin with the noun: 'For Done' is 'Reward for Done'",
    "Not": "say what it is before what it is not",
}
"""First words that leave a docstring without its subject, and how to mend each."""
VERB_FRAGMENTS = {"Whether": "begin with a verb: 'Return whether'"}
"""First words that describe a value well (attribute, parameter, property) but not an act."""

NEVER_DOCUMENTED = frozenset(
    {
        "NotImplementedError",  # marks an abstract method
        "StopIteration",  # the iterator protocol
    }
)
"""Exceptions that need no `Raises` section."""
PROTOCOL_ERRORS = {"__getattr__": "AttributeError"}
"""Exceptions that a special method raises by its protocol."""
COMMAND_DECORATORS = frozenset({"command", "group"})
"""Decorators (of click) that turn the docstring into the text of `--help`: no sections there."""

DIALECT_CLASSES = {
    "Board": "ObservationBuffer",
    "Bye": "WorkerExited",
    "Column": "AgentCollider",
    "Course": "EpisodeSegments",
    "Crew": "WorkerPool",
    "Deciding": "IntentConditionedPolicy",
    "Dice": "UniformSampler",
    "EnvState": "EpisodeSnapshot (id and actions; `World` is the state)",
    "Ground": "PlanningProblem (planner), DropObstructions (world), CheckedLattice (verification)",
    "Item": "MovableObject or PlacedAsset",
    "Logbook": "MetricsLogger",
    "Motion": "PushSolution (unrounded, in its own frame)",
    "Octagon": "Dop8 (planar k-DOP, k = 8)",
    "Outline": "ConvexPrisms",
    "Place": "LoadedHouse, TrainState, RoomContext or ShardRef",
    "Plan": "FloorGrid (houses) or ActionPlanner (acts)",
    "Play": "EpisodeRun",
    "Player": "Policy (evaluation) or EnvSlot (envs)",
    "Preset": "HousePreset or TrainPreset",
    "Pushed": "PushResult",
    "Ran": "ForwardOutput",
    "Remembering": "Solver",
    "Rest": "SettleSolution (unrounded, in its own frame)",
    "Rules": "TaskConfig",
    "Scenery": "StaticScene or CheckedLayout",
    "Screen": "Occluders",
    "Setting": "PhysicsScene",
    "Settings": "EvaluationConfig (evaluation), CheckedConfig (verification)",
    "Settled": "SettleResult",
    "Shelf": "RowGroupCache",
    "Shell": "OcclusionShape (half-spaces and visibility points)",
    "Shove": "PushSpec",
    "Site": "SpawnSite",
    "Solutions": "ResultCache",
    "Stage": "HouseModel (world) or TrainingStage (camp)",
    "States": "SearchTable",
    "Step": "AgentStep or TaskStep",
    "Tally": "EpisodeStatistics",
    "Teller": "ProgressReporter",
    "Trail": "sweep_of",
    "Try": "Candidate",
    "View": "CameraView or CameraPose",
    "Visit": "SearchNode",
    "Way": "EpisodeDraft",
    "WayFinder": "TangentGraph (Liu and Arimoto 1992)",
}
"""Class names that were replaced, and the field's word; leading underscores do not matter."""

DIALECT_NAMES = {
    "ORACLES": "REFERENCE_POLICIES",
    "PATIENCE": "MAX_TRIES (retries)",
    "WHIMS": "JITTERS",
    "advanced": "option_step",
    "begun": "reset_where_done",
    "bury": "handle_crash",
    "clear_m": "shortest_path_m (spawned obstacles absent; the L of SPL)",
    "clear_steps": "shortest_path_steps",
    "clip_value": "clip_vloss (CleanRL)",
    "closes": "disconnection (no path: parity union-find)",
    "crew": "pool",
    "critic_rollouts": "critic_warmup_rollouts",
    "dice": "sampler",
    "doubt": "penalty",
    "end_chance": "initial_done_probability",
    "entropy_coefficient": "ent_coef (CleanRL)",
    "films": "videos",
    "gradient_norm": "max_grad_norm (the limit) or grad_norm (what is logged)",
    "houses_kept": "house_cache_size",
    "init_from": "pretrain",
    "keeps": "keep_out_boxes (houses) or temporally_extended (camp)",
    "kl_limit": "target_kl (CleanRL)",
    "lam": "gae_lambda",
    "least": "min, or min_<quantity>",
    "least_clear_m": "min_shortest_path_m",
    "logbook": "metrics_logger",
    "meant": "intended_option_probs (P(omega'), eq. 6) or intent (P(i), eq. 7)",
    "most": "max, or max_<quantity>",
    "node_paths_cut": "node_paths_truncated",
    "obituary": "exit_cause",
    "octagon": "dop8",
    "octagons": "dop8s",
    "oracles": "reference_policies",
    "polar": "point_goal",
    "promise": "f_cost (inadmissible)",
    "room_paths_cut": "room_paths_truncated",
    "rooms_on_way": "rooms_on_path",
    "said": "the noun: infos, values, table",
    "shelf": "row_group_cache",
    "shove": "push_spec",
    "sidecars": "metadata_files",
    "sideways_m": "lateral_std_m",
    "solutions": "result_cache",
    "solving_anew": "cache_disabled",
    "surprises": "td_errors",
    "tally": "episode_statistics",
    "tell": "callback",
    "teller": "reporter",
    "telling": "reporting",
    "thing_id": "object_id",
    "things": "objects",
    "told": "condition, or uses_intent",
    "touch": "narrow_phase",
    "value_coefficient": "vf_coef (CleanRL)",
    "verdict": "statements",
    "way": "path",
    "way_finder": "tangent_graph",
    "way_m": "path_m: obstructed_path_m (Episode), path_m_after (Outcome)",
    "ways": "paths",
    "whim": "jitter",
}
"""Names of functions, arguments, attributes, modules and constants that were replaced."""

DIALECT_ATTRIBUTES = {
    "DataConfig.where": "filter",
    "Episode.steps": "obstructed_path_steps (objects as they lie; null when cut off)",
    "EpisodeConfig.redraws": "max_redraws",
    "EpisodeConfig.spots": "max_spawn_tries",
    "Obstacle.segment": "node_path_segment",
    "Outcome.steps": "path_steps_after (after the act)",
    "PPOConfig.clip": "clip_coef (CleanRL)",
    "PPOConfig.environments": "num_envs (CleanRL)",
    "PPOConfig.epochs": "update_epochs (CleanRL)",
    "PPOConfig.minibatches": "num_minibatches (CleanRL)",
    "PPOConfig.steps": "num_steps (CleanRL)",
    "StagesConfig.steps": "total_timesteps (CleanRL)",
}
"""Attributes that were replaced in one class only: the word is good elsewhere."""

DIALECT_OF_ROOM = {
    "camp": {
        "acts": "acting_mask",
        "course": "episode_segments",
        "joined": "all_gather",
        "listed": "all_gather",
        "plane": "uniform_intent",
        "seat": "slot (environment slot)",
        "starts": "episode_starts",
    },
    "dataset": {"figures": "summary (statistics)", "work": "staging"},
    "envs": {
        "board": "buffer (observations)",
        "place": "loaded_house",
        "seat": "slot (environment slot)",
        "stage": "model (HouseModel)",
    },
    "episodes": {"stage": "model (HouseModel)"},
    "evaluation": {"seat": "slot (environment slot)", "starts": "episode_starts"},
    "houses": {"anchors": "door_cells"},
    "navigation": {
        "arcs": "boundary_arcs",
        "drawn": "to_polyline",
        "shadows": "forbidden_directions",
        "slot": "directed_arc",
        "slots": "directed_arcs",
    },
    "physics": {"column": "agent_collider", "setting": "scene (PhysicsScene)"},
    "planner": {
        "field": "bucket_dijkstra (Dial)",
        "plan": "search",
        "spare": "fallback",
        "stage": "model (HouseModel)",
    },
    "verification": {"stage": "model (HouseModel)"},
    "views": {"stage": "model (HouseModel)"},
    "world": {
        "column": "agent_collider",
        "setting": "scene (PhysicsScene)",
        "stage": "model (HouseModel)",
    },
}
"""Names that were replaced in one room only: the word is good elsewhere."""

FIRST_WORD = re.compile(r"[A-Za-z]+")
"""First word of a docstring."""
ARRAY = re.compile(r"\b(?:NDArray|ndarray|Tensor)\b")
"""Annotation of an array; aliases of such annotations are found by `array_aliases`."""
SHAPE = re.compile(
    r"""\(\s*[\w.…*+/-]+(?:\s[*+/-]\s[\w.]+)?\s*,  # (n, 2), (n,), (n + 1, 3), (n, …): with a comma
        (?:\s*[\w.…*+/-]+(?:\s[*+/-]\s[\w.]+)?\s*,?)*\s*\)
        |\b\w+\s?\N{MULTIPLICATION SIGN}\s?\w+    # n times 2
        |\b\w+\sx\s\w+                            # n x 2
        |\b[Ss]hapes?\b|\b[Ss]calars?\b           # 'Shapes' section; a scalar""",
    re.VERBOSE,
)
"""Statement of a shape in a docstring."""
REFERENCE = re.compile(r"See `[\w.]+`")
"""Docstring of an overriding method, which leaves its parameters to another docstring."""
ALIAS = re.compile(r"_*[A-Z]\w*[a-z]\w*$")
"""Name of a type alias: in capitals and small letters."""

RULES = ("fragment", "raises", "dialect", "meaning", "length", "shapes")
"""Names of the rules, in the order of the report."""

# ---------------------------------------------------------------------------------------------


@dataclass(frozen=True, order=True)
class Finding:
    """One violation of a rule."""

    path: str
    """File, relative to the root where it lies below."""
    line: int
    """Line, from 1."""
    rule: str
    """Name of the rule, one of `RULES`."""
    text: str
    """Fault, and its remedy."""

    def __str__(self) -> str:
        return f"{self.path}:{self.line}: {self.rule}: {self.text}"


@dataclass(frozen=True)
class Module:
    """One parsed source file."""

    path: str
    """File, relative to the root where it lies below."""
    room: str
    """First folder below the package."""
    source: str
    """Text of the file."""
    tree: ast.Module
    """Syntax tree of the text."""

    @property
    def public(self) -> bool:
        """Whether the module's own name is public (`__init__` is)."""
        return _is_public(Path(self.path).stem)


@dataclass(frozen=True)
class Definition:
    """One named thing that a module defines: itself, a class, a function, an attribute, ..."""

    kind: str
    """One of module, class, function, property, attribute (constants too), argument."""
    name: str
    """Name without its owner's."""
    owner: str
    """Name of the enclosing class or function, empty at the top of a module."""
    line: int
    """Line of the name."""
    public: bool
    """Whether neither the name nor an enclosing one is private, and no function encloses it."""
    docstring: str = ""
    """Cleaned docstring, empty if there is none."""
    doc_line: int = 0
    """Line where the docstring begins."""
    node: ast.AST | None = None
    """Syntax node: of a function, a class, or an attribute's value."""

    @property
    def label(self) -> str:
        """Kind and qualified name, for messages."""
        return f"{self.kind} {self.owner}.{self.name}" if self.owner else f"{self.kind} {self.name}"


def _is_public(name: str) -> bool:
    return not name.startswith("_") or (name.startswith("__") and name.endswith("__"))


def load(path: Path) -> Module:
    """Read and parse a source file."""
    resolved = path.resolve()
    shown = resolved.relative_to(ROOT) if resolved.is_relative_to(ROOT) else path
    return parse(path.read_text(encoding="utf-8"), str(shown), room_of(path))


def parse(source: str, path: str = "module.py", room: str = "room") -> Module:
    """Parse the text of a module."""
    return Module(path, room, source, ast.parse(source, path))


# ---------------------------------------------------------------------------------------------
# Definitions of a module


def definitions(module: Module) -> Iterator[Definition]:
    """Yield everything that a module defines, itself first."""
    text, line = _docstring(module.tree.body)
    stem = Path(module.path).stem
    name = Path(module.path).parent.name if stem == "__init__" else stem
    yield Definition("module", name, "", 1, module.public, text, line)
    yield from _in_body(module.tree.body, "", public=module.public)


def _in_body(body: Sequence[ast.stmt], owner: str, *, public: bool) -> Iterator[Definition]:
    """Yield the definitions in the body of a module or class, and those inside them."""
    statements = list(_flat(body))
    for k, node in enumerate(statements):
        if isinstance(node, ast.ClassDef):
            shown = public and _is_public(node.name)
            text, line = _docstring(node.body)
            yield Definition("class", node.name, owner, node.lineno, shown, text, line, node)
            yield from _in_body(node.body, node.name, public=shown)
        elif isinstance(node, Function):
            yield from _of_function(node, owner, public=public)
        else:
            text, line = _docstring(statements[k + 1 : k + 2])
            for name in _targets(node):
                shown = public and _is_public(name)
                value = getattr(node, "value", None)
                yield Definition("attribute", name, owner, node.lineno, shown, text, line, value)


def _of_function(node: Function, owner: str, *, public: bool) -> Iterator[Definition]:
    """Yield a function, its arguments, the attributes it sets on `self`, and what is inside it."""
    shown = public and _is_public(node.name)
    decorators = {_last_name(decorator) for decorator in node.decorator_list}
    kind = "property" if decorators & {"property", "cached_property"} else "function"
    text, line = _docstring(node.body)
    yield Definition(kind, node.name, owner, node.lineno, shown, text, line, node)
    given = node.args
    for argument in (*given.posonlyargs, *given.args, given.vararg, *given.kwonlyargs, given.kwarg):
        if argument is not None:
            yield Definition("argument", argument.arg, node.name, argument.lineno, public=False)
    for inner in _own_nodes(node):
        if isinstance(inner, ast.ClassDef):
            yield Definition("class", inner.name, node.name, inner.lineno, public=False)
            yield from _in_body(inner.body, inner.name, public=False)
        elif isinstance(inner, Function):
            yield from _of_function(inner, node.name, public=False)
        elif _sets_own_attribute(inner):
            yield Definition("attribute", inner.attr, owner, inner.lineno, public=False)


def _sets_own_attribute(node: ast.AST) -> TypeGuard[ast.Attribute]:
    return (
        isinstance(node, ast.Attribute)
        and isinstance(node.ctx, ast.Store)
        and isinstance(node.value, ast.Name)
        and node.value.id == "self"
    )


def _flat(body: Sequence[ast.stmt]) -> Iterator[ast.stmt]:
    """Yield statements, and those inside `if`, `try` and `with`."""
    for node in body:
        yield node
        if isinstance(node, (ast.If, ast.Try, ast.With)):
            yield from _flat(node.body)
            yield from _flat(getattr(node, "orelse", []))
            for handler in getattr(node, "handlers", []):
                yield from _flat(handler.body)


def _own_nodes(function: Function) -> Iterator[ast.AST]:
    """Yield the nodes of a function's body, without the insides of nested definitions."""
    waiting: list[ast.AST] = list(reversed(function.body))
    while waiting:
        node = waiting.pop()
        yield node
        if not isinstance(node, Function | ast.ClassDef | ast.Lambda):
            waiting.extend(reversed(list(ast.iter_child_nodes(node))))


def _targets(node: ast.stmt) -> list[str]:
    """Return the names that an assignment binds, none for other statements."""
    if isinstance(node, ast.AnnAssign):
        targets: list[ast.expr] = [node.target]
    elif isinstance(node, ast.Assign):
        targets = node.targets
    else:
        return []
    names = [inner for target in targets for inner in ast.walk(target)]
    return [n.id for n in names if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)]


def _docstring(body: Sequence[ast.stmt]) -> tuple[str, int]:
    """Return the cleaned docstring that begins a body and its line; empty and 0 if none does."""
    if body and isinstance(body[0], ast.Expr) and isinstance(body[0].value, ast.Constant):
        text = body[0].value.value
        if isinstance(text, str):
            return inspect.cleandoc(text), body[0].lineno
    return "", 0


def _last_name(node: ast.expr) -> str:
    """Return the last part of a dotted name, called or not: `d` of `@c.d()`; else empty."""
    if isinstance(node, ast.Call):
        node = node.func
    if isinstance(node, ast.Attribute):
        return node.attr
    return node.id if isinstance(node, ast.Name) else ""


def sections(docstring: str) -> dict[str, list[tuple[int, str]]]:
    """Return the sections of a numpy-style docstring: title to (offset in lines, text) of each."""
    lines = docstring.splitlines()
    heads = [
        k
        for k, rule in enumerate(lines[1:])
        if len(rule) >= len("---") and not rule.strip("-") and lines[k].strip()
    ]
    found = {}
    for head, end in itertools.pairwise([*heads, len(lines)]):
        found[lines[head].strip()] = list(enumerate(lines[head + 2 : end], start=head + 2))
    return found


# ---------------------------------------------------------------------------------------------
# Rules


def fragments(module: Module) -> Iterator[Finding]:
    """Yield public docstrings and descriptions of parameters that begin without their subject."""
    for made in definitions(module):
        if not made.public or not made.docstring:
            continue
        words = FRAGMENTS
        if made.kind not in {"attribute", "property"}:
            words = FRAGMENTS | VERB_FRAGMENTS
        if remedy := words.get(_first_word(made.docstring)):
            start = made.docstring.splitlines()[0][:50]
            text = f"docstring of {made.label} begins {start!r}; {remedy}"
            yield Finding(module.path, made.doc_line, "fragment", text)
        for name, offset, described in _described(made.docstring):
            if remedy := FRAGMENTS.get(_first_word(described)):
                text = f"{name} of {made.label} begins {described[:50]!r}; {remedy}"
                yield Finding(module.path, made.doc_line + offset, "fragment", text)


def _first_word(text: str) -> str:
    match = FIRST_WORD.match(text)
    return match.group() if match else ""


def _described(docstring: str) -> Iterator[tuple[str, int, str]]:
    """Yield (name, offset in lines, first line of its description) of parameters and attributes."""
    found = sections(docstring)
    for title in ("Parameters", "Other Parameters", "Attributes"):
        name = ""
        for offset, line in found.get(title, []):
            if line and not line[0].isspace():
                name = line.split(" : ")[0].strip()
            elif line.strip() and name:
                yield name, offset, line.strip()
                name = ""


def raised(function: Function) -> dict[str, int]:
    """Return the exceptions that a function raises by name itself, and the first line of each.

    Left out: nested functions, `raise error` of a variable, exceptions that the function catches by
    the same name, and those in `NEVER_DOCUMENTED` and `PROTOCOL_ERRORS`.
    """
    found: dict[str, int] = {}
    for node, caught in _with_caught(function.body, frozenset()):
        if not isinstance(node, ast.Raise) or node.exc is None:
            continue
        name = _exception_name(node.exc)
        if name and name not in caught | NEVER_DOCUMENTED | {PROTOCOL_ERRORS.get(function.name)}:
            found.setdefault(name, node.lineno)
    return found


def _with_caught(
    body: Sequence[ast.stmt], caught: frozenset[str]
) -> Iterator[tuple[ast.stmt, frozenset[str]]]:
    """Yield statements at any depth, each with the exceptions that handlers around it name."""
    for node in body:
        if isinstance(node, Function | ast.ClassDef):
            continue
        yield node, caught
        inside = caught
        if isinstance(node, ast.Try):
            types = [handler.type for handler in node.handlers if handler.type is not None]
            inside |= {
                inner.id for t in types for inner in ast.walk(t) if isinstance(inner, ast.Name)
            }
        yield from _with_caught(getattr(node, "body", []), inside)
        for other in ("orelse", "finalbody"):
            yield from _with_caught(getattr(node, other, []), caught)
        for part in (*getattr(node, "handlers", []), *getattr(node, "cases", [])):
            yield from _with_caught(part.body, caught)


def _exception_name(node: ast.expr) -> str:
    """Return the class of a raised expression, empty if it is a variable or a function's result."""
    name = _last_name(node)
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and name[:1].islower():
        name = _last_name(node.func.value)  # UsageError.of(...)
    return name if name[:1].isupper() else ""


def undocumented_raises(module: Module) -> Iterator[Finding]:
    """Yield exceptions that a public function raises by name without a `Raises` entry."""
    for made in _raising(module):
        text = _raises_text(made)
        for name, line in raised(made.node).items() if isinstance(made.node, Function) else ():
            if not re.search(rf"\b{name}\b", text):
                remedy = f"add {name} and its condition to the section 'Raises'"
                yield Finding(module.path, line, "raises", f"{made.label} raises {name}; {remedy}")


def _raising(module: Module) -> Iterator[Definition]:
    """Yield the public documented functions that raise by name, without commands of click."""
    for made in definitions(module):
        if isinstance(made.node, Function) and made.public and made.docstring and raised(made.node):
            decorators = {_last_name(decorator) for decorator in made.node.decorator_list}
            if not decorators & COMMAND_DECORATORS:
                yield made


def _raises_text(made: Definition) -> str:
    return "\n".join(line for _, line in sections(made.docstring).get("Raises", []))


def dialect(module: Module) -> Iterator[Finding]:
    """Yield names, public or not, that were replaced by the field's word."""
    of_room = DIALECT_NAMES | DIALECT_OF_ROOM.get(module.room, {})
    seen = set()
    for made in definitions(module):
        if made.name.startswith("__"):
            continue  # Python's own names, as __slots__
        bare = made.name.strip("_")
        if made.kind == "class":
            word = DIALECT_CLASSES.get(bare)
        else:
            word = DIALECT_ATTRIBUTES.get(f"{made.owner}.{bare}") or of_room.get(bare)
        if word and (made.kind, made.owner, made.name) not in seen:
            seen.add((made.kind, made.owner, made.name))
            text = f"{made.label} is a replaced name; call it {word}"
            yield Finding(module.path, made.line, "dialect", text)


def meanings(modules: Sequence[Module]) -> Iterator[Finding]:
    """Yield public class names and type aliases that two modules of the package define.

    Scripts beside the package are programs of their own: their names concern no one else.
    """
    places: defaultdict[str, list[tuple[str, int]]] = defaultdict(list)
    for module in modules:
        if module.room in SCRIPTS:
            continue
        for made in definitions(module):
            if made.public and not made.owner and (made.kind == "class" or _is_alias(made)):
                places[made.name].append((module.path, made.line))
    for name, found in places.items():
        for path, line in found:
            others = [f"{other}:{row}" for other, row in found if other != path]
            if others:
                shown = ", ".join(others[:3]) + (", ..." if len(others) > len(others[:3]) else "")
                remedy = "give each meaning a name of its own, or define it once"
                text = f"{name} is also defined in {shown}; {remedy}"
                yield Finding(path, line, "meaning", text)


def _is_alias(made: Definition) -> bool:
    """Return whether a definition at the top of a module names a type."""
    types = (ast.Name, ast.Attribute, ast.Subscript, ast.BinOp)
    return (
        made.kind == "attribute" and isinstance(made.node, types) and bool(ALIAS.match(made.name))
    )


def array_aliases(modules: Sequence[Module]) -> frozenset[str]:
    """Return the names of type aliases for arrays (`Floats = NDArray[np.float64]`)."""
    return frozenset(
        made.name
        for module in modules
        for made in definitions(module)
        if not made.owner and _is_alias(made) and made.node and _is_array(ast.unparse(made.node))
    )


def _is_array(annotation: str) -> bool:
    """Return whether an annotation is of arrays; a function of arrays is none."""
    return bool(ARRAY.search(annotation)) and not annotation.startswith("Callable")


def array_functions(module: Module, aliases: frozenset[str]) -> list[Definition]:
    """Return the public documented functions that take or return arrays.

    Parameters
    ----------
    module
        Module to search.
    aliases
        Names of type aliases for arrays; they count where the module defines or imports them.
    """
    bound = {
        alias.asname or alias.name
        for node in ast.walk(module.tree)
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("internav")
        for alias in node.names
    } | {made.name for made in definitions(module) if not made.owner}
    names = "|".join(sorted(map(re.escape, aliases & bound)))
    alias = re.compile(rf"\b(?:{names})\b") if names else ARRAY
    found = []
    for made in definitions(module):
        if made.public and made.docstring and isinstance(made.node, Function):
            text = f"{ast.unparse(made.node.args)} {ast.unparse(made.node.returns or _NOTHING)}"
            if ARRAY.search(text) or alias.search(text):
                found.append(made)
    return found


_NOTHING = ast.Constant(None)


def _states_shape(made: Definition) -> bool:
    """Return whether a docstring states a shape, or refers to one that does."""
    return bool(SHAPE.search(made.docstring) or REFERENCE.match(made.docstring))


def missing_shapes(module: Module, aliases: frozenset[str]) -> Iterator[Finding]:
    """Yield public functions of arrays whose docstring states no shape."""
    for made in array_functions(module, aliases):
        if not _states_shape(made):
            text = f"{made.label} has arrays; state their shapes, as '(n, 2) float64, metres'"
            yield Finding(module.path, made.line, "shapes", text)


def long_functions(module: Module) -> Iterator[Finding]:
    """Yield functions of more than `LONG_FUNCTION` lines of code."""
    lines = code_lines(module.source, module.tree)
    for node, length in function_lengths(module.tree, lines):
        if length > LONG_FUNCTION:
            text = (
                f"{node.name} has {length} lines of code; {LONG_FUNCTION} are the limit, name a "
                "part of it and make that a function"
            )
            yield Finding(module.path, node.lineno, "length", text)


def check(modules: Sequence[Module]) -> list[Finding]:
    """Return the findings of all rules, by file and line."""
    aliases = array_aliases(modules)
    found = list(meanings(modules))
    for module in modules:
        found += fragments(module)
        found += undocumented_raises(module)
        found += dialect(module)
        found += long_functions(module)
        found += missing_shapes(module, aliases)
    return sorted(found)


# ---------------------------------------------------------------------------------------------
# Report

COLUMNS = (
    *("room", "modules", "median", "longest"),
    *RULES[:-1],
    *("shapes %", "Raises %", "comments %"),
)
"""Heads of the report's table."""
LEGEND = f"""\
median, longest: lines of a module;
{", ".join(RULES[:-1])}: findings; shapes %: public functions of arrays that state a shape;
Raises %: exceptions raised by name in public functions that their 'Raises' names;
comments %: comments for 100 lines of code (no docstrings, comments, blank lines)"""
"""Explanation of `COLUMNS`."""


@dataclass(frozen=True)
class RoomFigures:
    """Figures of one module, or of all modules of a room together."""

    lengths: tuple[int, ...]
    """Lines of each module."""
    shaped: tuple[int, int]
    """Public functions of arrays: with a shape, all."""
    raises: tuple[int, int]
    """Exceptions raised by name in public functions: documented, all."""
    comments: int
    """Number of comments."""
    code: int
    """Lines of code."""


def module_figures(module: Module, aliases: frozenset[str]) -> RoomFigures:
    """Return the figures of one module; `aliases` are names of array types."""
    lines = code_lines(module.source, module.tree)
    arrays = array_functions(module, aliases)
    needed = sum(
        len(raised(made.node)) for made in _raising(module) if isinstance(made.node, Function)
    )
    return RoomFigures(
        (len(module.source.splitlines()),),
        (sum(map(_states_shape, arrays)), len(arrays)),
        (needed - sum(1 for _ in undocumented_raises(module)), needed),
        comment_count(module.source),
        len(lines),
    )


def combined(figures: Iterable[RoomFigures]) -> RoomFigures:
    """Return the figures of several modules together."""
    each = list(figures)
    return RoomFigures(
        tuple(length for one in each for length in one.lengths),
        (sum(one.shaped[0] for one in each), sum(one.shaped[1] for one in each)),
        (sum(one.raises[0] for one in each), sum(one.raises[1] for one in each)),
        sum(one.comments for one in each),
        sum(one.code for one in each),
    )


def report(modules: Sequence[Module]) -> str:
    """Return the figures of every room and of all together, as an aligned table."""
    aliases = array_aliases(modules)
    by_room: defaultdict[str, list[RoomFigures]] = defaultdict(list)
    for module in modules:
        by_room[module.room].append(module_figures(module, aliases))
    rooms = {module.path: module.room for module in modules}
    counts: defaultdict[str, Counter[str]] = defaultdict(Counter)
    for finding in check(modules):
        for room in (rooms[finding.path], "all"):
            counts[room][finding.rule] += 1
    rows = [_row(room, combined(by_room[room]), counts[room]) for room in sorted(by_room)]
    rows.append(
        _row("all", combined(one for room in by_room.values() for one in room), counts["all"])
    )
    return f"{_aligned([COLUMNS, *rows])}\n\n{LEGEND}"


def _row(room: str, figures: RoomFigures, counts: Counter[str]) -> tuple[str, ...]:
    return (
        room,
        str(len(figures.lengths)),
        f"{statistics.median(figures.lengths):.0f}",
        str(max(figures.lengths)),
        *(str(counts[rule]) for rule in RULES[:-1]),
        _percent(*figures.shaped),
        _percent(*figures.raises),
        f"{100 * figures.comments / max(figures.code, 1):.1f}",
    )


def _percent(part: int, whole: int) -> str:
    return f"{100 * part / whole:.0f} ({part}/{whole})" if whole else "-"


def _aligned(rows: Sequence[Sequence[str]]) -> str:
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return "\n".join(
        "  ".join([row[0].ljust(widths[0]), *map(str.rjust, row[1:], widths[1:])]) for row in rows
    )


def main(arguments: Sequence[str] | None = None) -> int:
    """Check the paths on the command line; return the exit status, 1 if there are findings."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("paths", nargs="*", type=Path, help="files or folders to check")
    parser.add_argument("--report", action="store_true", help="print figures, no findings")
    options = parser.parse_args(arguments)
    try:
        files = python_files(options.paths or [ROOT / name for name in DEFAULT_PATHS])
    except FileNotFoundError as error:
        parser.error(str(error))
    modules = [load(path) for path in files]
    if options.report:
        sys.stdout.write(report(modules) + "\n")
        return 0
    found = check(modules)
    sys.stdout.writelines(f"{finding}\n" for finding in found)
    if found:
        counts = Counter(finding.rule for finding in found)
        shown = ", ".join(f"{counts[rule]} {rule}" for rule in RULES if counts[rule])
        sys.stderr.write(f"{len(found)} findings: {shown}\n")
    return int(bool(found))


if __name__ == "__main__":
    sys.exit(main())
