"""MuJoCo physics: elastic robots with inertia, gravity and tendons that can go slack."""

from clarke_gym.physics.mujoco.physics import MujocoPhysics

__all__ = ["MujocoPhysics"]
