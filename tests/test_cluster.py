"""Many processes learn what one learns, also when one of them is killed half-way."""

import os
import signal
import sys
import time

import dask
import distributed
import numpy as np
import pytest
from click.testing import CliRunner
from dask import array
from numpy.testing import assert_allclose, assert_array_equal
from sklearn.base import clone

import unconstrain as uc
from samples import draw
from unconstrain import cli, cluster
from unconstrain.base.errors import InvalidDataError, MissingExtraError, SettingError

# What the cluster says while its processes come and go is not ours.
pytestmark = pytest.mark.filterwarnings("ignore")

DATA = draw(samples=600, groups=7)
WEIGHTS = np.random.default_rng(5).uniform(0, 2, 600)
POLICIES = {
    "kmeans": lambda: uc.ParametricPolicy(uc.KMeansRBF(7), uc.Hybrid()),
    "local": lambda: uc.LocallyLinearPolicy(0.5, learner=uc.Hybrid()),
    "by_demonstration": lambda: uc.ParametricPolicy(
        uc.Affine(), uc.Hybrid(), validation=uc.Folds(3, by="demonstration")
    ),
}


@pytest.fixture(scope="module")
def workers():
    """Two processes, and a client of theirs."""
    paths = os.pathsep.join([os.path.dirname(os.path.dirname(uc.__file__)), os.path.dirname(__file__)])  # noqa: PTH120
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYTHONPATH", paths)
        with (
            dask.config.set({"distributed.worker.daemon": False}),
            distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as running,
            distributed.Client(running, set_as_default=False) as client,
        ):
            yield client


def same(one, other):
    for mine, theirs in zip(one.training_.gathered.parts, other.training_.gathered.parts, strict=True):
        for a, b in zip(mine.sums, theirs.sums, strict=True):
            assert_allclose(a, b, rtol=1e-11, atol=1e-11 * max(1.0, np.abs(b).max()))
    assert_array_equal(one.solution_.determined, other.solution_.determined)
    assert_allclose(one(DATA.states), other(DATA.states), atol=1e-9)


def chunked(rows, *arrays):
    return [array.from_array(values, chunks=(rows, *values.shape[1:])) for values in arrays]


@pytest.mark.parametrize("kind", POLICIES)
@pytest.mark.parametrize("rows", [600, 45])
def test_chunks_of_dask_are_the_same_as_one_array(kind, rows):
    serial = POLICIES[kind]().fit(DATA.states, DATA.actions, sample_weight=WEIGHTS, groups=DATA.groups)
    parallel = POLICIES[kind]()
    X, y, weights, groups = chunked(rows, DATA.states, DATA.actions, WEIGHTS, DATA.groups)
    found = cluster.fit(parallel, X, y, sample_weight=weights, groups=groups)
    assert found is parallel
    same(found, serial)


def test_widths_are_chosen_on_the_samples_that_one_process_chooses_on():
    few, auto = (DATA.states[:120], DATA.actions[:120]), uc.LocallyLinearPolicy("auto", learner="hybrid")
    serial, parallel = clone(auto).fit(*few), cluster.fit(auto, *chunked(15, *few))
    assert serial.variance_ != uc.LocallyLinearPolicy(None, learner="hybrid").fit(*few).variance_
    same(parallel, serial)


def test_it_learns_on_where_the_cluster_ended():
    policy = cluster.fit(uc.ParametricPolicy(uc.Affine(), uc.Hybrid()), *chunked(50, DATA.states, DATA.actions))
    policy.partial_fit(DATA.states[:10], DATA.actions[:10])
    assert policy.moments_.weight[0] == 610


def test_a_vector_of_actions_stays_one():
    policy = cluster.fit(uc.ParametricPolicy(uc.Affine(), uc.Hybrid()), *chunked(50, DATA.states, DATA.actions[:, 0]))
    assert policy.predict(DATA.states).shape == (600,)


def test_processes_learn_what_one_learns(workers):
    for make in POLICIES.values():
        X, y, weights, groups = chunked(100, DATA.states, DATA.actions, WEIGHTS, DATA.groups)
        found = cluster.fit(make(), X, y, sample_weight=weights, groups=groups, client=workers)
        same(found, make().fit(DATA.states, DATA.actions, sample_weight=WEIGHTS, groups=DATA.groups))


class Slow:
    """Batches that take their time, and say who reads them."""

    def __init__(self, number, folder):
        self.number, self.folder = number, folder

    def __iter__(self):
        (self.folder / f"{os.getpid()} {self.number}").touch()
        time.sleep(0.1)
        rows = slice(50 * self.number, 50 * (self.number + 1))
        yield DATA.states[rows], DATA.actions[rows], None, DATA.groups[rows]


def test_a_worker_that_is_killed_half_way_changes_nothing(workers, tmp_path):
    serial = POLICIES["kmeans"]().fit(DATA.states, DATA.actions, groups=DATA.groups)
    from threading import Thread

    killed = []

    def read():
        """Parts that each process has begun to read."""
        parts = {}
        for pid, part in (path.name.split() for path in tmp_path.iterdir()):
            parts.setdefault(pid, set()).add(part)
        return parts

    def kill():
        for _ in range(600):
            pids = list(read())
            if len(pids) == 2:
                time.sleep(0.25)
                os.kill(int(pids[0]), signal.SIGKILL)
                killed.append(pids[0])
                return
            time.sleep(0.02)

    killer = Thread(target=kill)
    killer.start()
    parts = [Slow(number, tmp_path) for number in range(12)]
    parallel = cluster.fit_batches(POLICIES["kmeans"](), parts, client=workers)
    killer.join()
    [dead], parts = killed, read()
    assert parts.pop(dead) & set().union(*parts.values()), "another process took over"
    same(parallel, serial)


def recordings(folder):
    for number in range(3):
        rows = DATA.groups % 3 == number
        table = np.hstack([DATA.states[rows], DATA.actions[rows]])
        np.savetxt(folder / f"wipe_{number}.csv", table, "%.17g", ",", header="x,y,vx,vy", comments="")
    return folder / "wipe_*.csv"


def test_the_command_line_fits_on_a_cluster(workers, tmp_path):
    pattern = str(recordings(tmp_path))
    said = []
    for name, more in (("here", []), ("there", ["--scheduler", workers.scheduler.address])):
        options = ["fit", pattern, "--state", "x,y", "--action", "vx,vy", "-o", str(tmp_path / f"{name}.npz")]
        options += ["--learner", "hybrid", "--leave-out", "wipe_1"]
        ran = CliRunner().invoke(cli.main, [*options, *more], prog_name="unconstrain")
        assert ran.exit_code == 0, ran.stderr
        said.append(ran.stdout)
    same(uc.load(tmp_path / "there.npz"), uc.load(tmp_path / "here.npz"))
    assert "2 demonstrations, 428 samples" in said[0]
    assert "where held out" in said[1]
    ran = CliRunner().invoke(cli.main, [*options, *more, "--force", "--leave-out", "wipe1"], prog_name="unconstrain")
    assert "--leave-out: no demonstration is called 'wipe1'" in ran.stderr
    assert "Did you mean 'wipe_1'" in ran.stderr


def test_errors_on_a_worker_are_ours(workers):
    states = DATA.states.copy()
    states[400, 1] = np.nan
    with pytest.raises(InvalidDataError, match="found nan at row 0, column 1"):
        cluster.fit(uc.ParametricPolicy(), *chunked(100, states, DATA.actions), client=workers)


def test_arrays_that_do_not_match_are_refused():
    with pytest.raises(InvalidDataError, match=r"arrays of \[6, 12\] chunks of rows"):
        cluster.fit(uc.ParametricPolicy(), *chunked(100, DATA.states), *chunked(50, DATA.actions))
    with pytest.raises(InvalidDataError, match="got ndarray, expected dask arrays"):
        cluster.fit(uc.ParametricPolicy(), DATA.states, DATA.actions)
    with pytest.raises(InvalidDataError, match="got no part to learn from"):
        cluster.fit_batches(uc.ParametricPolicy(), [])
    with pytest.raises(InvalidDataError, match="got no sample that counts"):
        cluster.fit_batches(uc.ParametricPolicy(), [[]])


def test_a_scheduler_that_is_not_there_is_said():
    for address in ("tcp://127.0.0.1:9", "nonsense://here"):
        with pytest.raises(SettingError, match="scheduler: nothing answers at"):
            cluster.connected(address, timeout_s=0.5)


def test_without_dask_the_error_names_the_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "dask", None)
    with pytest.raises(MissingExtraError, match=r"unconstrain\[cluster\]"):
        cluster.fit_batches(uc.ParametricPolicy(), [[(DATA.states, DATA.actions)]])


def test_a_learner_that_needs_samples_is_refused_before_anything_is_computed():
    with pytest.raises(uc.UnconstrainError, match="sums alone"):
        uc.cluster.fit_batches(uc.ParametricPolicy(learner=uc.NoiseCorrected()), [None])
