"""One door in: whatever a file holds, it is read, or there is one error of ours that names it."""

import os
import random
import subprocess
import sys
import threading
import time
import zipfile
from pathlib import Path

import click
import h5py
import numpy as np
import pytest
from click.testing import CliRunner
from numpy.testing import assert_allclose, assert_array_equal

import fuzz
import unconstrain as uc
from test_cli import environment
from unconstrain import cli
from unconstrain.base.display import listening
from unconstrain.base.errors import InvalidDataError, ReadError, SettingError
from unconstrain.base.foreign import check_size, ours_alone
from unconstrain.cli import progress
from unconstrain.paper.systems.arm import Arm
from unconstrain.training import cluster

STATES, ACTIONS = np.arange(18.0).reshape(9, 2), np.ones((9, 2))


# The attacks of tests/fuzz.py, some of each


IN_PROCESSES = ("kills", "commands", "streams")


@pytest.mark.parametrize("name", [name for name in fuzz.ATTACKS if name not in IN_PROCESSES])
def test_a_few_attacks_find_nothing(name, tmp_path):
    fuzz.ATTACKS[name].prepare(tmp_path)
    assert [said for number in range(25) if (said := fuzz.trial(fuzz.ATTACKS[name], number, tmp_path))] == []


@pytest.mark.parametrize("name", IN_PROCESSES)
def test_attacks_that_take_long_find_nothing_either(name):
    """In a process of its own: what forks should have no threads."""
    code = f"import fuzz; tally = fuzz.run(fuzz.ATTACKS[{name!r}], wanted=3); print(tally.tried, tally.faults)"
    told = {"cwd": Path(__file__).parent, "env": environment()}
    assert subprocess.check_output([sys.executable, "-c", code], text=True, **told).split() == ["3", "{}"]


def watched(attempt, **told):
    return fuzz.run(fuzz.ATTACKS["file npy"]._replace(attempt=attempt), wanted=3, **told)


def test_attacks_see_what_is_foreign():
    def fails(rng, folder):
        raise AttributeError("not ours")

    [(said, count)] = watched(fails).faults.items()
    assert said.startswith("AttributeError: not ours (test_doors.py")
    assert count == 3


def test_a_process_that_ends_or_hangs_is_one_fault_and_others_go_on(monkeypatch):
    def ends_at_the_second(rng, folder):
        if rng.random() == random.Random("file npy 1").random():
            os._exit(3)

    def hangs_at_the_last(rng, folder):
        while rng.random() == random.Random("file npy 2").random():
            rng.seed("file npy 2")

    monkeypatch.setattr(fuzz.running, "HANG_S", 0.2)
    tally = watched(ends_at_the_second, lanes=2)
    assert (tally.tried, tally.faults, tally.examples) == (
        3,
        {"ended the process with 3": 1},
        {"ended the process with 3": 1},
    )
    assert watched(hangs_at_the_last).examples == {"did not end": 2}


def test_a_tally_goes_on_until_the_code_that_was_tried_changes(tmp_path, monkeypatch):
    monkeypatch.setattr(fuzz.running, "ROOT", tmp_path)
    (tmp_path / "a.py").write_text("1")
    fuzz.Tally(tried=7, code=fuzz.running.digests(["a.py"])).keep(tmp_path / "kept.json")
    assert fuzz.Tally.kept(tmp_path / "kept.json").tried == 7
    (tmp_path / "a.py").write_text("2")
    assert fuzz.Tally.kept(tmp_path / "kept.json").tried == 0
    assert fuzz.Tally.kept(tmp_path / "none.json").tried == 0


# HDF5


def linked(folder, **members):
    with h5py.File(folder / "other.h5", "w") as other:
        other["states"], other["deep/states"] = 2 * STATES, STATES
    with h5py.File(folder / "a.h5", "w") as file:
        file["actions"] = ACTIONS
        for name, member in members.items():
            file[name] = member
    return folder / "a.h5"


def test_links_round_in_a_file_are_followed_once(tmp_path):
    path = linked(tmp_path, states=STATES, latest=h5py.SoftLink("/"), lost=h5py.SoftLink("/nowhere"))
    with h5py.File(path, "a") as file:
        group = file
        for _ in range(40):
            inner = group.create_group("inner")
            for name in "abcdefgh":
                group[name] = inner
            group = inner
    [recording] = uc.read(path)
    assert_array_equal(recording.select(["x1", "x2"]), STATES)


@pytest.mark.parametrize("target", ["/states", "/deep"])
def test_links_to_another_file_are_not_followed_and_said(tmp_path, target):
    path = linked(tmp_path, states=h5py.ExternalLink("other.h5", target), round=h5py.SoftLink("/states"))
    [recording] = uc.read(path)
    assert recording.columns == ("actions1", "actions2")
    assert ("dropped-column", "states") in [(remark.code, remark.column) for remark in recording.remarks]


def test_data_that_lies_in_another_file_is_not_read(tmp_path):
    layout = h5py.VirtualLayout(shape=(9, 2), dtype="f8")
    path = linked(tmp_path)
    layout[:] = h5py.VirtualSource(tmp_path / "other.h5", "states", shape=(9, 2))
    with h5py.File(path, "a") as file:
        file.create_virtual_dataset("states", layout)
    assert uc.read(path)[0].columns == ("actions1", "actions2")


def test_times_in_words_are_times(tmp_path):
    path = linked(tmp_path, states=STATES, time=[f"2024-01-01T00:00:0{second}" for second in range(9)])
    assert_allclose(uc.read(path)[0].times, np.arange(9.0))


def test_what_no_file_holds_is_refused_before_it_is_made(tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        for name in ("states", "actions"):
            file.create_dataset(name, (10**12, 2), "f8", chunks=(1000, 2))
    with pytest.raises(ReadError, match=r"a\.h5: cannot be read \(it says that it holds 2,000,000,000,000 numbers"):
        uc.read(tmp_path / "a.h5")
    with pytest.raises(ValueError, match="read a part of it"):
        check_size(2**40)


# Other formats


def test_a_member_that_is_no_array_is_named(tmp_path):
    np.savez(tmp_path / "a.npz", states=STATES, actions=ACTIONS)
    with zipfile.ZipFile(tmp_path / "a.npz", "a") as archive:
        archive.writestr("note", b"hi")
    with pytest.raises(ReadError, match=r"a\.npz: note in it: no array"):
        uc.read(tmp_path / "a.npz")


@pytest.mark.parametrize(
    ("failure", "said"),
    [
        (MemoryError(), "more memory"),
        (RecursionError("deep"), "nested too deeply"),
        (OverflowError(), "too large"),
        (KeyError("a"), "'a'"),
        (AssertionError(), "AssertionError"),
    ],
)
def test_whatever_is_raised_is_one_of_ours(failure, said):
    with (
        pytest.raises(ReadError, match=f"a.b: cannot be read .*{said}.* Expected a file."),
        ours_alone("a.b", "a file"),
    ):
        raise failure
    with pytest.raises(SettingError), ours_alone("a.b", "a file"):
        raise SettingError("ours")


LIMIT = '<axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="1" velocity="1"/>'


def robot(folder, *joints):
    links = "".join(f'<link name="{name}"/>' for name in "abcde")
    of = "".join(
        f'<joint name="{parent}{child}" type="revolute"><parent link="{parent}"/><child link="{child}"/>{rest}</joint>'
        for parent, child, rest in joints
    )
    (folder / "r.urdf").write_text(f'<robot name="r">{links}{of}</robot>')
    return folder / "r.urdf"


def test_joints_in_a_ring_end(tmp_path):
    path = robot(tmp_path, ("a", "b", LIMIT), ("b", "c", LIMIT), ("c", "b", LIMIT))
    with pytest.raises(ReadError, match="make a ring"):
        Arm.from_urdf(path, "c")


@pytest.mark.parametrize(
    "odd", ['<axis xyz="nan 0 1"/>', LIMIT.replace('"-1"', '"nan"'), f'<origin xyz="0 inf 0"/>{LIMIT}']
)
def test_a_joint_of_no_number_is_refused_where_it_is_on_the_way(tmp_path, odd):
    path = robot(tmp_path, ("a", "b", LIMIT), ("b", "c", LIMIT), ("b", "d", odd))
    assert Arm.from_urdf(path, "c").names == ("ab", "bc")
    with pytest.raises(ReadError, match="'bd' on the way to 'd'"):
        Arm.from_urdf(path, "d")


def test_joints_that_mimic_others_elsewhere_do_no_harm(tmp_path):
    path = robot(tmp_path, ("a", "b", LIMIT), ("b", "c", LIMIT), ("b", "d", f'{LIMIT}<mimic joint="bc"/>'))
    assert Arm.from_urdf(path, "c").names == ("ab", "bc")
    with pytest.raises(SettingError, match="mimics"):
        Arm.from_urdf(path, "d")


# In proportion


def test_sums_that_no_memory_holds_are_refused_in_words():
    with pytest.raises(InvalidDataError, match=r"400 actions and 401 features in 1 model make sums of .* GB"):
        uc.ParametricPolicy(uc.Affine()).fit(np.ones((5, 400)), np.ones((5, 400)))


def test_work_that_takes_long_says_so(tmp_path, monkeypatch):
    said, echo = threading.Event(), click.echo

    def slow(policy, stream):
        assert said.wait(10)
        time.sleep(0.3)
        return fit_batches(policy, stream)

    def heard(text="", **how):
        if "..." in text:
            said.set()
        echo(text, **how)

    fit_batches = uc.ParametricPolicy.fit_batches
    monkeypatch.setattr(progress, "FIRST_S", 0.05)
    monkeypatch.setattr(progress.click, "echo", heard)
    monkeypatch.setattr(uc.ParametricPolicy, "fit_batches", slow)
    rows = np.column_stack([STATES, ACTIONS])
    np.savetxt(tmp_path / "a.csv", rows, delimiter=",", header="x,y,vx,vy", comments="")
    ran = CliRunner().invoke(cli.main, ["fit", str(tmp_path / "a.csv"), "--model", "affine", "-o", str(tmp_path / "p")])
    assert ran.exit_code == 0
    assert ran.stderr.count("reading, placing, learning: ... (0 s)") == 1  # though it would be time for more


@pytest.mark.parametrize("learner", [uc.Robust(), uc.Hybrid()], ids=["robust", "hybrid"])
def test_a_fit_counts_off_its_folds_to_who_listens(learner):
    heard = []
    policy, groups = uc.ParametricPolicy(uc.Affine(), learner, uc.Folds(3)), np.arange(len(STATES)) % 3
    with listening(lambda what, number, of: heard.append((what.rpartition(" ")[2], number, of))):
        policy.fit(STATES, ACTIONS, groups=groups)
    folds = [(number, of) for what, number, of in heard if what == "fold"]
    assert folds[:3] == [(1, 3), (2, 3), (3, 3)]
    policy.fit(STATES, ACTIONS, groups=groups)  # nobody listens
    assert len([one for one in heard if one[0] == "fold"]) == len(folds)


def test_what_a_cluster_raises_is_one_sentence():
    comm = pytest.importorskip("distributed.comm")
    with pytest.raises(SettingError, match=r"the cluster gave up \(CommClosedError: lost\)"), cluster._of_cluster():
        raise comm.CommClosedError("lost")
    with pytest.raises(ZeroDivisionError), cluster._of_cluster():
        raise ZeroDivisionError


@pytest.mark.parametrize(
    "names", [np.array([b"a", b"\xff"]), np.array(["2024-01-01", "2024-01-02"], "M8[D]"), np.array([0j, 1j])]
)
def test_names_of_demonstrations_that_can_be_learnt_from_can_be_saved(names, tmp_path):
    states = np.random.default_rng(0).normal(size=(40, 2))
    policy = uc.ParametricPolicy(uc.Affine()).fit(states, -states, groups=names[np.arange(40) % 2])
    uc.save(policy, tmp_path / "p.npz")
    assert set(uc.load(tmp_path / "p.npz").training_.split.fold_of) == set(policy.training_.split.fold_of)
    assert all(isinstance(name, str) for name in policy.training_.split.fold_of)
