"""Environments to learn in, in the form that Gymnasium's users know. Gymnasium itself need not be installed.

>>> from pneuma import envs
>>> env = envs.Env(envs.RollToPlace())
>>> observation, info = env.reset(seed=1)
>>> observation, reward, terminated, truncated, info = env.step(env.action_space.sample())

`VectorEnv` has many worlds at once, stepped on all cores, and arrays with a row a world.
"""

from __future__ import annotations

from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from pneuma._proto.scene_types import Atmosphere, Collider, Gas, Mesh, Shape, SoftBody, Springs, Stepping, Surface
from pneuma.engine import Worlds
from pneuma.scene import Scene
from pneuma.task import Array, Box, CheckedTask, Flags, Rows, Task, check_task, repeated

__all__ = ["Box", "Env", "InflateToHeight", "RollToPlace", "Task", "VectorEnv"]

Info = dict[str, Any]

gas_constant_j_mol_k = 8.31446
step_cost = 0.1


class InflateToHeight(Task):
    """Pump gas into a ball that is held to the floor, or let some out, until its top is at rest as high as asked for.

    action: (1,), -1 to 1: how fast gas comes in.
    observation: (3,): from the top to the height wanted, m; the middle's speed upwards, m/s; the height of the top, m.
    reward: minus the distance to the height in metres, and minus 0.1, so that it pays to be done.
    """

    shown = ("positions", "mean_velocities", "pressures_pa", "volumes_m3")
    observation_space = Box([-5, -10, 0], [5, 10, 5])
    action_space = Box([-1], [1])
    temperature_k = 293.15
    moles_max = 0.3
    moles_a_step = 0.01
    height_m = (0.55, 0.85)
    near_m = 0.02
    slow_m_s = 0.1

    def scene(self) -> Scene:
        return balloon("inflate", pins=[lowest_vertex])

    def goals(self, random: np.random.Generator, count: int) -> Array:
        return random.uniform(*self.height_m, size=(count, 1))

    def act(self, worlds: Worlds, actions: Array) -> dict[str, Array]:
        return {"moles": np.clip(self.moles(worlds) + self.moles_a_step * actions, 1e-3, self.moles_max)}

    def observe(self, worlds: Worlds, goals: Array) -> Array:
        heights = self.heights(worlds)
        return np.hstack([goals - heights, worlds.mean_velocities[:, :1, 1], heights])

    def judge(self, worlds: Worlds, goals: Array) -> tuple[Array, Flags]:
        off = np.abs(self.heights(worlds) - goals)[:, 0]
        speed = np.abs(worlds.mean_velocities[:, 0, 1])
        return -off - step_cost, (off < self.near_m) & (speed < self.slow_m_s)

    def heights(self, worlds: Worlds) -> Array:
        """(count, 1)"""
        tops: Array = worlds.positions[:, :, 1].max(axis=1, keepdims=True).astype(np.float64)
        return tops

    def moles(self, worlds: Worlds) -> Array:
        """(count, 1): by the gas law, in the vacuum that this scene has outside."""
        joules: Array = worlds.pressures_pa[:, :1] * worlds.volumes_m3[:, :1]
        return joules / (gas_constant_j_mol_k * self.temperature_k)


class RollToPlace(Task):
    """Push a balloon over the floor until it lies at the place asked for.

    action: (2,), -1 to 1: how hard it is pushed along x and z.
    observation: (4,): from the balloon to the place along x and z, in metres; its velocity along them, m/s.
    reward: minus the distance to the place in metres, and minus 0.1, so that it pays to be done.
    """

    shown = ("centres_of_mass", "mean_velocities")
    # The floor has no edge: an episode of one and the same push ends 90 m away, past 20 m/s.
    observation_space = Box([-np.inf] * 4, [np.inf] * 4)
    action_space = Box([-1, -1], [1, 1])
    impulse_n_s = 0.3
    place_m = 2.0
    near_m = 0.15
    slow_m_s = 0.25

    def scene(self) -> Scene:
        return balloon("roll", pins=[])

    def goals(self, random: np.random.Generator, count: int) -> Array:
        return random.uniform(-self.place_m, self.place_m, size=(count, 2))

    def act(self, worlds: Worlds, actions: Array) -> dict[str, Array]:
        impulses = np.zeros((worlds.count, len(worlds.bodies), 3))
        impulses[:, 0, ::2] = self.impulse_n_s * actions
        return {"impulses": impulses}

    def observe(self, worlds: Worlds, goals: Array) -> Array:
        return np.hstack([goals - worlds.centres_of_mass[:, 0, ::2], worlds.mean_velocities[:, 0, ::2]])

    def judge(self, worlds: Worlds, goals: Array) -> tuple[Array, Flags]:
        away = np.linalg.norm(goals - worlds.centres_of_mass[:, 0, ::2], axis=1)
        speed = np.linalg.norm(worlds.mean_velocities[:, 0], axis=1)
        return -away - step_cost, (away < self.near_m) & (speed < self.slow_m_s)


# Of the mesh below.
lowest_vertex = 36


def balloon(name: str, pins: list[int]) -> Scene:
    """A ball of 42 vertices on a floor, with a vacuum outside."""
    return Scene(
        name=name,
        gravity=(0, -9.81, 0),
        stepping=Stepping(integrator="SYMPLECTIC_EULER", error_target=0.05),
        atmosphere=Atmosphere(),
    ).add(
        Mesh(name="balloon", icosphere=Mesh.Icosphere(subdivisions=1, radius_m=0.25)),
        SoftBody(
            name="balloon",
            mesh="balloon",
            mass_kg=0.5,
            position=(0, 0.25, 0),
            springs=Springs(stiffness_n_m=200, damping_n_s_m=1),
            gas=Gas(moles=0.02),
            pins=pins,
        ),
        Collider(name="floor", shape=Shape.Plane(), surface=Surface(friction=0.8, restitution=0.2)),
    )


class VectorEnv:
    """Many worlds with the same task, in the form of Gymnasium's vector environments.

    A world whose episode has ended begins another in the next step, which does nothing else there: its action is left
    out, its reward is 0, and `infos["begun"]` is true. Seeds make the goals the same, and with the same actions the bits.
    """

    def __init__(self, task: Task, num_envs: int = 1024, *, threads: int | None = None) -> None:
        check_task(task)
        self.task = task
        self.num_envs = num_envs
        self.worlds = Worlds(task.scene(), num_envs, shown=task.shown, threads=threads)
        self.single_observation_space = task.observation_space
        self.single_action_space = task.action_space
        self.observation_space = repeated(task.observation_space, num_envs)
        self.action_space = repeated(task.action_space, num_envs)
        self._random = np.random.default_rng()
        self._checked = CheckedTask(task, self.worlds)
        self._goals = self._checked.goals(self._random, num_envs).copy()
        self._steps = np.zeros(num_envs, np.int64)
        self._over = np.ones(num_envs, np.bool_)
        self._is_reset = False

    def reset(self, *, seed: int | None = None, options: Info | None = None) -> tuple[Rows, Info]:
        """Begins an episode in every world. `options` has none that are known."""
        if options:
            raise ValueError(f"no options are known: {options}")
        if seed is not None:
            self._random = np.random.default_rng(seed)
        self._begin(np.ones(self.num_envs, np.bool_))
        self._is_reset = True
        return self._observed(), self._infos(np.zeros(self.num_envs, np.bool_), np.ones(self.num_envs, np.bool_))

    def step(self, actions: ArrayLike) -> tuple[Rows, Array, Flags, Flags, Info]:
        """Observations, rewards, terminated, truncated and infos, a row a world.

        Raises ValueError where an action is not finite, before any world is stepped; RuntimeError before a reset.

        infos: `reached`, whose goal is; `begun`, whose episode has just begun.
        """
        space = self.action_space
        actions = np.asarray(actions, np.float64)
        if actions.shape != space.shape:
            raise ValueError(f"actions have the shape {actions.shape}, not {space.shape}")
        if not np.isfinite(actions).all():
            row = int(np.flatnonzero(~np.isfinite(actions).all(axis=1))[0])
            raise ValueError(f"actions[{row}] is not finite: {actions[row]}")
        if not self._is_reset:
            raise RuntimeError("no episode has begun: reset() begins one")
        begun = self._over.copy()
        actions = np.where(begun[:, None], 0.0, np.clip(actions, space.low, space.high))
        self.worlds.step(self.task.ticks_a_step, **self._checked.act(actions))
        self._steps += 1
        if begun.any():
            self._begin(begun)
        rewards, reached = self._checked.judge(self._goals)
        rewards = np.where(begun, 0.0, rewards)
        reached = reached & ~begun
        terminated = reached | (self.worlds.frozen.any(axis=1) & ~begun)
        truncated = (self._steps >= self.task.steps_max) & ~terminated
        self._over = terminated | truncated
        return self._observed(), rewards, terminated, truncated, self._infos(reached, begun)

    def close(self) -> None:
        """Nothing is open."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _begin(self, which: Flags) -> None:
        self.worlds.reset(which)
        self._goals[which] = self._checked.goals(self._random, int(which.sum()))
        self._steps[which] = 0
        self._over[which] = False

    def _observed(self) -> Rows:
        return self._checked.observe(self._goals)

    def _infos(self, reached: Flags, begun: Flags) -> Info:
        return {"reached": reached, "begun": begun}

    def __repr__(self) -> str:
        return f"<VectorEnv of {self.num_envs} worlds: {self.task}>"


class Env:
    """One world with a task, in the form of Gymnasium's environments."""

    def __init__(self, task: Task) -> None:
        self.vector = VectorEnv(task, 1, threads=1)
        self.task = task
        self.observation_space = task.observation_space
        self.action_space = task.action_space

    def reset(self, *, seed: int | None = None, options: Info | None = None) -> tuple[Rows, Info]:
        """Begins an episode: the first observation, and infos."""
        observations, _ = self.vector.reset(seed=seed, options=options)
        return observations[0], {"reached": False}

    def step(self, action: ArrayLike) -> tuple[Rows, float, bool, bool, Info]:
        """Observation, reward, terminated, truncated, and infos: `reached`. After an episode's end `reset` is due."""
        if self.vector._is_reset and self.vector._over[0]:
            raise RuntimeError("the episode is over: reset() begins another")
        if np.shape(action) != self.action_space.shape:
            raise ValueError(f"the action has the shape {np.shape(action)}, not {self.action_space.shape}")
        observations, rewards, terminated, truncated, infos = self.vector.step(np.asarray(action)[None])
        info = {"reached": bool(infos["reached"][0])}
        return observations[0], float(rewards[0]), bool(terminated[0]), bool(truncated[0]), info

    def __repr__(self) -> str:
        return f"<Env: {self.task}>"

    def close(self) -> None:
        """Nothing is open."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
