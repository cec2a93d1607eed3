"""The shape of the house: what must stay simple is counted."""

import ast
import sys
from collections import defaultdict
from pathlib import Path

import gymnasium as gym
import pytest

import clarke_gym

ROOT = Path(clarke_gym.__file__).parent
ENGINES = {"engines.py", "single_engine.py", "batch_engine.py"}


def sources():
    return sorted(ROOT.rglob("*.py"))


def decides(node):
    """Whether a node asks if one robot or many are computed."""
    if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "isinstance":
        kinds = ast.unparse(node.args[1])
        subject = ast.unparse(node.args[0])
        numbers = {"float", "list", "One", "Many", "SingleEngine", "BatchEngine"}
        return set(kinds.replace("|", " ").split()) & numbers and subject not in CHECKED
    return isinstance(node, ast.arg | ast.Attribute) and (
        getattr(node, "arg", getattr(node, "attr", "")).strip("_") == "scalar"
    )


CHECKED = {"value", "listed", "values"}
"""Names of what users give where it is checked: not decisions about one robot or many."""


def test_one_robot_or_many_is_known_in_numerics_and_the_engines_alone():
    found = []
    for path in sources():
        if path.parent.name == "numerics" or path.name in ENGINES:
            continue
        for node in ast.walk(ast.parse(path.read_text())):
            if decides(node):
                found.append(f"{path.relative_to(ROOT)}:{node.lineno}: {ast.unparse(node)}")
    assert found == []


def module_of(path):
    return ".".join(path.relative_to(ROOT.parent).with_suffix("").parts)


def imports(path):
    """Return what a file imports, inside its functions, too."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and node.module:
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def test_no_circles():
    packages = ("clarke_gym", "agents", "benchmarks")
    files = [path for name in packages for path in (ROOT.parent / name).rglob("*.py")]
    modules = {module_of(path) for path in files}
    edges = defaultdict(set)
    for path in files:
        edges[module_of(path)] = set(imports(path)) & modules - {module_of(path)}
    done, path = set(), []

    def visit(module):
        assert module not in path, " -> ".join([*path[path.index(module) :], module])
        if module in done:
            return
        path.append(module)
        for other in sorted(edges[module]):
            visit(other)
        path.pop()
        done.add(module)

    for module in sorted(modules):
        visit(module)


def files_of_a_step(**keywords):
    env = gym.make("clarke_gym/Reach-v0", representation="clarke", **keywords)
    env.reset(seed=0)
    action = env.action_space.sample()
    env.step(action)
    files = set()

    def watch(frame, event, argument):
        name = frame.f_code.co_filename
        if name.startswith(str(ROOT)):
            files.add(str(Path(name).relative_to(ROOT)))

    sys.setprofile(watch)
    try:
        env.step(action)
    finally:
        sys.setprofile(None)
    return sorted(files)


@pytest.mark.parametrize(("physics", "most"), [("constant_curvature", 20), ("mujoco", 23)])
def test_a_step_in_clarke_coordinates_passes_through_few_files(physics, most):
    files = files_of_a_step(physics=physics, n_tendons=7)
    assert len(files) <= most, files
