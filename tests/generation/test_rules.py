"""The digest of the code covers all modules that take part in making a scene."""

from pathlib import Path

from internav_data.generation import rules
from internav_data.physics.cache import solver_modules


def test_every_module_that_a_scene_imports_is_in_the_digest():
    root = Path(rules.__file__).parents[2]
    used = solver_modules(root, ("internav_data.generation.scenes",))
    package = root / "internav_data"
    outside = {path for path in used.values() if path.parent != package}
    assert outside <= set(rules.source_files())
    rooms = {path.relative_to(package).parts[0] for path in outside}
    assert rooms == set(rules.ROOMS), "names that packages import lazily are followed too"


def test_changed_code_has_another_digest(monkeypatch, tmp_path):
    before = rules.source_digest()
    path = tmp_path / "internav_data" / "episodes" / "new.py"
    path.parent.mkdir(parents=True)
    path.write_text("a = 1\n")
    digests = set()
    for text in ("a = 1\n", "a = 2\n"):
        path.write_text(text)
        monkeypatch.setattr(rules, "__file__", str(tmp_path / "internav_data" / "g" / "rules.py"))
        digests.add(rules.source_digest.__wrapped__())
    assert len(digests | {before}) == 3
