"""Learns to inflate a ball to a height, or to roll a balloon to a place, by the plainest method there is.

    random_search.py inflate|roll [SECONDS]

A policy is a matrix from what is seen to what is done. Each round tries 32 of them, on two goals each: the best one
so far with chance added, and chance alone. The winner is tried on as many goals as there are worlds, and kept if it is
better than what was kept before.
"""

import sys
import time

import numpy as np

from pneuma import envs

tasks = {"inflate": envs.InflateToHeight, "roll": envs.RollToPlace}

policies, goals_each = 32, 2
# A task is solved when so many of 64 goals that were not seen before are reached.
share_solved = 0.9


def episodes(env: envs.VectorEnv, matrices: np.ndarray, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """One episode a world, each with its own matrix: the sums of rewards, and which goals were reached."""
    seen, _ = env.reset(seed=seed)
    sums, reached, running = np.zeros(env.num_envs), np.zeros(env.num_envs, bool), np.ones(env.num_envs, bool)
    while running.any():
        wanted = np.einsum("wao,wo->wa", matrices[:, :, :-1], seen) + matrices[:, :, -1]
        seen, rewards, terminated, truncated, infos = env.step(np.clip(wanted, -1, 1))
        sums += np.where(running, rewards, 0.0)
        reached |= running & infos["reached"]
        running &= ~(terminated | truncated)
    return sums, reached


def search(task: envs.Task, seconds: float, seed: int = 3) -> tuple[np.ndarray, float]:
    """The best matrix, and the share of goals that it reaches."""
    random = np.random.default_rng(seed)
    ends = time.monotonic() + seconds
    with envs.VectorEnv(task, policies * goals_each) as env:
        (actions,), (seen,) = task.action_space.shape, task.observation_space.shape
        best, best_sum, share, round_ = np.zeros((actions, seen + 1)), -np.inf, 0.0, 0
        while share < share_solved and time.monotonic() < ends:
            round_ += 1
            begins = np.where(np.arange(policies)[:, None, None] % 2, best, 0.0)
            spread = random.choice([0.1, 0.3, 1.0], size=(policies, 1, 1))
            tried = begins + spread * random.normal(size=(policies, *best.shape))
            sums, _ = episodes(env, np.repeat(tried, goals_each, axis=0), seed=2 * round_)
            winner = tried[sums.reshape(policies, goals_each).mean(axis=1).argmax()]
            sums, reached = episodes(env, np.repeat(winner[None], env.num_envs, axis=0), seed=2 * round_ + 1)
            if sums.mean() > best_sum:
                best, best_sum, share = winner, sums.mean(), float(reached.mean())
            print(f"round {round_}: {share:.0%} of the goals reached", flush=True)
    return best, share


if __name__ == "__main__":
    if len(sys.argv) not in (2, 3) or sys.argv[1] not in tasks:
        sys.exit(f"usage: random_search.py {'|'.join(tasks)} [SECONDS]")
    begun = time.monotonic()
    _, share = search(tasks[sys.argv[1]](), float(sys.argv[2]) if len(sys.argv) == 3 else 120.0)
    print(f"{sys.argv[1]}: {share:.0%} of the goals reached, after {time.monotonic() - begun:.0f} s")
    sys.exit(share < share_solved)
