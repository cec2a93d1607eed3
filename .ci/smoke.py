"""Use the installed wheel as a newcomer would, in an environment without torch."""

import importlib
import importlib.util

import gymnasium as gym

import clarke_gym
import clarke_gym.control

assert importlib.util.find_spec("torch") is None, "this environment must not have torch"
assert importlib.util.find_spec("agents") is None, "the wheel must not ship agents"
for representation in ("raw", "clarke"):
    env = gym.make("clarke_gym/Reach-v0", n_tendons=7, representation=representation)
    env.reset(seed=0)
    for _ in range(60):
        _, _, terminated, truncated, _ = env.step(env.action_space.sample())
        if terminated or truncated:
            env.reset()
    env.close()
envs = gym.make_vec("clarke_gym/Reach-v0", num_envs=16, n_tendons=11, representation="clarke")
envs.reset(seed=0)
envs.step(envs.action_space.sample())
env = gym.make("clarke_gym/Reach-v0", n_tendons=7, representation="clarke")
controller = clarke_gym.control.make_controller("clarke_controller", env)
observation, info = env.reset(seed=0)
for _ in range(50):
    observation, _, _, _, info = env.step(controller.act(observation))
assert info["is_success"], "classical control must reach the goal"
for extra in ("sb3", "onnx"):
    try:
        importlib.import_module(f"clarke_gym.integrations.{extra}")
    except ModuleNotFoundError as error:
        told = str(error)
        assert f'pip install "clarke_gym[{extra}]"' in told, told
    else:
        raise AssertionError(f"the library of the extra {extra} must be missing here")
print(f"clarke_gym {clarke_gym.__version__}: the wheel works alone")
