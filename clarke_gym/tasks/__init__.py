"""Tasks: one file each."""

from clarke_gym.tasks.base import (
    RUNGS,
    TASKS,
    Goal,
    GoalTask,
    Metric,
    Outcome,
    Task,
    register_task,
)
from clarke_gym.tasks.gate import Gate
from clarke_gym.tasks.hold import Hold
from clarke_gym.tasks.nest import Nest
from clarke_gym.tasks.obstructed import ObstructedTask
from clarke_gym.tasks.pose import Pose
from clarke_gym.tasks.reach import Reach
from clarke_gym.tasks.shape import Shape
from clarke_gym.tasks.shaped import ShapedTask
from clarke_gym.tasks.track import Track
from clarke_gym.tasks.wrap import Wrap

__all__ = [
    "RUNGS",
    "TASKS",
    "Gate",
    "Goal",
    "GoalTask",
    "Hold",
    "Metric",
    "Nest",
    "ObstructedTask",
    "Outcome",
    "Pose",
    "Reach",
    "Shape",
    "ShapedTask",
    "Task",
    "Track",
    "Wrap",
    "register_task",
]
