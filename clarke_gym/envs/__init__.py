"""Environments: one batched core, seen as a Gymnasium `Env` and as a `VectorEnv`."""

from clarke_gym.envs.config import EnvConfig
from clarke_gym.envs.env import ContinuumRobotEnv, ContinuumRobotGoalEnv
from clarke_gym.envs.vector_env import ContinuumRobotVectorEnv

__all__ = ["ContinuumRobotEnv", "ContinuumRobotGoalEnv", "ContinuumRobotVectorEnv", "EnvConfig"]
