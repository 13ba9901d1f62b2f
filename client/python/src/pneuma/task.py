"""What a task in a world is, and its spaces. `pneuma.envs` makes environments of tasks."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pneuma.arrays import floats
from pneuma.engine import Shown, Worlds
from pneuma.errors import PneumaError
from pneuma.messages import whole
from pneuma.scene import Scene

Array = NDArray[np.float64]
Rows = NDArray[np.float32]
Flags = NDArray[np.bool_]


class Box:
    """Arrays of a shape, with bounds an element. Raises ValueError where low and high are no bounds of one shape."""

    def __init__(self, low: ArrayLike, high: ArrayLike) -> None:
        self.low = np.array(low, np.float32)
        self.high = np.array(high, np.float32)
        if self.low.shape != self.high.shape:
            raise ValueError(f"low has the shape {self.low.shape}, and high {self.high.shape}")
        if not (self.low <= self.high).all():
            raise ValueError(f"low is past high, or no number: {self.low}, {self.high}")
        self.shape = self.low.shape
        self.dtype = self.low.dtype
        self._random = np.random.default_rng()

    def seed(self, seed: int | None = None) -> None:
        """Where `sample` begins."""
        self._random = np.random.default_rng(seed)

    def sample(self, seed: int | None = None) -> Rows:
        """One of them, by chance; the same for the same seed."""
        random = self._random if seed is None else np.random.default_rng(seed)
        return random.uniform(np.maximum(self.low, -1e6), np.minimum(self.high, 1e6)).astype(np.float32)

    def contains(self, x: ArrayLike) -> bool:
        x = np.asarray(x)
        return x.shape == self.shape and bool(np.all((self.low <= x) & (x <= self.high)))

    def __repr__(self) -> str:
        return f"Box({self.low}, {self.high})"


class Task(ABC):
    """What is to be done in a world: what an action does, what is seen, and how good that is. Rows are worlds.

    An environment checks the shapes that the methods return. ValueError names the method.
    """

    #: What the task reads of the worlds: names of their arrays, such as "centres_of_mass".
    shown: tuple[Shown, ...]
    #: What is seen of one world, of any shape.
    observation_space: Box
    #: What is done in one world, (n,).
    action_space: Box
    #: Of the world, with one action.
    ticks_a_step = 6
    #: After so many an episode is truncated.
    steps_max = 80

    @abstractmethod
    def scene(self) -> Scene:
        """What each world begins as."""

    @abstractmethod
    def goals(self, random: np.random.Generator, count: int) -> Array:
        """(count, n): what is wanted in so many episodes. n is the same each time, and may be 0."""

    @abstractmethod
    def act(self, worlds: Worlds, actions: Array) -> dict[str, Array]:
        """What actions, (count, n) and within the space, mean for `Worlds.step`: its arguments by name."""

    @abstractmethod
    def observe(self, worlds: Worlds, goals: Array) -> Array:
        """(count, ...): a row a world, of the space's shape."""

    @abstractmethod
    def judge(self, worlds: Worlds, goals: Array) -> tuple[Array, Flags]:
        """(count,) each: rewards, and, as bool, which goals are reached."""

    def __repr__(self) -> str:
        return type(self).__name__


class CheckedTask:
    """A task in its worlds. What its methods return has the shapes that it should, or raises ValueError."""

    def __init__(self, task: Task, worlds: Worlds) -> None:
        self._task = task
        self._worlds = worlds
        self._goal_size: int | None = None

    def goals(self, random: np.random.Generator, count: int) -> Array:
        goals = self._floats("goals", self._task.goals(random, count))
        if goals.ndim != 2:
            raise ValueError(f"{self._named('goals')} returned the shape {goals.shape}, not ({count}, n)")
        if self._goal_size is None:
            self._goal_size = goals.shape[1]
        self._check_shape("goals", goals.shape, (count, self._goal_size))
        return goals

    def act(self, actions: Array) -> dict[str, Array]:
        arguments: object = self._task.act(self._worlds, actions)
        if not isinstance(arguments, dict):
            raise ValueError(f"{self._named('act')} returned {arguments!r}, not a dict of Worlds.step's arguments")
        return arguments

    def observe(self, goals: Array) -> Rows:
        seen = self._floats("observe", self._task.observe(self._worlds, goals))
        self._check_shape("observe", seen.shape, (self._worlds.count, *self._task.observation_space.shape))
        return seen.astype(np.float32)

    def judge(self, goals: Array) -> tuple[Array, Flags]:
        judged: object = self._task.judge(self._worlds, goals)
        if not isinstance(judged, tuple) or len(judged) != 2:
            raise ValueError(f"{self._named('judge')} returned {judged!r}, not (rewards, reached)")
        rewards, reached = self._floats("judge", judged[0]), self._flags("judge", judged[1])
        self._check_shape("judge", rewards.shape, (self._worlds.count,), "rewards of ")
        self._check_shape("judge", reached.shape, (self._worlds.count,), "reached of ")
        if reached.dtype != np.bool_:
            raise ValueError(f"{self._named('judge')} returned reached as {reached.dtype}, not bool")
        return rewards, reached

    def _floats(self, method: str, returned: object) -> Array:
        try:
            return floats(returned, method)
        except PneumaError:
            raise ValueError(f"{self._named(method)} returned what are no numbers: {returned!r}") from None

    def _flags(self, method: str, returned: object) -> NDArray[Any]:
        try:
            return np.asarray(returned)
        except ValueError:
            raise ValueError(f"{self._named(method)} returned reached in rows of different lengths") from None

    def _check_shape(self, method: str, shape: tuple[int, ...], wanted: tuple[int, ...], what: str = "") -> None:
        if shape != wanted:
            raise ValueError(f"{self._named(method)} returned {what}the shape {shape}, not {wanted}")

    def _named(self, method: str) -> str:
        return f"{type(self._task).__name__}.{method}"


def check_task(task: Task) -> None:
    """Raises where a task lacks something that no method returns."""
    if isinstance(task, type):
        raise TypeError(f"{task.__name__} is a class: a task is made of it, {task.__name__}()")
    if not isinstance(task, Task):
        raise TypeError(f"{task!r} is no task: a task's class derives from envs.Task")
    name = type(task).__name__
    for each in ("shown", "observation_space", "action_space"):
        if not hasattr(task, each):
            raise TypeError(f"{name} has no {each}")
    for each in ("observation_space", "action_space"):
        if not isinstance(getattr(task, each), Box):
            raise TypeError(f"{name}.{each} is {getattr(task, each)!r}, not an envs.Box")
    if len(task.action_space.shape) != 1:
        raise ValueError(f"{name}.action_space has the shape {task.action_space.shape}, not (n,)")
    whole(task.ticks_a_step, f"{name}.ticks_a_step", least=1)
    whole(task.steps_max, f"{name}.steps_max", least=1)


def repeated(space: Box, count: int) -> Box:
    return Box(np.broadcast_to(space.low, (count, *space.shape)), np.broadcast_to(space.high, (count, *space.shape)))
