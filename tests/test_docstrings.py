"""Every public function says what it takes and gives, with an example that runs."""

import importlib
import inspect
import pkgutil

import pytest

import clarke_gym

INTERNAL = ("clarke_gym.numerics", "clarke_gym.rendering.room", "clarke_gym.figures.canvas")
"""Rooms that no user works in."""


def public_modules():
    for found in pkgutil.walk_packages(clarke_gym.__path__, "clarke_gym."):
        private = any(part.startswith("_") for part in found.name.split("."))
        if not private and not found.name.startswith(INTERNAL):
            yield importlib.import_module(found.name)


def members(kind):
    return [
        pytest.param(inspect.unwrap(member), id=f"{module.__name__}.{name}")
        for module in public_modules()
        for name, member in vars(module).items()
        if kind(member) and member.__module__ == module.__name__ and name[0] != "_"
    ]


def is_function(member):
    return inspect.isfunction(inspect.unwrap(member)) if callable(member) else False


@pytest.mark.parametrize("function", members(is_function))
def test_functions_tell_parameters_returns_and_an_example(function):
    text, signature = inspect.getdoc(function) or "", inspect.signature(function)
    if signature.parameters:
        assert "Parameters\n-----" in text
    if signature.return_annotation not in (None, "None"):
        assert "Returns\n-----" in text
    assert "Examples\n-----" in text
    assert ">>> " in text


@pytest.mark.parametrize("owner", members(inspect.isclass))
def test_classes_and_their_public_methods_are_described(owner):
    assert owner.__doc__
    for name, member in vars(owner).items():
        function = getattr(member, "fget", None) or getattr(member, "func", member)
        if inspect.isfunction(function) and name[0] != "_":
            assert inspect.getdoc(function), f"{owner.__name__}.{name}"
