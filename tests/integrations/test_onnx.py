"""ONNX models act as the policies that they were made of."""

import json

import numpy as np
import onnx
import pytest
from onnx.reference import ReferenceEvaluator

from clarke_gym.control import load_policy
from clarke_gym.integrations.onnx import export_onnx

POLICIES = ["reach", "pose", "track"]


@pytest.mark.parametrize("name", POLICIES)
def test_the_model_acts_as_the_policy(name, tmp_path):
    policy = load_policy(f"policies/{name}")
    path = tmp_path / "policy.onnx"
    export_onnx(policy, path)
    size = policy.layers[0][0].shape[1]
    observations = np.random.default_rng(0).uniform(-1, 1, (64, size)).astype(np.float32)
    session = ReferenceEvaluator(onnx.load(path))
    (actions,) = session.run(None, {"observation": observations})
    np.testing.assert_allclose(actions, policy.act(observations), atol=2e-5)
    assert np.abs(actions).max() <= 1.0
    (one,) = session.run(None, {"observation": observations[:1]})
    np.testing.assert_allclose(one, actions[:1], atol=1e-6)


def test_the_model_says_what_it_was_trained_for(tmp_path):
    path = tmp_path / "policy.onnx"
    export_onnx(load_policy("policies/reach"), path)
    properties = {entry.key: entry.value for entry in onnx.load(path).metadata_props}
    assert json.loads(properties["about"])["env"]["id"] == "clarke_gym/Reach-v0"


def test_files_are_not_replaced(tmp_path):
    path = tmp_path / "mine.onnx"
    path.write_text("mine")
    with pytest.raises(FileExistsError):
        export_onnx(load_policy("policies/reach"), path)
    assert path.read_text() == "mine"
