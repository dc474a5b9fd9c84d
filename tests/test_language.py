"""The check of the code's language finds each fault, and nothing in clean code."""

from __future__ import annotations

import importlib.util
import re
import sys
from pathlib import Path
from textwrap import dedent

import pytest

DOCS = Path(__file__).resolve().parents[1] / "docs"


def _script(name):
    """A script of docs/ as a module; scripts import each other by name."""
    if name in sys.modules:
        return sys.modules[name]
    spec = importlib.util.spec_from_file_location(name, DOCS / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # dataclasses look their module up
    spec.loader.exec_module(module)
    return module


counting = _script("code_lines")
language = _script("check_language")
sizing = _script("size")

CLEAN = '''
"""Planar geometry of polygons."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

MARGIN_M = 0.1
"""Distance (m) that polygons keep."""


class Polygon:
    """Convex polygon.

    Parameters
    ----------
    corners : (n, 2) float64
        Corners (m), counter-clockwise.
    closed
        Whether the last corner repeats the first.
    """

    closed: bool
    """Whether the last corner repeats the first."""

    @property
    def empty(self) -> bool:
        """Whether there are no corners."""
        return False

    def __getattr__(self, name: str) -> float:
        """Return an attribute computed on demand."""
        raise AttributeError(name)

    def area(self, corners: NDArray[np.float64]) -> float:
        """Return the area (m2) of corners (n, 2).

        Raises
        ------
        ValueError
            There are fewer than three corners.
        """
        if len(corners) < 3:
            raise ValueError("too few corners")
        return 0.0

    def perimeter(self) -> float:
        """Return the perimeter (m)."""
        raise NotImplementedError

    def _of(self, path: str) -> None:
        """Of the private: not checked."""
        raise ValueError(path)
'''


def parse(source, path="geometry/polygon.py", room="geometry"):
    return language.parse(dedent(source), path, room)


def found(source, **kwargs):
    """Rule and line of every finding, and the messages."""
    findings = language.check([parse(source, **kwargs)])
    return [(finding.rule, finding.line) for finding in findings], [f.text for f in findings]


def test_clean_code_has_no_findings():
    assert found(CLEAN) == ([], [])


@pytest.mark.parametrize("word", sorted(language.FRAGMENTS))
def test_a_docstring_without_its_subject_is_found(word):
    rules, texts = found(f'def area() -> float:\n    """{word} the polygon."""\n')
    assert rules == [("fragment", 2)]
    assert "function area" in texts[0]
    assert language.FRAGMENTS[word] in texts[0]


def test_words_that_only_begin_like_a_fragment_pass():
    for start in ("Offset", "Whatever", "Hows", "Bytes", "None: no area;", "True: an area;"):
        assert found(f'def area() -> float:\n    """{start} of a polygon."""\n') == ([], [])


@pytest.mark.parametrize(
    ("source", "line"),
    [
        ('"""Of polygons."""\n', 1),
        ('class Polygon:\n    """Of corners."""\n', 2),
        (
            'class Polygon:\n    """Corners."""\n    def area(self) -> None:\n        """How."""\n',
            4,
        ),
        ('class Polygon:\n    """Corners."""\n\n    corners: int\n    """How many."""\n', 5),
        ('MARGIN_M = 0.1\n"""How near polygons may come."""\n', 2),
        ('if True:\n    MARGIN_M: float = 0.1\n    """How near polygons may come."""\n', 3),
    ],
)
def test_every_kind_of_public_docstring_is_read(source, line):
    assert found(source)[0] == [("fragment", line)]


@pytest.mark.parametrize(
    "source",
    [
        'def _area() -> None:\n    """Of a polygon."""\n',
        'class _Polygon:\n    """Of corners."""\n\n    def area(self) -> None: ...\n',
        'class _Polygon:\n    def area(self) -> None:\n        """How."""\n',
        '_MARGIN_M = 0.1\n"""How near."""\n',
    ],
)
def test_private_docstrings_are_not_read(source):
    assert found(source) == ([], [])
    assert found(source.replace("_", ""))[0]


def test_docstrings_inside_functions_are_not_read():
    source = (
        'def area() -> None:\n    """Return."""\n    def inner() -> None:\n        """Of it."""\n'
    )
    assert found(source) == ([], [])


def test_a_module_with_a_private_name_is_private():
    source = '"""Of polygons."""\n'
    assert found(source, path="geometry/_polygon.py") == ([], [])
    assert found(source, path="geometry/__init__.py")[0] == [("fragment", 1)]


def test_whether_describes_values_but_not_acts():
    function = 'def convex() -> bool:\n    """Whether it is convex."""\n'
    assert found(function)[0] == [("fragment", 2)]
    assert found('CONVEX = True\n"""Whether polygons are convex."""\n') == ([], [])


def test_a_long_function_is_found_and_its_comments_do_not_count():
    limit = language.LONG_FUNCTION
    body = "    # a comment\n\n    number += 1\n" * (limit - 1)
    fitting = f'def grown(number):\n    """Return a larger number.\n\n    Slowly.\n    """\n{body}'
    assert found(fitting) == ([], [])
    rules, texts = found(fitting + "    return number\n")
    assert rules == [("length", 1)]
    assert texts[0].startswith(f"grown has {limit + 1} lines of code; {limit} are the limit")


@pytest.mark.parametrize("section", ["Parameters", "Attributes", "Other Parameters"])
def test_descriptions_in_sections_are_read(section):
    source = f'''
    def area(corners: int, margin: float) -> None:
        """Return the area.

        {section}
        {"-" * len(section)}
        corners : int
            Number of corners.
            Of no interest: a second line.
        margin
            How near.

        Raises
        ------
        ValueError
            When there are no corners.
        """
    '''
    rules, texts = found(source)
    assert rules == [("fragment", 11)]
    assert texts[0].startswith("margin of function area begins 'How near.'")


def _raising(body, docstring='"""Return the area."""', head="def area(corners: list) -> float:"):
    lines = [head, *(f"    {line}" for line in [docstring, *body.splitlines()])]
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize(
    "body",
    [
        'raise ValueError("none")',
        "raise ValueError",
        'raise errors.ValueError("none")',
        'raise ValueError.of("none")',
        'if corners:\n    pass\nelse:\n    raise ValueError("none")',
        'try:\n    pass\nexcept ValueError:\n    raise ValueError("again")',
        'with open("x"):\n    for _ in corners:\n        raise ValueError("none")',
        'match corners:\n    case []:\n        raise ValueError("none")',
    ],
)
def test_a_raise_by_name_needs_its_section(body):
    rules, texts = found(_raising(body))
    assert [rule for rule, _ in rules] == ["raises"]
    assert "raises ValueError" in texts[0]


@pytest.mark.parametrize(
    "body",
    [
        "raise NotImplementedError",
        "raise StopIteration",
        "try:\n    pass\nexcept ValueError:\n    raise",
        "try:\n    pass\nexcept ValueError as error:\n    raise error",
        'try:\n    raise ValueError("mine")\nexcept (ValueError, KeyError):\n    pass',
        'def inner() -> None:\n    raise ValueError("none")',
        "raise wrong(corners)",
    ],
)
def test_other_raises_need_no_section(body):
    assert found(_raising(body)) == ([], [])


def test_the_section_must_name_the_exception():
    documented = (
        '"""Return the area.\n\n    Raises\n    ------\n    {}\n        No corners.\n    """'
    )
    body = 'raise ValueError("none")'
    assert found(_raising(body, documented.format("ValueError"))) == ([], [])
    assert found(_raising(body, documented.format("KeyError")))[0] == [("raises", 9)]
    assert found(_raising(body, documented.format("MyValueErrors")))[0] == [("raises", 9)]
    assert found(_raising(body, '"""Return it, or raise ValueError."""'))[0] == [("raises", 3)]


def test_commands_and_private_functions_need_no_section():
    body = 'raise ValueError("none")'
    assert found(_raising(body, head="@cli.command()\ndef area() -> None:")) == ([], [])
    assert found(_raising(body, head="def _area() -> None:")) == ([], [])
    assert found(_raising(body, head="@cache\ndef area() -> None:"))[0] == [("raises", 4)]


@pytest.mark.parametrize(
    ("source", "word"),
    [
        ("class WayFinder: ...\n", "TangentGraph"),
        ("class _WayFinder: ...\n", "TangentGraph"),
        ("def clear_m() -> None: ...\n", "shortest_path_m"),
        ("def area(thing_id: str) -> None: ...\n", "object_id"),
        ("def area(*, thing_id: str) -> None: ...\n", "object_id"),
        ("def area(*things: str) -> None: ...\n", "objects"),
        ("class Episode:\n    clear_m: float\n", "shortest_path_m"),
        (
            "class Episode:\n    def f(self) -> None:\n        self._clear_m = 0\n",
            "shortest_path_m",
        ),
        ("_PATIENCE = 3\n", "MAX_TRIES"),
        ("def f() -> None:\n    def whim() -> None: ...\n", "jitter"),
    ],
)
def test_a_replaced_name_is_found_wherever_it_is_defined(source, word):
    rules, texts = found(source)
    assert [rule for rule, _ in rules] == ["dialect"]
    assert f"call it {word}" in texts[0]


def test_replaced_names_of_modules_are_found():
    assert found("", path="world/touch.py")[0] == [("dialect", 1)]
    assert found("", path="navigation/way_finder/__init__.py")[0] == [("dialect", 1)]


def test_words_replaced_in_one_class_or_room_are_good_elsewhere():
    steps = "class {}:\n    steps: int\n"
    assert found(steps.format("Episode"))[0] == [("dialect", 2)]
    assert found(steps.format("Expert")) == ([], [])
    starts = "def f(starts: int) -> None: ...\n"
    assert found(starts, room="camp")[0] == [("dialect", 1)]
    assert found(starts, room="geometry") == ([], [])


def test_strings_calls_and_local_names_are_no_definitions():
    assert found('def f() -> None:\n    lam = g(lam=1)\n    print("WayFinder", lam)\n') == ([], [])


def test_no_remedy_is_itself_a_replaced_name():
    of_rooms = list(language.DIALECT_OF_ROOM.values())
    classes, others = language.DIALECT_CLASSES, language.DIALECT_NAMES
    for table, words in [(classes, classes), *((others | w, w) for w in [others, *of_rooms])]:
        for name, remedy in words.items():
            first = re.match(r"\w+", remedy).group()
            assert first not in table, f"{name}: {remedy}"


def test_tables_are_sorted():
    for table in (
        language.DIALECT_CLASSES,
        language.DIALECT_NAMES,
        language.DIALECT_ATTRIBUTES,
        language.DIALECT_OF_ROOM,
    ):
        assert list(table) == sorted(table)


@pytest.mark.parametrize("text", ["class Box: ...\n", "Box = NDArray[int]\n", "Box: T = A | B\n"])
def test_a_name_defined_in_two_modules_is_found_in_both(text):
    modules = [parse(text, path="a.py"), parse(text, path="b.py"), parse("", path="c.py")]
    findings = language.check(modules)
    expected = [("a.py", 1, "meaning"), ("b.py", 1, "meaning")]
    assert [(f.path, f.line, f.rule) for f in findings] == expected
    assert "b.py:1" in findings[0].text
    assert language.check(modules[:1]) == []


@pytest.mark.parametrize(
    "text",
    ["class _Box: ...\n", "BOX = 3\n", "Box = TypeVar()\n", "def f():\n    class Box: ...\n"],
)
def test_private_and_local_names_and_values_may_repeat(text):
    assert language.check([parse(text, path="a.py"), parse(text, path="b.py")]) == []


def test_scripts_may_define_what_the_package_defines():
    package = parse("class Box: ...\n", path="a.py")
    script = parse("class Box: ...\n", path="b.py", room="benchmarks")
    assert language.check([package, script]) == []


ARRAYS = 'def area(corners: {}) -> float:\n    """Return the area of {}."""\n'


@pytest.mark.parametrize("annotation", ["NDArray[np.float64]", "np.ndarray", "torch.Tensor | None"])
def test_arrays_without_a_shape_are_found(annotation):
    assert found(ARRAYS.format(annotation, "corners"))[0] == [("shapes", 1)]
    assert found(ARRAYS.format("float", "corners")) == ([], [])


@pytest.mark.parametrize(
    "text",
    [
        *("corners (n, 2)", "corners (n,)", "corners (n + 1, 2 * k)", "corners (…, 2)"),
        *("n x 2 corners", "a scalar"),
    ],
)
def test_shapes_are_recognised(text):
    assert found(ARRAYS.format("NDArray", text)) == ([], [])


def test_an_overriding_method_may_refer_to_another_docstring():
    source = 'def area(corners: NDArray) -> float:\n    """{} `Polygon`: the area."""\n'
    assert found(source.format("See")) == ([], [])
    assert found(source.format("Unlike"))[0] == [("shapes", 1)]


@pytest.mark.parametrize("text", ["corners (metres)", "corners (see there, or here and there)"])
def test_other_parentheses_are_no_shapes(text):
    assert found(ARRAYS.format("NDArray", text))[0] == [("shapes", 1)]


def test_aliases_of_arrays_are_arrays_where_they_are_imported():
    typing = parse("Floats = NDArray[np.float64]\n", path="core/typing.py", room="core")
    user = ARRAYS.format("Floats", "corners")
    importing = "from internav_data.core.typing import Floats\n\n\n" + user
    assert [f.rule for f in language.check([typing, parse(importing)])] == ["shapes"]
    assert language.check([typing, parse(user)]) == []
    function = parse("Floats = Callable[[NDArray], int]\n", path="core/typing.py", room="core")
    assert language.check([function, parse(importing)]) == []


def test_the_report_counts():
    source = CLEAN + "\n\n# A comment.\ndef f(whim: int) -> None:  # noqa: X\n    pass\n"
    table = language.report([parse(source)]).splitlines()
    row = dict(zip(re.split(r" {2,}", table[0]), re.split(r" {2,}", table[1]), strict=True))
    assert row["room"] == "geometry"
    assert row["dialect"] == "1"
    assert row["fragment"] == row["raises"] == row["meaning"] == row["length"] == "0"
    assert row["shapes %"] == row["Raises %"] == "100 (1/1)"
    # 19 lines of code in CLEAN and 2 below it: 1 comment for 21.
    assert row["comments %"] == f"{100 / 21:.1f}"


def test_the_command_fails_on_findings_and_names_them(tmp_path, capsys):
    path = tmp_path / "polygon.py"
    path.write_text('"""Of polygons."""\n')
    assert language.main([str(tmp_path)]) == 1
    out, err = capsys.readouterr()
    assert out.startswith(f"{path}:1: fragment: docstring of module polygon begins 'Of polygons.'")
    assert err == "1 findings: 1 fragment\n"
    assert language.main(["--report", str(path)]) == 0
    path.write_text('"""Polygons."""\n')
    assert language.main([str(path)]) == 0
    with pytest.raises(SystemExit):
        language.main([str(tmp_path / "missing.py")])


def test_docstrings_comments_and_blank_lines_are_no_code():
    import ast

    source = 'A = """x\ny"""\n"""Doc.\n\nMore."""\n\n# Comment.\nf(\n    1,\n\n)  # Comment.\n'
    assert counting.code_lines(source, ast.parse(source)) == {1, 2, 8, 9, 11}
    assert counting.comment_count(source) == 2
    assert counting.comment_count("x = 1  # noqa: E501\ny: int  # type: ignore\n") == 0


def test_functions_are_measured_without_their_docstrings():
    import ast

    source = (
        'def f():\n    """Doc."""\n    # Comment.\n\n    def g():\n        return 1\n    return g\n'
    )
    tree = ast.parse(source)
    lengths = counting.function_lengths(tree, counting.code_lines(source, tree))
    assert [length for _, length in lengths] == [4, 2]


@pytest.mark.parametrize(
    ("path", "room"),
    [
        ("internav_data/camp/agents/nie.py", "camp"),
        ("internav_data/__init__.py", "internav_data"),
        ("cli/internav_cli/main.py", "cli"),
        ("tests/cli/test_main.py", "tests"),
    ],
)
def test_rooms_of_files(path, room):
    assert counting.room_of(counting.ROOT / path) == room


def test_sizes_per_room_and_file(tmp_path):
    files = {"internav_data/camp/a.py": 3, "internav_data/camp/b.py": 1, "cli/main.py": 2}
    for name, lines in files.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("x = 1\n" * lines + "# Comment.\n")
    sizes = sizing.sizes_of(tmp_path)
    assert [line.split()[-2:] for line in sizing.report(sizes, tmp_path).splitlines()[1:]] == [
        ["2", "4"],
        ["2", "4"],
        ["1", "2"],
    ]
    listed = sizing.report(sizes, tmp_path, "camp").splitlines()
    assert listed[1].split() == ["internav_data/camp/a.py", "3"]
    with pytest.raises(LookupError, match="rooms are camp, cli"):
        sizing.report(sizes, tmp_path, "kitchen")
