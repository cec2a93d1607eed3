"""Every map takes torch tensors: the numbers of NumPy, gradients right when straight."""

import numpy as np
import pytest

from clarke_gym import clarke, kinematics
from clarke_gym.clarke import modes
from clarke_gym.clarke.layouts import Layout, map_design
from clarke_gym.clarke.sampling import sample_disk
from clarke_gym.kinematics import sample_tips
from clarke_gym.kinematics.chain import SpaceChain
from clarke_gym.kinematics.extensible import robot_from_extensible, robot_to_extensible
from clarke_gym.kinematics.inverse import (
    bending_from_quaternion,
    segment_inverse,
    segment_inverse_extensible,
)
from clarke_gym.kinematics.jacobians import segment_jacobian, tip_jacobian
from clarke_gym.kinematics.reachability import is_reachable, nearest_on_dome
from clarke_gym.robots.joints import stroke_to_displacement
from clarke_gym.robots.presets import PRESETS, make_robot

torch = pytest.importorskip("torch")

RING = Layout.symmetric(5, 0.01)
ODD = Layout([0.1, 1.9, 4.0, 5.0], [0.01, 0.012, 0.009, 0.01])
SLIM = SpaceChain(PRESETS["slim"])
ONE = SpaceChain(make_robot(n_tendons=7))
LENGTHS = np.array([0.2, 0.15])

MAPS = {
    "to_clarke": (clarke.to_clarke, (5,)),
    "from_clarke": (lambda x: clarke.from_clarke(x, 7), (2,)),
    "project": (clarke.project, (5,)),
    "to_modes": (modes.to_modes, (6,)),
    "from_modes": (modes.from_modes, (6,)),
    "normalised": (lambda x: modes.normalised(x, 1e-3), (5,)),
    "layout_to_clarke": (ODD.to_clarke, (4,)),
    "layout_from_clarke": (ODD.from_clarke, (2,)),
    "to_extensible": (lambda x: RING.to_extensible(x, 0.2), (5,)),
    "from_extensible": (lambda x: RING.from_extensible(x, 0.21, 0.2), (2,)),
    "map_design": (lambda x: map_design(x, ODD, RING, 1.5), (4,)),
    "robot_to_extensible": (lambda x: robot_to_extensible(x, [RING, ODD], [0.2, 0.1]), (9,)),
    "robot_from_extensible": (
        lambda x: robot_from_extensible(x, 0.2 + x[..., 0], [RING, ODD], [0.2, 0.1]),
        (2, 2),
    ),
    "stroke": (lambda x: stroke_to_displacement(x, "bellows"), (5,)),
    "segment_pose": (lambda x: kinematics.segment_pose(x, np.float64(0.2)), (2,)),
    "forward": (lambda x: kinematics.forward(x, LENGTHS), (2, 2)),
    "backbone": (lambda x: kinematics.backbone(x, LENGTHS, 5), (2, 2)),
    "clarke_to_bending": (lambda x: kinematics.clarke_to_bending(x, LENGTHS), (2, 2)),
    "bending_to_clarke": (lambda x: kinematics.bending_to_clarke(x, LENGTHS), (2, 2)),
    "segment_jacobian": (lambda x: segment_jacobian(x, 0.2), (2,)),
    "tip_jacobian": (lambda x: tip_jacobian(x, LENGTHS, extensible=True), (2, 2)),
    "inverse_extensible": (lambda x: segment_inverse_extensible(_up(x)), (3,)),
    "inverse": (lambda x: segment_inverse(_up(x), 0.2), (3,)),
    "nearest_inverse": (lambda x: nearest_on_dome(0.9 * _up(x), 0.2, 2.0), (3,)),
    "from_quaternion": (lambda x: bending_from_quaternion(_unit(x)), (3,)),
    "sample_tips": (lambda x: sample_tips(0.5 + 0.1 * x * x, 1.5, 0.01), (2,)),
    "sample_disk": (lambda x: sample_disk(0.5 + 0.1 * x * x, 0.01), (2,)),
    "f_dyn": (SLIM.f_dyn, (6,)),
    "f_dyn_inverse": (SLIM.f_dyn_inverse, (6,)),
    "f_dep": (SLIM.f_dep, (6,)),
    "f_dep_inverse": (SLIM.f_dep_inverse, (2, 2)),
    "f_ind": (SLIM.f_ind, (2, 2)),
    "chain": (lambda x: ONE.f_ind(ONE.f_dep(ONE.f_dyn(x))), (7,)),
    "chain_jacobian": (lambda x: ONE.jacobian("actuator", "pose", x), (1, 2)),
}


def _up(x):
    """Positions around the tip of the straight segment."""
    offset = np.array([0.0, 0.0, 0.2])
    return x + (offset.astype(x.dtype) if isinstance(x, np.ndarray) else x.new_tensor(offset))


def _unit(x):
    """Quaternions near 1 from a vector part."""
    square = (x * x).sum(-1)[..., None]
    xp = np if isinstance(x, np.ndarray) else torch
    return xp.concat([xp.ones_like(square), x], -1) / xp.sqrt(1.0 + square)


def leaves(result):
    return list(result) if isinstance(result, tuple) else [result]


def sample(shape, dtype, size=0.03):
    return (size * np.random.default_rng(5).normal(size=(3, *shape))).astype(dtype)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("name", MAPS)
def test_torch_equals_numpy_in_value_kind_and_precision(name, dtype):
    function, shape = MAPS[name]
    for size in (0.0, 0.03, 1.0) if "inverse" not in name else (0.0, 0.03):
        given = sample(shape, dtype, size)
        expected = leaves(function(given))
        for want, got in zip(expected, leaves(function(torch.from_numpy(given))), strict=True):
            assert isinstance(got, torch.Tensor)
            assert want.dtype == dtype == got.numpy().dtype
            assert tuple(got.shape) == want.shape
            scale = max(1.0, np.abs(want).max())
            tolerance = scale * (2e-6 if dtype == np.float32 else 2e-14)
            np.testing.assert_allclose(got.numpy(), want, rtol=0, atol=tolerance)


@pytest.mark.parametrize(
    "name", [name for name in MAPS if name not in ("normalised", "sample_tips")]
)
@pytest.mark.parametrize("size", [0.0, 1e-300, 1e-9, 0.03])
def test_gradients_are_finite_and_right_also_when_straight(name, size):
    function, shape = MAPS[name]
    start = torch.from_numpy(sample(shape, np.float64, size)[0])
    for k, output in enumerate(leaves(function(start))):
        jacobian = torch.autograd.functional.jacobian(
            lambda x, k=k: leaves(function(x))[k], start, vectorize=False
        ).reshape(output.numel(), -1)
        h, columns = 1e-4, []
        for unit in torch.eye(start.numel(), dtype=torch.float64).reshape(-1, *start.shape):
            steps = [
                leaves(function(start + c * h * unit))[k].ravel() for c in (1.0, -1.0, 2.0, -2.0)
            ]
            columns.append((8 * (steps[0] - steps[1]) - (steps[2] - steps[3])) / (12 * h))
        expected = torch.stack(columns, dim=1)
        assert torch.isfinite(jacobian).all()
        scale = max(1.0, float(expected.abs().max()))
        np.testing.assert_allclose(jacobian, expected, rtol=0, atol=1e-9 * scale)


def test_gradient_of_the_normalised_displacement_at_rest():
    rest = torch.zeros(5, dtype=torch.float64)
    jacobian = torch.autograd.functional.jacobian(lambda x: modes.normalised(x, 1e-3), rest)
    np.testing.assert_allclose(jacobian, 1e3 * np.eye(5), rtol=1e-12)


def test_gradient_descent_from_the_straight_robot_brings_the_tip_to_a_goal():
    goal = kinematics.forward(torch.tensor([[0.9, 0.4]]), [0.2])[0]
    rho = torch.zeros(7, requires_grad=True)
    optimiser = torch.optim.Adam([rho], lr=3e-4)
    for _ in range(300):
        optimiser.zero_grad()
        loss = ((ONE.f_ind(ONE.f_dep(rho))[0] - goal) ** 2).sum()
        loss.backward()
        optimiser.step()
    tip = ONE.f_ind(ONE.f_dep(rho.detach()))[0]
    assert float((tip - goal).norm()) < 1e-4


def test_reachability_answers_in_torch():
    tips = torch.tensor([[0.0, 0.0, 0.2], [0.0, 0.0, 0.21], [0.0, 0.0, -0.1]], dtype=torch.float64)
    assert is_reachable(tips[:2], 0.2, 1.5).tolist() == [True, False]
    assert is_reachable(tips, (0.19, 0.22), 1.5).tolist() == [True, True, False]
