"""The chain of spaces: round trips, Jacobians against differences, maps by their definitions."""

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clarke_gym import kinematics
from clarke_gym.kinematics.chain import SPACES, SpaceChain
from clarke_gym.robots import Robot, Segment
from clarke_gym.robots.presets import PRESETS, make_robot

SEED = st.integers(0, 2**31)
N = st.integers(3, 64)


def bends(robot, rng, batch=(), share=1.0):
    uniforms = rng.random((*batch, robot.n_segments, 2))
    return share * kinematics.sample_dome(uniforms, robot.max_bending)


def mixed_robot(n, seed, segments):
    rng = np.random.default_rng(seed)
    return Robot(
        tuple(
            Segment(
                n_tendons=n + k,
                length_m=0.1 + 0.1 * rng.random(),
                pitch_radius_m=0.006 + 0.006 * rng.random(),
                tendon_angles_rad=tuple(
                    2 * np.pi * np.arange(n + k) / (n + k) + rng.uniform(-0.5, 0.5, n + k) / n
                ),
                tendon_radii_m=tuple(0.005 + 0.01 * rng.random(n + k)),
            )
            for k in range(segments)
        )
    )


@settings(max_examples=60)
@given(N, SEED, st.integers(1, 3))
def test_round_trip_from_joint_to_pose_and_back(n, seed, segments):
    robot = mixed_robot(n, seed, segments)
    chain = SpaceChain(robot, 0.013)
    bending = bends(robot, np.random.default_rng(seed))
    rho = chain.from_clarke(kinematics.bending_to_clarke(bending, robot.pitch_radii))
    curvature = chain.f_dep(rho)
    np.testing.assert_allclose(curvature * robot.lengths[:, None], bending, rtol=0, atol=1e-12)
    np.testing.assert_allclose(chain.f_dep_inverse(curvature), rho, rtol=0, atol=1e-15)
    np.testing.assert_allclose(chain.f_dyn(chain.f_dyn_inverse(rho)), rho, rtol=1e-14)
    pose = chain.f_ind(curvature)
    start = bending + 1e-3
    if segments == 1:
        back = chain.f_dep_inverse(chain.f_ind_inverse(*pose))
        np.testing.assert_allclose(back, rho, rtol=0, atol=1e-12)
    else:
        found = chain.f_ind_inverse(pose[0], start=start)
        np.testing.assert_allclose(chain.f_ind(found)[0], pose[0], rtol=0, atol=1e-12)
    if segments == 3:  # six numbers of a pose determine six of a shape
        jacobian = chain.jacobian("arc", "pose", curvature)
        if np.linalg.cond(jacobian) < 1e3:
            back = chain.f_dep_inverse(chain.f_ind_inverse(*pose, start=start))
            np.testing.assert_allclose(back, rho, rtol=0, atol=1e-11)


@given(N, SEED)
def test_maps_follow_their_definitions(n, seed):
    robot = make_robot(n_tendons=n)
    chain = SpaceChain(robot)
    segment = robot.segments[0]
    rho = np.random.default_rng(seed).normal(size=n) * 1e-3
    expected = [
        2.0 / n * rho @ trig(segment.angles) / (segment.length_m * segment.pitch_radius_m)
        for trig in (np.cos, np.sin)
    ]
    np.testing.assert_allclose(chain.f_dep(rho)[0], expected, rtol=0, atol=1e-13)


def test_bellows_turn_the_motor_round():
    tendon, bellows = (
        SpaceChain(Robot((Segment(joint_type=kind),)), 0.02) for kind in ("tendon", "bellows")
    )
    angles = np.array([0.1, -0.2, 0.3])
    np.testing.assert_allclose(tendon.f_dyn(angles), 0.02 * angles)
    np.testing.assert_allclose(bellows.f_dyn(angles), -0.02 * angles)


@pytest.mark.parametrize("name", ["default", "five_tendons", "slim", "hardware"])
@pytest.mark.parametrize("source", SPACES[:-1])
def test_jacobians_of_all_forward_pairs_equal_differences(name, source):
    robot = PRESETS[name]
    chain = SpaceChain(robot)
    forward = [
        chain.f_dyn,
        chain.to_clarke,
        chain.clarke_to_arc,
        lambda curvature: chain.f_ind(curvature)[0],
    ]
    rng = np.random.default_rng(3)
    curvature = bends(robot, rng) / robot.lengths[:, None]
    rho = chain.f_dep_inverse(curvature)
    points = [chain.f_dyn_inverse(rho), rho, chain.to_clarke(rho), curvature]
    start = SPACES.index(source)
    for end in range(start + 1, 5):

        def chained(x, end=end):
            for step in forward[start:end]:
                x = step(x)
            return x.ravel()

        jacobian = chain.jacobian(source, SPACES[end], curvature)
        point, scale = points[start], max(np.abs(points[start]).max(), 1e-6)
        h = 1e-4 * scale
        columns = []
        for unit in np.eye(point.size).reshape(-1, *point.shape):
            near = chained(point + h * unit) - chained(point - h * unit)
            far = chained(point + 2 * h * unit) - chained(point - 2 * h * unit)
            columns.append((8 * near - far) / (12 * h))
        expected = np.stack(columns, axis=1)
        rows = slice(None) if end < 4 else slice(3)
        np.testing.assert_allclose(
            jacobian[rows], expected, rtol=0, atol=1e-10 * max(1.0, np.abs(jacobian).max())
        )


def test_joint_to_pose_jacobian_in_high_precision():
    """Position of one segment from displacements, all in 60 digits, to 1e-12."""
    robot = make_robot(n_tendons=5)
    chain = SpaceChain(robot)
    rho = chain.f_dep_inverse(np.array([[3.0, -4.0]]))
    psi = [mpmath.mpf(2) * mpmath.pi * i / 5 for i in range(5)]

    def tip(values):
        x, y = (
            mpmath.mpf(2) / 5 * sum(v * f(a) for v, a in zip(values, psi, strict=True)) / d
            for f, d in ((mpmath.cos, mpmath.mpf(0.01)), (mpmath.sin, mpmath.mpf(0.01)))
        )
        phi = mpmath.sqrt(x * x + y * y)
        lateral = (1 - mpmath.cos(phi)) / phi**2
        return mpmath.mpf(0.2) * mpmath.matrix([x * lateral, y * lateral, mpmath.sin(phi) / phi])

    with mpmath.workdps(60):
        h, values = mpmath.mpf(10) ** -20, [mpmath.mpf(float(r)) for r in rho]
        for k in range(5):
            ahead, behind = list(values), list(values)
            ahead[k] += h
            behind[k] -= h
            slope = (tip(ahead) - tip(behind)) / (2 * h)
            column = chain.jacobian("joint", "pose", np.array([[3.0, -4.0]]))[:3, k]
            np.testing.assert_allclose(column, [float(s) for s in slope], rtol=1e-12, atol=1e-12)


def test_backward_jacobians_invert_forward_ones():
    robot = PRESETS["slim"]
    chain = SpaceChain(robot)
    curvature = np.array([[3.0, -4.0], [6.0, 2.0]])
    for source, target in (("clarke", "arc"), ("actuator", "joint")):
        product = chain.jacobian(target, source) @ chain.jacobian(source, target)
        np.testing.assert_allclose(product, np.eye(len(product)), rtol=0, atol=1e-12)
    there = chain.jacobian("clarke", "pose", curvature)
    back = chain.jacobian("pose", "clarke", curvature)
    np.testing.assert_allclose(back @ there, np.eye(4), rtol=0, atol=1e-10)
    onto = chain.jacobian("clarke", "joint") @ chain.jacobian("joint", "clarke")
    np.testing.assert_allclose(onto, robot.decoder @ robot.encoder, rtol=0, atol=1e-15)


@pytest.mark.parametrize("batch", [(), (3,), (2, 3)])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_batches_and_precision_pass_through_the_whole_chain(batch, dtype):
    robot = PRESETS["slim"]
    chain = SpaceChain(robot)
    rho = (np.random.default_rng(0).normal(size=(*batch, 6)) * 1e-3).astype(dtype)
    curvature = chain.f_dep(rho)
    position, quaternion = chain.f_ind(curvature)
    jacobian = chain.jacobian("actuator", "pose", curvature)
    assert (curvature.shape, position.shape) == ((*batch, 2, 2), (*batch, 3))
    assert (quaternion.shape, jacobian.shape) == ((*batch, 4), (*batch, 6, 6))
    everything = (chain.f_dyn(rho), chain.f_dyn_inverse(rho), curvature, position, quaternion)
    for array in (*everything, chain.f_dep_inverse(curvature), jacobian):
        assert array.dtype == dtype


def test_one_segment_keeps_its_limit_and_takes_an_orientation():
    chain = SpaceChain(Robot((Segment(max_bending_rad=0.5),)))
    position, turn = chain.f_ind(np.array([[2.0, 0.5]]))
    for more in ({}, {"quaternion": turn}):
        found = chain.f_ind_inverse(position, **more)
        np.testing.assert_allclose(found, [[2.0, 0.5]], rtol=0, atol=1e-9)
    assert chain.f_ind_inverse(np.zeros((0, 3))).shape == (0, 1, 2)
    edge = chain.f_ind(np.array([[2.5 * np.cos(0.3), 2.5 * np.sin(0.3)]], np.float32))[0]
    assert chain.f_ind_inverse(edge).dtype == np.float32
    with pytest.raises(ValueError, match=r"a bend of 1\.2 rad, beyond the robot's limit of 0\.5"):
        chain.f_ind_inverse(chain.f_ind(np.array([[6.0, 0.0]]))[0])
    with pytest.raises(ValueError, match="no shape found"):
        chain.f_ind_inverse(position, quaternion=np.array([1.0, 0.0, 0.0, 0.0]))
    with pytest.raises(ValueError, match="no shape found"):
        chain.f_ind_inverse(np.array([np.nan, 0.0, 0.2]))


def test_mistakes_are_named():
    chain = SpaceChain(PRESETS["two_segment"])
    with pytest.raises(ValueError, match="last axis of 6"):
        chain.f_dep(np.zeros(5))
    with pytest.raises(ValueError, match="source must be one of"):
        chain.jacobian("motor", "pose")
    with pytest.raises(ValueError, match="curvature must be given"):
        chain.jacobian("joint", "pose")
    with pytest.raises(ValueError, match="must differ"):
        chain.jacobian("joint", "joint")
    with pytest.raises(ValueError, match="misses by"):
        chain.f_ind_inverse(np.array([0.0, 0.0, 2.0]), starts=2)
    with pytest.raises(ValueError, match="spool_radius_m"):
        SpaceChain(Robot(), 0.0)
