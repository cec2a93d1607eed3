"""Trained policies as ONNX models, for controllers that run neither Python nor a learning library.

Needs the extra ``onnx``.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from clarke_gym.control.network import NetworkPolicy

try:
    import onnx
    from onnx import TensorProto, helper, numpy_helper
except ModuleNotFoundError as error:
    raise ModuleNotFoundError(
        f'clarke_gym.integrations.onnx needs ONNX ({error}): pip install "clarke_gym[onnx]"',
        name=error.name,
    ) from error

OPSET = 13
"""Version of the operators: Gemm, Tanh and Clip have not changed since."""


def export_onnx(policy: NetworkPolicy, path: str | Path) -> None:
    """Write a policy as an ONNX model that takes ``observation`` and gives ``action``.

    Parameters
    ----------
    policy : NetworkPolicy
        As `clarke_gym.control.load_policy` reads it.
    path : str or Path
        A new file. The model computes in float32; its first axis is a batch of any size, and what
        ``policy.json`` says is in its metadata under "about". Of a ``goal_env`` an observation is
        achieved goal, desired goal and observation, one after the other.

    Raises
    ------
    FileExistsError
        If there is a file already.

    Examples
    --------
    >>> import tempfile
    >>> policy = NetworkPolicy([(np.array([[2.0, 0.0]]), np.array([0.25]))], {})
    >>> path = Path(tempfile.mkdtemp()) / "policy.onnx"
    >>> export_onnx(policy, path)
    >>> [output.name for output in onnx.load(path).graph.output]
    ['action']
    """
    nodes, weights, value = [], [], "observation"
    last = len(policy.layers) - 1
    for i, (weight, bias) in enumerate(policy.layers):
        for name, array in ((f"weight_{i}", weight), (f"bias_{i}", bias)):
            weights.append(numpy_helper.from_array(array.astype(np.float32), name))
        linear = f"linear_{i}"
        inputs = [value, f"weight_{i}", f"bias_{i}"]
        nodes.append(helper.make_node("Gemm", inputs, [linear], transB=1))
        value = f"hidden_{i}"
        if i < last:
            nodes.append(helper.make_node("Tanh", [linear], [value]))
        else:
            nodes.append(helper.make_node("Clip", [linear, "low", "high"], ["action"]))
    for name, bound in (("low", -1.0), ("high", 1.0)):
        weights.append(numpy_helper.from_array(np.array(bound, np.float32), name))
    sizes = {"observation": policy.layers[0][0].shape[1], "action": len(policy.layers[-1][1])}
    observation, action = (
        helper.make_tensor_value_info(name, TensorProto.FLOAT, ["batch", size])
        for name, size in sizes.items()
    )
    graph = helper.make_graph(nodes, "policy", [observation], [action], weights)
    model = helper.make_model(
        graph, opset_imports=[helper.make_opsetid("", OPSET)], producer_name="clarke_gym"
    )
    model.ir_version = 8  # the oldest that holds all this
    helper.set_model_props(model, {"about": json.dumps(policy.about)})
    onnx.checker.check_model(model, full_check=True)
    with Path(path).open("xb") as file:
        file.write(model.SerializeToString())
