"""What the explorer in the browser needs of the package, and the golden numbers it must meet.

python -m benchmarks.explorer_data
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np

import clarke_gym  # noqa: F401  (registers the environments)
from clarke_gym import clarke, kinematics
from clarke_gym.control import NetworkPolicy, load_policy, make_controller
from clarke_gym.envs.limits import CommandLimits
from clarke_gym.kinematics.jacobians import tip_jacobian
from clarke_gym.numerics.arrays import FloatArray
from clarke_gym.numerics.batch import Many
from clarke_gym.physics.constant_curvature import ConstantCurvature
from clarke_gym.physics.mjcf import mjcf
from clarke_gym.physics.mujoco.model import PROFILES
from clarke_gym.physics.mujoco.physics import MujocoPhysics
from clarke_gym.robots import Robot, make_robot
from clarke_gym.robots.joint_vector import JointVector, Splitter
from clarke_gym.robots.stiffness import bending_stiffness

ROOT = Path(__file__).resolve().parent.parent
DATA = ROOT / "docs" / "explorer" / "data"
GOLDEN = ROOT / "tests" / "explorer" / "golden.json"

CONTROL_DT = 0.05

ROBOTS: dict[str, tuple[str, Robot]] = {
    "default": ("default, one segment", make_robot()),
    "default2": ("default, two segments", make_robot(n_segments=2)),
    "default3": ("default, three segments", make_robot(n_segments=3)),
    "soft_arm": ("soft arm", make_robot("soft_arm")),
    "slim": ("slim, two segments", make_robot("slim")),
    "hardware": ("hardware, three segments", make_robot("hardware")),
}
"""Robots of the explorer by key: what it calls them, and what they are."""

POLICIES = {"default": "reach", "default2": "reach_2_segments", "default3": "reach_3_segments"}
"""Released policies by the robot that they were trained on."""


def described(key: str) -> dict[str, Any]:
    """Return what the explorer knows of a robot."""
    label, robot = ROBOTS[key]
    try:
        make_robot(robot, n_tendons=robot.n_tendons[0] + 1)
        even = True
    except ValueError:
        even = False
    whole_dt = PROFILES["fast"].slack_dt_s
    return {
        "name": key,
        "label": label,
        "even": even,
        "max_tendon_speed_m_s": robot.max_tendon_speed_m_s,
        "max_cocontraction_m": robot.max_cocontraction_m,
        "actuator_time_constant_s": robot.actuator_time_constant_s,
        "segments": [
            {
                "length_m": s.length_m,
                "pitch_radius_m": s.pitch_radius_m,
                "max_bending_rad": s.max_bending_rad,
                "angles": s.angles.tolist(),
                "n_disks": s.n_disks,
                "tendon_stiffness_n_m": s.tendon_stiffness_n_m,
                "pretension_n": s.pretension_n,
                "flexural_nm_rad": bending_stiffness(s) / s.length_m,
            }
            for s in robot.segments
        ],
        "mjcf": {
            "folded": mjcf(robot, folded=True, profile="fast"),
            "whole": mjcf(robot, folded=False, profile="fast", sim_dt_s=whole_dt),
        },
    }


def network(policy: NetworkPolicy, scores: list[dict[str, Any]]) -> dict[str, Any]:
    """Return a policy as the explorer reads it; nine digits hold a float32."""
    trained = policy.about["env"]["kwargs"]
    trained_with = (row for row in scores if row["n_tendons"] == trained["n_tendons"])
    rates = {row["physics"]: f"{100 * row['success_rate']:.0f} %" for row in trained_with}

    def digits(array: FloatArray) -> Any:
        return json.loads(
            json.dumps(array.tolist()), parse_float=lambda x: float(f"{float(x):.9g}")
        )

    return {
        "trained_on": trained,
        "note": f"it reaches {rates['constant_curvature']} of held-out goals, and "
        f"{rates['mujoco']} with gravity, where it was not trained.",
        "env_steps": policy.about["env_steps"],
        "layers": [{"weight": digits(w), "bias": digits(b)} for w, b in policy.layers],
    }


def data() -> dict[str, str]:
    """Return the files of `DATA` by name."""
    robots = {key: described(key) for key in ROBOTS}
    files = {"robots.json": json.dumps(robots)}
    for key, name in POLICIES.items():
        folder = ROOT / "policies" / name
        if folder.is_dir():
            scores = json.loads((folder / "scores.json").read_text(encoding="utf-8"))
            files[f"policy_{key}.json"] = json.dumps(network(load_policy(folder), scores))
    return files


# --- golden numbers ---------------------------------------------------------------------------


def _maps(rng: np.random.Generator) -> list[dict[str, Any]]:
    cases = []
    for n in range(3, 33):
        rho, bar = rng.normal(size=n), rng.normal(size=2)
        cases.append(
            {
                "n": n,
                "rho": rho.tolist(),
                "clarke": bar.tolist(),
                "encoded": clarke.to_clarke(rho).tolist(),
                "decoded": clarke.from_clarke(bar, n).tolist(),
                "projected": clarke.project(rho).tolist(),
            }
        )
    return cases


def _shapes(rng: np.random.Generator) -> list[dict[str, Any]]:
    cases = []
    for key, (_, robot) in ROBOTS.items():
        for size in (0.0, 1e-5, 0.3, 1.0):
            bends = size * kinematics.sample_dome(
                rng.random((robot.n_segments, 2)), robot.max_bending
            )
            cases.append(
                {
                    "robot": key,
                    "bends": bends.ravel().tolist(),
                    "clarke": kinematics.bending_to_clarke(bends, robot.pitch_radii)
                    .ravel()
                    .tolist(),
                    "tip": kinematics.forward(bends, robot.lengths)[0].tolist(),
                    "quaternion": kinematics.forward(bends, robot.lengths)[1].tolist(),
                    "backbone": kinematics.backbone(bends, robot.lengths, 4).tolist(),
                    "jacobian": tip_jacobian(bends, robot.lengths)[:3].tolist(),
                }
            )
    return cases


def _moves(rng: np.random.Generator) -> list[dict[str, Any]]:
    """Commands and shapes that follow raw actions, off the manifold, too."""
    cases = []
    for key, n in (("default", 3), ("default", 11), ("default2", 6), ("hardware", 3)):
        robot = _with_tendons(key, n)
        split = Splitter(robot, Many(1))
        limits = CommandLimits(robot, "increment", CONTROL_DT)
        physics = ConstantCurvature(robot, 1, CONTROL_DT)
        command, steps = JointVector.from_clarke(np.zeros((1, robot.n_segments, 2))), []
        for _ in range(40):
            action = split.rows(np.clip(1.5 * rng.normal(size=(1, robot.n_joints)), -1.0, 1.0))
            told = _numbers(action)
            command = limits.apply(action, command)
            physics.step(command)
            steps.append(
                {
                    "action": told,
                    "command": _numbers(command),
                    "held": physics.state.displacement_vector.clarke.ravel().tolist(),
                }
            )
        cases.append({"robot": key, "n": n, "steps": steps})
    return cases


def _with_tendons(key: str, n: int) -> Robot:
    robot = ROBOTS[key][1]
    return robot if robot.n_tendons[0] == n else make_robot(robot, n_tendons=n)


def _numbers(vector: JointVector) -> dict[str, Any]:
    state = vector.get_state()
    off = state["off_manifold"]
    return {
        "clarke": state["clarke"].ravel().tolist(),
        "off": None if off is None else off[0].tolist(),
    }


def _episodes() -> list[dict[str, Any]]:
    """Episodes of released policies and of classical control, for some numbers of tendons."""
    cases = []
    for key, agent, n in (
        ("default", "policy", 3),
        ("default", "policy", 7),
        ("default", "policy", 32),
        ("default2", "policy", 6),
        ("default3", "policy", 6),
        ("default", "resolved_rate", 5),
        ("default3", "resolved_rate", 5),
    ):
        folder = ROOT / "policies" / POLICIES[key]
        if agent == "policy" and not folder.is_dir():
            continue
        env: Any = gym.make(
            "clarke_gym/Reach-v0",
            n_tendons=n,
            n_segments=ROBOTS[key][1].n_segments,
            representation="clarke",
        )
        actor = load_policy(folder) if agent == "policy" else make_controller(agent, env)
        observation, _ = env.reset(seed=n)
        start = env.unwrapped.state()
        steps = []
        for _ in range(50):
            action = actor.act(observation)
            step = {"observation": observation.tolist(), "action": action.tolist()}
            observation, _, _, _, info = env.step(action)
            steps.append(step | {"tip_error_m": float(info["tip_error_m"])})
        cases.append({"robot": key, "n": n, "agent": agent, **_start(start), "steps": steps})
        env.close()
    return cases


def _start(state: dict[str, Any]) -> dict[str, Any]:
    return {
        "goal": np.ravel(state["episode"]["parameters"]).tolist(),
        "command": np.ravel(state["command"]["clarke"]).tolist(),
    }


def _simulations(rng: np.random.Generator) -> list[dict[str, Any]]:
    """Joint angles of MuJoCo over 200 control steps: taut, and with tendons that go slack."""
    cases = []
    for key, n, slack in (
        ("default", 7, False),
        ("default2", 4, False),
        ("hardware", 3, True),
        ("default", 3, True),
    ):
        robot = _with_tendons(key, n)
        limits = CommandLimits(robot, "increment", CONTROL_DT)
        physics = MujocoPhysics(robot, 1, CONTROL_DT, threads=1)
        command = JointVector.from_clarke(np.zeros((1, robot.n_segments, 2)))
        split = Splitter(robot, Many(1))
        steps: list[dict[str, Any]] = []
        drift = np.zeros(2 * robot.n_segments)
        for step in range(40 if slack else 200):
            drift = 0.9 * drift + 0.1 * rng.normal(size=drift.size)
            raw = (robot.decoder @ drift)[None]
            if slack:
                raw = raw + rng.normal(size=raw.shape)
            action = split.rows(np.clip(raw, -1.0, 1.0))
            command = limits.apply(action, command)
            told = _numbers(command)
            physics.step(command)
            steps.append({"command": told})
            if step % 20 == 19:
                steps[-1] |= {
                    "qpos": physics.get_state()["qpos"][0].tolist(),
                    "tip": physics.state.tip_position[0].tolist(),
                    "tension": physics.tension[0].tolist(),
                }
        cases.append({"robot": key, "n": n, "slack": slack, "steps": steps})
    return cases


def golden() -> dict[str, Any]:
    """Return the numbers that JavaScript must meet."""
    rng = np.random.default_rng(20)
    return {
        "control_dt": CONTROL_DT,
        "maps": _maps(rng),
        "shapes": _shapes(rng),
        "moves": _moves(rng),
        "episodes": _episodes(),
        "simulations": _simulations(rng),
    }


def main() -> None:
    """Write all files."""
    DATA.mkdir(parents=True, exist_ok=True)
    for name, text in data().items():
        (DATA / name).write_text(text + "\n", encoding="utf-8")
    GOLDEN.write_text(json.dumps(golden()) + "\n", encoding="utf-8")
    print(DATA)
    print(GOLDEN)


if __name__ == "__main__":
    main()
