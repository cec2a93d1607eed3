"""What the attacks share: small runs, the command line, and how long the form is."""

import os
import subprocess
import sys
import time

import yaml

from agents.files import ROOT

LONG = os.environ.get("ATTACK") == "long"
"""`make attack` sets it; CI runs the short form."""

_BASE = {
    "name": "tiny",
    "env": {"num_envs": 4, "kwargs": {"n_tendons": 5, "representation": "clarke"}},
    "total_steps": 512,
    "evaluation": {"every_steps": 128, "n_goals": 50},
    "checkpoint_every_steps": 128,
}
_OFF_POLICY = {"learning_starts": 64, "batch_size": 32, "net_arch": [8], "buffer_size": 400}
_OFF_POLICY |= {"updates_per_env_step": 0.25}
_BY_HINDSIGHT = _OFF_POLICY | {"replay": "her", "updates_per_env_step": 0.5}
_HER = {"num_envs": 2, "kwargs": {"n_tendons": 5, "representation": "clarke", "goal_env": True}}
_MUJOCO = {"num_envs": 4, "kwargs": {"n_tendons": 3, "physics": "mujoco", "threads": 1}}
_MUJOCO["kwargs"]["episode_steps"] = 8  # tendons go slack, which is slow
_SHORT = {"num_envs": 2, "kwargs": _MUJOCO["kwargs"] | {"episode_steps": 10}}
_PPO = {"name": "ppo", "n_steps": 32, "batch_size": 64, "n_epochs": 2, "net_arch": [8]}
RUNS = {
    "ppo": _BASE | {"algo": _PPO},
    "ppo_mujoco": _BASE | {"algo": _PPO, "env": _MUJOCO},
    "sac": _BASE | {"algo": {"name": "sac", **_OFF_POLICY}},
    "sac_her": _BASE | {"algo": {"name": "sac", **_BY_HINDSIGHT}, "env": _HER},
    "td3": _BASE | {"algo": {"name": "td3", **_OFF_POLICY}},
    "td3_her": _BASE | {"algo": {"name": "td3", **_BY_HINDSIGHT}, "env": _HER},
    "tqc": _BASE | {"algo": {"name": "tqc", **_OFF_POLICY}},
}
"""The replay buffers are so small that they are overwritten."""

# Two environments at half an update each: updates come whole.
_TWICE = _OFF_POLICY | {"updates_per_env_step": 0.5}
_GOAL = _SHORT | {"kwargs": _SHORT["kwargs"] | {"goal_env": True}}
ON_MUJOCO = {
    "ppo_short_mujoco": RUNS["ppo"] | {"env": _SHORT, "algo": _PPO | {"n_steps": 64}},
    "sac_mujoco": _BASE | {"algo": {"name": "sac", **_TWICE}, "env": _SHORT},
    "sac_her_mujoco": RUNS["sac_her"] | {"env": _GOAL},
    "td3_mujoco": _BASE | {"algo": {"name": "td3", **_TWICE}, "env": _SHORT},
    "td3_her_mujoco": RUNS["td3_her"] | {"env": _GOAL},
}
"""Episodes so short that a run takes seconds, and can be killed often."""

_WITH_MEMORY = (
    "backlash+friction+command_delay+sensor_noise+sensor_bias+quantisation+sensor_delay"
    "+slack_tendon+misplacement+unequal_radii"
)


def disturbed(run):
    """Return a run with every disturbance that remembers."""
    kwargs = run["env"]["kwargs"] | {"disturbances": _WITH_MEMORY, "representation": "raw"}
    return run | {"env": run["env"] | {"kwargs": kwargs}}


DISTURBED = {
    f"{name}_disturbed": disturbed(RUNS[name])
    for name in ("ppo", "ppo_mujoco", "sac", "sac_her", "td3", "td3_her")
} | {
    "ppo_marginal": RUNS["ppo"] | {"algo": _PPO | {"likelihood": "marginal"}},
    "ppo_slowing": RUNS["ppo"] | {"algo": _PPO | {"final_learning_rate": 1e-5}},
    # Killed before it learns, while actions are drawn from their space.
    "td3_warming": RUNS["td3"] | {"algo": {"name": "td3", **_OFF_POLICY, "learning_starts": 400}},
}
"""Runs whose environments or policies have more to remember."""

STUDY = {
    "name": "attacked",
    "title": "A study under attack",
    "tuning": "none",
    "representations": [
        {"label": "raw", "env": {"representation": "raw"}},
        {"label": "clarke", "env": {"representation": "clarke"}},
    ],
    "tasks": [{"label": "n = 3", "env": {"n_tendons": 3}}],
    "seeds": [0],
    "base": _BASE | {"algo": _PPO, "env": {"num_envs": 4}},
}


_EVERY = 1_024 if LONG else 512
LONGER = {"total_steps": 12_288 if LONG else 4_096, "checkpoint_every_steps": _EVERY}
LONGER |= {"evaluation": {"every_steps": _EVERY, "n_goals": 50}}
"""What makes a run long enough to be met in the middle."""


def wait_for(condition, seconds=180, process=None):
    end = time.monotonic() + seconds
    while not condition():
        assert process is None or process.poll() is None, process.communicate()
        assert time.monotonic() < end, "it never came"
        time.sleep(0.02)


def has_checkpoint(folder):
    """Whether a run below has one; `rglob` would fail where a part vanishes while it looks."""
    return any(name.startswith("step_") for _, names, _ in os.walk(folder) for name in names)


def popen(*arguments, cwd=None, **options):
    """Start the command line."""
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(ROOT), *sys.path[1:]])}
    return subprocess.Popen(
        [sys.executable, str(ROOT / "train.py"), *map(str, arguments)],
        cwd=cwd,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        **options,
    )


def write(path, data):
    path.write_text(yaml.safe_dump(data))
    return path


def tree(folder):
    """Return what is in a folder: path -> bytes, or what a link points at."""
    return {
        str(path.relative_to(folder)): (
            os.readlink(path) if path.is_symlink() else path.is_file() and path.read_bytes()
        )
        for path in sorted(folder.rglob("*"))
    }
