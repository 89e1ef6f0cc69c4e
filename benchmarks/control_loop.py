"""How long one step of a policy takes in Python, C and ONNX; needs a C compiler called cc."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter

import numpy as np
from table import Row, row, script

import unconstrain as uc
from unconstrain.base.arrays import Array

FIELDS, JOINTS = 50, 7
REPEATS, CALLS = 15, 5_000

_LOOP = """
#include <time.h>
void policy_step(const double state[{n}], double action[{n}]);
double seconds(const double *states, int count, int rounds);
volatile double sink; /* so that no call can be left out */
double seconds(const double *states, int count, int rounds)
{{
    double action[{n}];
    struct timespec start, stop;
    int i, r;
    clock_gettime(CLOCK_MONOTONIC, &start);
    for (r = 0; r < rounds; r++)
        for (i = 0; i < count; i++) {{
            policy_step(states + {n} * i, action);
            sink = action[0];
        }}
    clock_gettime(CLOCK_MONOTONIC, &stop);
    return (double)(stop.tv_sec - start.tv_sec) + 1e-9 * (double)(stop.tv_nsec - start.tv_nsec);
}}
"""


def arm_policy() -> uc.LocallyLinearPolicy:
    """A locally linear policy of seven joints in fifty fields."""
    rng = np.random.default_rng(0)
    states = rng.uniform(-2, 2, (3000, JOINTS))
    actions = np.sin(states[:, ::-1]) - 0.3 * states
    return uc.LocallyLinearPolicy(3.0, centres=states[:FIELDS], learner=uc.Direct()).fit(states, actions)


def median_us(call: Callable[[Array], object], states: Array) -> float:
    """Median time of one call on one state, µs."""
    times = []
    for _ in range(REPEATS):
        start = perf_counter()
        for state in states:
            call(state)
        times.append((perf_counter() - start) / len(states))
    return 1e6 * float(np.median(times))


def in_c(policy: uc.LocallyLinearPolicy, folder: Path, states: Array) -> float:
    """Median time of one step in a loop in C, µs."""
    policy.export_c(folder / "policy.c")
    (folder / "loop.c").write_text("#define _POSIX_C_SOURCE 199309L\n" + _LOOP.format(n=JOINTS))
    command = ["cc", "-std=c99", "-O3", "-shared", "-fPIC", "policy.c", "loop.c", "-lm", "-o", "loop.so"]
    subprocess.run(command, cwd=folder, check=True)
    seconds = ctypes.CDLL(str(folder / "loop.so")).seconds
    seconds.restype, pointer = ctypes.c_double, states.ctypes.data_as(ctypes.POINTER(ctypes.c_double))
    return 1e6 * float(np.median([seconds(pointer, len(states), 4) for _ in range(REPEATS)])) / (4 * len(states))


def in_onnx(policy: uc.LocallyLinearPolicy, folder: Path, states: Array) -> dict[str, float]:
    """Median time of one run on one state, with buffers bound once, and of a graph that only returns it, µs."""
    import onnx
    import onnxruntime

    policy.export_onnx(folder / "policy.onnx")
    model = onnx.load(folder / "policy.onnx")
    del model.graph.node[:], model.graph.initializer[:]
    model.graph.node.append(onnx.helper.make_node("Identity", ["states"], ["actions"]))
    onnx.save(model, folder / "empty.onnx")
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1
    graph, empty = (
        onnxruntime.InferenceSession(folder / name, options, providers=["CPUExecutionProvider"])
        for name in ("policy.onnx", "empty.onnx")
    )
    state, action = np.empty((1, JOINTS)), np.empty((1, JOINTS))
    bound = graph.io_binding()
    bound.bind_input("states", "cpu", 0, np.float64, state.shape, state.ctypes.data)
    bound.bind_output("actions", "cpu", 0, np.float64, action.shape, action.ctypes.data)

    def through_buffers(given: Array) -> None:
        state[0] = given
        graph.run_with_iobinding(bound)

    return {
        "one state": median_us(lambda given: graph.run(None, {"states": given[None]}), states),
        "one state, buffers bound": median_us(through_buffers, states),
        "a graph that does nothing": median_us(lambda given: empty.run(None, {"states": given[None]}), states),
    }


def guided(policy: uc.LocallyLinearPolicy, states: Array) -> dict[str, float]:
    """How many times as long a step takes that is guided: to a goal, and on a cycle."""
    out = np.empty(JOINTS)
    demos = [uc.Demonstration(states[:300], policy(states[:300]))]
    angles = np.linspace(0.0, 2.0 * np.pi, 300)[:, None] + np.linspace(0.0, 2.0, JOINTS)
    cycle = uc.Guided(policy, orbit=np.cos(angles))
    aims = {"to a goal": uc.Guided(policy, np.zeros(JOINTS), demonstrations=demos), "on a cycle": cycle}
    plain = median_us(lambda state: policy.step(state, out), states)
    return {name: median_us(lambda state, aim=aim: aim.step(state, out), states) / plain for name, aim in aims.items()}


def main() -> list[Row]:
    """Rows of all."""
    policy = arm_policy()
    states = np.random.default_rng(1).uniform(-2, 2, (CALLS, JOINTS))
    out = np.empty(JOINTS)
    what = f"{FIELDS} fields, {JOINTS}-DOF"
    rows = [
        row(f"step, {what}", median_us(policy.step, states), "µs", 20.0, 8.0),
        row(f"step into a buffer, {what}", median_us(lambda state: policy.step(state, out), states), "µs", 20.0, 8.0),
        row(f"predict of one state, {what}", median_us(lambda state: policy.predict(state[None]), states[:200]), "µs"),
    ]
    rows += [row(f"step guided {aim} / plain, {what}", took, "×", 2.0) for aim, took in guided(policy, states).items()]
    with TemporaryDirectory() as made:
        if shutil.which("cc"):
            rows.append(row(f"exported C, {what}", in_c(policy, Path(made), states), "µs", 3.0, 1.0))
        for how, took in in_onnx(policy, Path(made), states).items():
            most = None if "nothing" in how else 15.0
            rows.append(row(f"exported ONNX, {how}, {what}", took, "µs", most))
    return rows


if __name__ == "__main__":
    script(main)
