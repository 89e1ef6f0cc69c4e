"""Every block of the documents does what it says, in the order of the page, as a reader would paste it."""

import re
import shutil
import subprocess
import tomllib
from doctest import ELLIPSIS, NORMALIZE_WHITESPACE, OutputChecker
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from click.testing import CliRunner
from scipy.io import savemat

import unconstrain as uc
from foreign import STATES, STEPS, bag, lasa, lerobot, robomimic
from unconstrain import cli
from unconstrain.evaluation.sentences import _WAYS

ROOT = Path(__file__).parent.parent
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.rst"))]
MARKS = re.compile(
    r"^```(?P<md>python|console)\n(?P<fenced>.*?)^```"
    r"|^\.\. code-block:: (?P<rst>python|console)\n\n(?P<indented>(?:(?: {4}[^\n]*)?\n)+)",
    re.MULTILINE | re.DOTALL,
)

LEFT_OUT = {
    # What a block says: why it is not run.
    "states.cuda()": "needs a GPU",
    "load_rim_wiping(download=True": "needs the network",
    'Client("tcp://': "needs a cluster",
    "--scheduler tcp://": "needs a cluster",
    "make demo": "is a target of the Makefile, and installs",
    "$ make fuzz": "is a target of the Makefile; tests/test_doors.py has some of its attacks",
    "$ pip install": "installs",
    "unconstrain reproduce": "takes minutes to hours; the experiments have tests of their own",
    "--live": "runs until Ctrl-C; tests/test_scene.py runs it",
    "cc -std=c99": "is run with the exported file in the tests of deployment",
}


def blocks(page):
    """Language and text of each block of a page."""
    for found in MARKS.finditer(page.read_text()):
        text = found["fenced"] or re.sub(r"^ {4}", "", found["indented"], flags=re.MULTILINE)
        yield found["md"] or found["rst"], text.strip() + "\n"


def reason(text):
    return next((why for what, why in LEFT_OUT.items() if what in text), None)


def recorded(seed, samples=60):
    """Wiping of a tilted plane: states and actions (samples, 3)."""
    rng = np.random.default_rng(seed)
    states = rng.uniform(-1, 1, (samples, 3))
    wanted = np.column_stack([states[:, 1], -states[:, 0], -states[:, 2]])
    normal = np.array([0.0, 0.3 * seed - 0.5, 1.0])
    normal /= np.linalg.norm(normal)
    return states, wanted - np.outer(wanted @ normal, normal)


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """A folder with the files that the documents read."""
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(tmp_path_factory.mktemp("documents"))
        Path("wipes").mkdir()
        turn = np.linspace(0, 12, 600)
        for k in range(3):
            path = np.column_stack([turn, np.cos(turn), np.sin(turn), 0.1 * k * np.sin(turn + k)])
            header = "t,x,y,z"
            for name in (f"wipes/{k}.csv", *(("held_out.csv", "monday.csv", "tuesday.csv") if k == 2 else ())):
                np.savetxt(name, path, delimiter=",", header=header, comments="")
            table_of(f"wipes/{k}.parquet", *recorded(k))
        rows = [f"{t},{x},{y},{z},{'flat' if t < 6 else 'tilted'}" for t, x, y, z in path]
        Path("wipes.csv").write_text("\n".join(["t,x,y,z,surface", *rows]) + "\n")
        states, actions, groups = learnt_from()
        policy = uc.LocallyLinearPolicy().fit(states, actions, groups=groups)
        uc.save(policy, "wipe.npz", {"recipe": {"states": ["x", "y", "z"]}})
        for k in range(2):
            np.savez(f"batch{k}.npz", states=states[k::2], actions=actions[k::2])
        robomimic("low_dim.hdf5")
        lerobot(Path("my_lerobot_set"), "v3.0")
        bag(Path("wiping.bag"), "bag")
        savemat("Angle.mat", lasa([(STATES[:, :2] * k, STEPS * 0.1) for k in (1, 2, 3)]))
        return Path.cwd()


def learnt_from():
    """States, actions and groups of four wipes."""
    states, actions = map(np.concatenate, zip(*map(recorded, range(4)), strict=True))
    return states, actions, np.repeat(np.arange(4), 60)


@pytest.fixture
def names(written, tmp_path, monkeypatch):
    """What the documents take for granted, and a copy of the files that they read."""
    shutil.copytree(written, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    states, actions, groups = learnt_from()
    turns = iter([True, True, False])
    robot = SimpleNamespace(read=lambda: states[0], command=lambda action: None)
    return {
        "states": states,
        "actions": actions,
        "groups": groups,
        "times": np.tile(0.02 * np.arange(60), 4),
        "more_states": states + 0.1,
        "more_actions": actions,
        "more_groups": groups + 10,
        "paths": sorted(Path().glob("wipes/*.parquet")),
        "n": 3,
        "d": 3,
        "robot": robot,
        "running": lambda: next(turns),
        "simulate": lambda seed: recorded(seed % 4),
    }


def table_of(name, states, actions):
    pyarrow, parquet = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    columns = dict(zip(("x", "y", "z", "vx", "vy", "vz"), np.column_stack([states, actions]).T, strict=True))
    parquet.write_table(pyarrow.table(columns), name)


def run_console(text):
    """Each command of a console block, as the shell parts its words, and what it prints, where that is shown."""
    for written in re.findall(r"(?:-o|--report) (\S+)", text):
        for place in {Path(written), Path(written).with_suffix(".h")}:
            place.unlink(missing_ok=True)
    for command, shown in re.findall(r"^\$ (.*\n)((?:(?!\$ ).*\n)*)", text, re.MULTILINE):
        words = ["bash", "-ec", f"unconstrain() {{ printf '%s\\0' \"$@\"; }}; {command}"]
        parted = subprocess.run(words, capture_output=True, text=True, check=True).stdout.split("\0")
        done = CliRunner().invoke(cli.main, parted[:-1], prog_name="unconstrain")
        assert (done.exit_code, parted[-1]) == (0, ""), f"{command}: {done.output}"
        assert not shown.strip() or as_shown(shown, done.stdout), f"{command}prints {done.stdout}"


def as_shown(shown, printed):
    """Whether it was printed so; lines may break elsewhere, and ``...`` stands for anything."""
    return OutputChecker().check_output(shown, printed, ELLIPSIS | NORMALIZE_WHITESPACE)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::unconstrain.recordings.preparation.PreparationWarning")
@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_the_blocks_of_a_page_run(page, names):
    for number, (language, text) in enumerate(blocks(page), start=1):
        if reason(text) is not None:
            continue
        if language == "console":
            run_console(text)
        else:
            exec(compile(text, f"{page.name}, block {number}", "exec"), names)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_what_commands_print_is_shown_without_measured_figures(page):
    """They change with every release; words and figures that are counted stay, and are compared."""
    shown = [line for kind, text in blocks(page) if kind == "console" for line in text.splitlines() if line[:2] != "$ "]
    assert [line for line in shown if re.search(r"\d%|\d\.\d+ (?!\()", line)] == []


def test_other_output_than_shown_is_found(names):
    run_console("$ unconstrain play -o play.html\n✔ A page to draw on, ...\n  Next: Open it in a browser.\n\n...\n")
    with pytest.raises(AssertionError, match="prints"):
        run_console("$ unconstrain play -o play.html\n✔ A page to look at, ...\n")


def test_links_of_the_readme_work_in_a_package_index_once_there_is_an_address():
    urls = "urls" in tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    readme = PAGES[0].read_text("utf-8")
    relative = [link for link in re.findall(r"\]\(([^) ]+)", readme) if "://" not in link]
    assert all((ROOT / link).exists() for link in relative)
    assert bool(relative) == ("The package has no public address yet" in readme) == (not urls)


def test_all_that_is_left_out_is_there():
    said = "\n".join(text for page in PAGES for _, text in blocks(page))
    assert [what for what in LEFT_OUT if what not in said] == []


def test_the_glossary_has_the_names_of_candidates():
    words = (ROOT / "docs" / "glossary.rst").read_text("utf-8")
    assert [name for name in _WAYS if f"\n   {name}\n" not in words] == ["direct"]  # as direct learning
