"""Environments: the forms that Gymnasium's users know, episodes that repeat to the bit, and tasks that can be learnt."""

from __future__ import annotations

import subprocess
import sys
import time
from typing import Any

import numpy as np
import pytest

from pneuma import PneumaError, envs
from pneuma.engine import Worlds

from conftest import sources

tasks = [envs.InflateToHeight, envs.RollToPlace]


@pytest.mark.parametrize("task", tasks)
def test_one_world_has_gymnasiums_form(task: type[envs.Task]) -> None:
    with envs.Env(task()) as env:
        observation, info = env.reset(seed=3)
        assert env.observation_space.contains(observation) and observation.dtype == np.float32
        assert info == {"reached": False}
        steps = 0
        while True:
            observation, reward, terminated, truncated, info = env.step(env.action_space.sample(seed=steps))
            steps += 1
            assert isinstance(reward, float) and reward < 0 and env.observation_space.contains(observation)
            if terminated or truncated:
                break
        assert truncated == (steps == env.task.steps_max) and not (terminated and truncated)
        with pytest.raises(RuntimeError, match="reset"):
            env.step(env.action_space.sample())
        env.reset()
        env.step(env.action_space.sample())


@pytest.mark.parametrize("task", tasks)
def test_a_seed_makes_the_same_episode_again(task: type[envs.Task]) -> None:
    def episode(env: envs.VectorEnv, seed: int) -> list[bytes]:
        told = [env.reset(seed=seed)[0].tobytes()]
        env.action_space.seed(seed)
        for _ in range(10):
            observations, rewards, *_ = env.step(env.action_space.sample())
            told += [observations.tobytes(), rewards.tobytes()]
        return told

    env = envs.VectorEnv(task(), 8)
    first, other = episode(env, 1), episode(env, 2)
    assert episode(env, 1) == first != other
    assert episode(envs.VectorEnv(task(), 8, threads=1), 1) == first


@pytest.mark.parametrize("task", tasks)
def test_a_row_is_what_one_world_does(task: type[envs.Task]) -> None:
    """The first of many worlds has the first goal of the seed, as one alone has: so it sees the same."""
    many, one = envs.VectorEnv(task(), 4), envs.Env(task())
    seen, seen_alone = many.reset(seed=5)[0][0], one.reset(seed=5)[0]
    for step in range(12):
        assert np.array_equal(seen, seen_alone)
        actions = many.action_space.sample(seed=step)
        observations, rewards, *_ = many.step(actions)
        seen_alone, reward, *_ = one.step(actions[0])
        seen = observations[0]
        assert reward == rewards[0]


@pytest.mark.parametrize("task", tasks)
def test_the_hardest_actions_stay_within_the_space(task: type[envs.Task]) -> None:
    """The same action, a bound of its space, for a whole episode."""
    env = envs.VectorEnv(task(), 4)
    (size,) = env.single_action_space.shape
    signs = np.array([[1, 1], [1, -1], [-1, 1], [-1, -1]])[:, :size]
    observations, _ = env.reset(seed=4)
    for _ in range(env.task.steps_max):
        assert env.observation_space.contains(observations), observations
        assert np.isfinite(observations).all()
        observations, *_ = env.step(signs)
    assert env.observation_space.contains(observations)


@pytest.mark.parametrize("task", tasks)
@pytest.mark.parametrize("number", [np.nan, np.inf])
def test_actions_that_are_not_finite_are_refused_before_a_step(task: type[envs.Task], number: float) -> None:
    env = envs.VectorEnv(task(), 3)
    env.reset(seed=1)
    actions = np.zeros(env.action_space.shape)
    env.step(actions)
    actions[2, -1] = number
    hashes, ticks = env.worlds.state_hashes(), env.worlds.ticks.copy()
    with pytest.raises(ValueError, match=r"actions\[2\] is not finite"):
        env.step(actions)
    assert np.array_equal(env.worlds.state_hashes(), hashes) and np.array_equal(env.worlds.ticks, ticks)
    assert env._steps.tolist() == [1, 1, 1]


def test_an_episode_that_ends_makes_room_for_another() -> None:
    task = envs.RollToPlace()
    task.steps_max = 3
    env = envs.VectorEnv(task, 5)
    assert env.observation_space.shape == (5, 4) and env.single_action_space.shape == (2,)
    _, infos = env.reset(seed=0)
    assert infos["begun"].all()
    still = np.zeros((5, 2))
    first_goals = env._goals.copy()
    for _ in range(2):
        assert not any(flags.any() for flags in env.step(still)[2:4])
    truncated = env.step(still)[3]
    assert truncated.all()
    observations, rewards, terminated, truncated, infos = env.step(np.ones((5, 2)))
    assert infos["begun"].all() and not rewards.any() and not terminated.any() and not truncated.any()
    assert (env.worlds.ticks == 0).all() and (env._goals != first_goals).all()
    assert np.abs(observations[:, 2:]).max() < 1e-6  # at rest, whatever was asked for


def test_what_is_refused_is_told() -> None:
    env = envs.VectorEnv(envs.RollToPlace(), 3)
    env.reset()
    with pytest.raises(ValueError, match=r"\(3, 1\), not \(3, 2\)"):
        env.step(np.zeros((3, 1)))
    with pytest.raises(ValueError, match="options"):
        env.reset(options={"gravity": 3})


class Given(envs.RollToPlace):
    """A task whose methods return what they are told to, where they are."""

    def __init__(self, **returned: Any) -> None:
        self.returned = returned

    def goals(self, random: np.random.Generator, count: int) -> Any:
        return self.returned.get("goals", super().goals(random, count))

    def act(self, worlds: Worlds, actions: Any) -> Any:
        return self.returned.get("act", super().act(worlds, actions))

    def observe(self, worlds: Worlds, goals: Any) -> Any:
        return self.returned.get("observe", super().observe(worlds, goals))

    def judge(self, worlds: Worlds, goals: Any) -> Any:
        return self.returned.get("judge", super().judge(worlds, goals))


yes = np.ones(3, np.bool_)


@pytest.mark.parametrize(
    "method, returned, told",
    [
        ("goals", np.zeros(3), "the shape (3,), not (3, n)"),
        ("goals", np.zeros((1, 2)), "the shape (1, 2), not (3, 2)"),
        ("act", None, "None, not a dict"),
        ("observe", np.zeros((3, 5)), "the shape (3, 5), not (3, 4)"),
        ("observe", np.zeros(4), "the shape (4,), not (3, 4)"),
        ("judge", np.zeros(3), "not (rewards, reached)"),
        ("judge", (np.zeros((3, 3)), yes), "rewards of the shape (3, 3), not (3,)"),
        ("judge", (0.0, yes), "rewards of the shape (), not (3,)"),
        ("judge", (np.zeros(3), True), "reached of the shape (), not (3,)"),
        ("judge", (np.zeros(3), np.zeros(3)), "reached as float64, not bool"),
        ("goals", [[1, 2], [3], []], "what are no numbers: [[1, 2], [3], []]"),
        ("observe", "nothing", "what are no numbers: 'nothing'"),
        ("judge", ([None, object(), "x"], yes), "what are no numbers: [None, "),
        ("judge", (np.zeros(3), [[True], [True, False], []]), "reached in rows of different lengths"),
    ],
)
def test_what_a_task_returns_has_its_shape(method: str, returned: Any, told: str) -> None:
    with pytest.raises(ValueError) as refused:
        env = envs.VectorEnv(Given(**{method: returned}), 3)
        env.reset(seed=1)
        env.step(np.zeros((3, 2)))
    assert str(refused.value).startswith(f"Given.{method} returned ") and told in str(refused.value)


def test_goals_keep_their_size() -> None:
    """One more or fewer would not fit those that other worlds have."""
    task = Given()
    env = envs.VectorEnv(task, 3)
    task.returned["goals"] = np.zeros((3, 1))
    with pytest.raises(ValueError, match=r"Given.goals returned the shape \(3, 1\), not \(3, 2\)"):
        env.reset()


def test_what_a_task_returns_may_be_lists_and_whole_numbers() -> None:
    goals, rewards = np.ones((3, 2), int), [1, 2, 3]
    env = envs.VectorEnv(Given(goals=goals, observe=[[0] * 4] * 3, judge=(rewards, [False, True, False])), 3)
    seen, _ = env.reset()
    assert seen.dtype == np.float32 and env._goals.dtype == np.float64
    _, told, terminated, _, infos = env.step(np.zeros((3, 2)))
    assert told.tolist() == rewards and terminated.tolist() == infos["reached"].tolist() == [False, True, False]


@pytest.mark.parametrize(
    "name, value, told",
    [
        ("action_space", ([-1], [1]), r"Given.action_space is \(\[-1\], \[1\]\), not an envs.Box"),
        ("action_space", envs.Box(-1, 1), r"Given.action_space has the shape \(\), not \(n,\)"),
        ("ticks_a_step", 0, r"is 0; it must be 1 or more.*Given.ticks_a_step"),
        ("steps_max", 0, r"is 0; it must be 1 or more.*Given.steps_max"),
        ("steps_max", 2.5, r"is 2.5, not a whole number .Given.steps_max"),
        ("steps_max", "many", r"is 'many', not a whole number .Given.steps_max"),
    ],
)
def test_what_a_task_lacks_is_told_before_a_world_is_made(name: str, value: Any, told: str) -> None:
    task = Given()
    setattr(task, name, value)
    with pytest.raises((TypeError, ValueError, PneumaError), match=told):
        envs.VectorEnv(task, 3)


def test_what_is_no_task_is_told() -> None:
    class Unfinished(envs.RollToPlace):
        @property
        def shown(self) -> Any:  # type: ignore[override]
            raise AttributeError

    for task, told in (
        (envs.RollToPlace, r"RollToPlace is a class: a task is made of it, RollToPlace\(\)"),
        ("roll", "'roll' is no task: a task's class derives from envs.Task"),
        (Unfinished(), "Unfinished has no shown"),
    ):
        with pytest.raises(TypeError, match=told):
            envs.Env(task)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "low, high, told",
    [
        ([-1, -1], [1], r"low has the shape \(2,\), and high \(1,\)"),
        ([1], [-1], "low is past high"),
        ([np.nan], [1], "no number"),
    ],
)
def test_a_box_has_bounds_of_one_shape(low: Any, high: Any, told: str) -> None:
    with pytest.raises(ValueError, match=told):
        envs.Box(low, high)


def test_a_reset_comes_first() -> None:
    one, many = envs.Env(envs.RollToPlace()), envs.VectorEnv(envs.RollToPlace(), 3)
    assert (repr(one), repr(many)) == ("<Env: RollToPlace>", "<VectorEnv of 3 worlds: RollToPlace>")
    with pytest.raises(RuntimeError, match="no episode has begun: reset"):
        one.step(np.zeros(2))
    with pytest.raises(RuntimeError, match="no episode has begun: reset"):
        many.step(np.zeros((3, 2)))
    one.reset()
    with pytest.raises(ValueError, match=r"the action has the shape \(1, 2\), not \(2,\)"):
        one.step(np.zeros((1, 2)))


def test_a_place_is_reached_by_who_pushes_towards_it() -> None:
    """A policy by hand: push along the way, and against the velocity."""
    env = envs.Env(envs.RollToPlace())
    seen, _ = env.reset(seed=11)
    for _ in range(env.task.steps_max):
        seen, _, terminated, truncated, info = env.step(0.6 * seen[:2] - 0.6 * seen[2:])
        if terminated or truncated:
            break
    assert info["reached"] and terminated
    assert np.linalg.norm(seen[:2]) < envs.RollToPlace.near_m


def test_a_height_is_reached_by_who_pumps_what_is_missing() -> None:
    env = envs.Env(envs.InflateToHeight())
    seen, _ = env.reset(seed=11)
    for _ in range(env.task.steps_max):
        seen, _, terminated, truncated, info = env.step(seen[:1])
        if terminated or truncated:
            break
    assert info["reached"] and abs(seen[0]) < envs.InflateToHeight.near_m


@pytest.mark.parametrize("task", ["inflate", "roll"])
def test_random_search_solves_it(task: str) -> None:
    """From the example's own command line, within two minutes. Its seed makes it the same search everywhere."""
    begun = time.monotonic()
    ended = subprocess.run(
        [sys.executable, str(sources / "examples" / "random_search.py"), task],
        capture_output=True,
        text=True,
        timeout=150,
    )
    assert ended.returncode == 0, ended.stdout + ended.stderr
    assert time.monotonic() - begun < 120
    assert f"{task}: " in ended.stdout.splitlines()[-1]
