"""What commands write: nothing that is there or read is lost, and no work is for nothing."""

import os
import sys

import numpy as np
import pytest
from click.testing import CliRunner

import unconstrain as uc
from unconstrain import cli

COMMANDS = {
    "fit": ("fit", "a.csv", "--model", "affine", "--learner", "direct", "-o", "out.npz"),
    "report": ("fit", "a.csv", "--model", "affine", "--learner", "direct", "-o", "new.npz", "--report", "out.html"),
    "constraint": ("constraint", "a.csv", "--features", "constant", "-o", "out.npz"),
    "diagnose": ("diagnose", "a.csv", "--model", "affine", "-o", "out.html"),
    "rollout": ("rollout", "p.npz", "--start", "0,0", "--steps", "2", "-o", "out.csv"),
    "export": ("export", "p.npz", "-o", "out.c"),
    "convert": ("convert", "a.csv", "out.csv"),
}
"""Commands that write a file whose name is given, by what they write last."""


def call(*args):
    return CliRunner().invoke(cli.main, args, prog_name="unconstrain")


def refused(*args):
    """The one sentence of a command that has to refuse."""
    ran = call(*args)
    assert (ran.exit_code, ran.stdout) == (2, ""), ran.output
    return ran.stderr.removeprefix("Error: ").rstrip("\n")


def read_by(command):
    return command[1]


def written_by(command):
    return command[-1]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A recording and a policy, in the working folder."""
    monkeypatch.chdir(tmp_path)
    rng = np.random.default_rng(0)
    states = rng.uniform(-1, 1, (40, 2))
    table = np.column_stack([0.1 * np.arange(40), states, -states @ [[1.0, 0.0], [0.0, 0.0]]])
    np.savetxt("a.csv", table, delimiter=",", header="t,x,y,vx,vy", comments="")
    uc.save(uc.ParametricPolicy(uc.Affine(), learner="direct").fit(states, -states), "p.npz")
    return tmp_path


@pytest.mark.parametrize("command", COMMANDS.values(), ids=COMMANDS)
def test_what_is_there_is_replaced_only_with_force(folder, command):
    out = folder / written_by(command)
    out.write_text("mine")
    told = refused(*command)
    assert told == f"{out.name}: is there; give another name, or --force to replace it."
    assert out.read_text() == "mine"
    assert not (folder / "new.npz").exists()
    assert call(*command, "--force").exit_code == 0
    assert out.read_bytes() != b"mine"


@pytest.mark.parametrize("command", COMMANDS.values(), ids=COMMANDS)
def test_the_place_is_refused_before_anything_is_read(folder, command):
    (folder / read_by(command)).write_bytes(b"nothing that can be read")
    (folder / written_by(command)).touch()
    assert refused(*command).startswith(f"{written_by(command)}: is there; ")
    assert refused(*command[:-1], f"none/{written_by(command)}").startswith(f"none/{written_by(command)}: cannot be ")
    (folder / "closed").mkdir(mode=0o500)
    if not os.access("closed", os.W_OK):  # root may write anywhere
        assert "its folder may not be written to" in refused(*command[:-1], f"closed/{written_by(command)}")


@pytest.mark.parametrize("link", [os.link, os.symlink])
@pytest.mark.parametrize("command", COMMANDS.values(), ids=COMMANDS)
def test_what_is_read_is_never_replaced_under_any_name(folder, command, link):
    read = folder / read_by(command)
    before = read.read_bytes()
    link(read.name, written_by(command))
    told = refused(*command, "--force")
    assert told == f"{written_by(command)}: is one of the files to read; give another name to write to."
    assert read.read_bytes() == before


def test_a_constraint_and_a_robot_are_read_too(folder):
    rollout, robot = COMMANDS["rollout"][:-1], ("--jacobian", "a.c", "--tip", "hand", "-o", "a.c", "--force")
    (folder / "c.npz").touch()
    (folder / "a.c").touch()
    assert "is one of the files to read" in refused(*rollout, "c.npz", "--constraint", "c.npz", "--force")
    assert "is one of the files to read" in refused("constraint", "a.csv", *robot)


@pytest.mark.parametrize("there", [False, True])
def test_two_outputs_have_two_places(folder, there):
    (folder / "again").symlink_to(folder)
    if there:
        (folder / "x.npz").touch()
        os.link("x.npz", "y.npz")
    other = "y.npz" if there else "again/x.npz"
    told = refused("fit", "a.csv", "-o", "x.npz", "--report", other, "--force")
    assert told == f"{other}: is given for two outputs; give each a name of its own."


def test_a_folder_with_what_is_read_is_not_replaced(folder):
    assert call("convert", "a.csv", "set", "--state", "x,y").exit_code == 0
    assert refused("convert", "set", "set", "--force").startswith("set: is one of the files to read")
    assert uc.read("set")


def test_a_rollout_that_is_printed_writes_nothing(folder):
    before = sorted(folder.iterdir())
    assert call(*COMMANDS["rollout"][:-2]).exit_code == 0
    assert sorted(folder.iterdir()) == before


@pytest.mark.parametrize(
    ("command", "module", "extra"),
    [
        (COMMANDS["report"], "jinja2", "viz"),
        (COMMANDS["diagnose"], "matplotlib", "viz"),
        (("export", "p.npz", "-o", "a.onnx"), "onnx", "onnx"),
        (("convert", "a.csv", "b.parquet"), "pyarrow", "data"),
    ],
)
def test_what_is_needed_to_write_is_looked_for_before_anything_is_read(folder, monkeypatch, command, module, extra):
    monkeypatch.setitem(sys.modules, module, None)
    (folder / read_by(command)).write_bytes(b"nothing that can be read")
    assert f"pip install 'unconstrain[{extra}]'" in refused(*command)
