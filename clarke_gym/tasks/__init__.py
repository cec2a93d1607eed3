"""Tasks: one file each."""

from clarke_gym.tasks.base import (
    TASKS,
    Goal,
    GoalTask,
    Metric,
    Outcome,
    Task,
    register_task,
)
from clarke_gym.tasks.reach import Reach

__all__ = [
    "TASKS",
    "Goal",
    "GoalTask",
    "Metric",
    "Outcome",
    "Reach",
    "Task",
    "register_task",
]
