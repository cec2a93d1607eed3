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


def imports_at_the_top(path):
    module = ".".join(("clarke_gym", *path.relative_to(ROOT).with_suffix("").parts))
    for node in ast.parse(path.read_text()).body:
        if isinstance(node, ast.ImportFrom) and node.module and "clarke_gym" in node.module:
            for alias in node.names:
                yield module, f"{node.module}.{alias.name}"
                yield module, node.module


def test_no_circles():
    modules = {
        ".".join(("clarke_gym", *p.relative_to(ROOT).with_suffix("").parts)) for p in sources()
    }
    edges = defaultdict(set)
    for path in sources():
        for here, there in imports_at_the_top(path):
            if there in modules and there != here:
                edges[here].add(there)
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


@pytest.mark.parametrize(("physics", "most"), [("constant_curvature", 21), ("mujoco", 24)])
def test_a_step_in_clarke_coordinates_passes_through_few_files(physics, most):
    files = files_of_a_step(physics=physics, n_tendons=7)
    assert len(files) <= most, files
