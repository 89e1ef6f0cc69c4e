"""Files whose bytes are damaged."""

import contextlib
import io
import json
import shutil
import zipfile
from functools import partial

import numpy as np

import foreign
import unconstrain as uc
from unconstrain.paper.experiments.journal import Journal
from unconstrain.paper.systems.arm import Arm
from unconstrain.recordings import preparation, readers
from unconstrain.recordings.writers import write_recordings

from .attack import Attack, taught

ODD = (0, 1, -1, 2, 127, 255, 2**15, 2**31 - 1, -(2**31), 2**32 - 1, 2**62, -(2**63))
WORDS = (
    *("nan", "inf", "-1", "1e999", "", "0", "null", "NaN", '"', "[", "{", "\x00", "é", "\x1b[31m", "1e-320"),
    "9" * 400,
)
ROWS = 6
STATES, ACTIONS, STEPS = foreign.STATES[:ROWS], foreign.ACTIONS[:ROWS], foreign.STEPS[:ROWS]
PREPARED = 32
"""Of so many recordings that are read one is prepared for learning, too, which takes as long as reading many."""

BAGS = ("bag", "mcap", "db3")


def damaged(content, rng):
    """Bytes changed, left out, doubled or cut, and numbers in them made odd."""
    harmed = bytearray(content)
    for _ in range(rng.randint(1, 4)):
        at = rng.randrange(len(harmed) + 1)
        length = min(rng.randrange(len(harmed) + 1), rng.choice((1, 4, 8, 64, 4096)))
        match rng.randrange(7):
            case 0:
                harmed[at : at + 1] = rng.randbytes(1)
            case 1:
                del harmed[at : at + length]
            case 2:
                harmed[at:at] = harmed[at : at + length]
            case 3:
                width = rng.choice((1, 2, 4, 8))
                odd = rng.choice(ODD) % 2 ** (8 * width)
                harmed[at : at + width] = odd.to_bytes(width, rng.choice(("little", "big")))
            case 4:
                del harmed[at:]
            case 5:
                harmed[at : at + length] = bytes(length)
            case 6:
                harmed[at : at + rng.randrange(8)] = rng.choice(WORDS).encode()
    return bytes(harmed)


def members(content):
    """Names and bytes in an archive, none if it is no archive."""
    if not zipfile.is_zipfile(io.BytesIO(content)):
        return {}
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def repacked(inside, rng):
    """An archive with one of its members damaged, and sums of it that agree."""
    packed, chosen = io.BytesIO(), rng.choice(list(inside))
    with zipfile.ZipFile(packed, "w") as archive:
        for name, content in inside.items():
            archive.writestr(name, damaged(content, rng) if name == chosen else content)
    return packed.getvalue()


def motion_capture(path):
    import ezc3d

    content = ezc3d.c3d()
    content["parameters"]["POINT"]["RATE"]["value"] = [100.0]
    content["parameters"]["POINT"]["LABELS"]["value"] = ["hand", "tool"]
    content["data"]["points"] = np.ones((4, 2, ROWS))
    content.write(str(path))


def workbook(path):
    from test_formats import workbook

    workbook(path, one=[["t", "x"], *STATES[:, :2].tolist()])


def bag(path):
    written = foreign.bag(path.with_name(f"recorded-{path.suffix[1:]}"), path.suffix[1:], STEPS, ("/joint_states",))
    shutil.copy(written if written.is_file() else next(written.glob(f"*{path.suffix}")), path)


def matlab(path):
    import scipy.io

    scipy.io.savemat(path, foreign.lasa([(STATES, STEPS)] * 2), do_compression=False)


def robot(path):
    from test_arm import URDF

    path.write_text(URDF)


def journal(path):
    return Journal(path, uc.Folds())


def finished_trials(path):
    journal(path).begin()
    journal(path).add(0, [1.0, {"a": 2}])


def table(path):
    columns = ("x", "y", "z", "vx", "vy", "vz")
    several = [uc.Recording(columns, np.hstack([STATES, ACTIONS])[:4], STEPS[:4] * 0.1, name) for name in "ab"]
    write_recordings(several, path)


MADE = {
    "npz": lambda path: np.savez(path, states=STATES, actions=ACTIONS, times=STEPS * 0.1, groups=STEPS // 3),
    "npy": lambda path: np.save(path, STATES),
    "hdf5": partial(foreign.robomimic, demos=1),
    "parquet": table,
    "mat": matlab,
    "csv": table,
    "json": lambda path: path.write_text(json.dumps([{"t": 0.1 * at, "x": [*row]} for at, row in enumerate(STATES)])),
    "xlsx": workbook,
    "c3d": motion_capture,
    **dict.fromkeys(BAGS, bag),
    "urdf": robot,
    "journal": finished_trials,
    "model": lambda path: uc.save(taught(uc.ParametricPolicy(uc.Affine(), "direct")), path),
}
"""Small files of every kind."""

FILES = tuple(MADE)


def read(path, is_prepared=True):
    recordings = uc.read(path, topic="joint_states" if path.suffix[1:] in BAGS else None)
    if not is_prepared:
        return
    list(readers.read_blocks(path))
    preparation.survey_set(recordings)
    recipe, _ = preparation.decide(uc.Recipe(), recordings[0])
    uc.prepare(recordings, recipe)


USES = {
    "urdf": lambda path, is_prepared=True: Arm.from_urdf(path, "hook"),
    "journal": lambda path, is_prepared=True: journal(path).begin(),
    "model": lambda path, is_prepared=True: uc.load(path).predict(np.zeros((1, 2))),
}
"""What is done with files that are no recordings."""


def of_files(kind):
    whole, use = {}, USES.get(kind, read)

    def prepare(folder):
        path = folder / f"a.{kind}"
        MADE[kind](path)
        whole["content"] = path.read_bytes()
        whole["inside"] = members(whole["content"])
        with contextlib.suppress(uc.UnconstrainError):  # not all of them say what is to be learnt
            use(path)

    def attempt(rng, folder):
        path = folder / f"b.{kind}"
        is_packed = whole["inside"] and rng.randrange(2)
        path.write_bytes(repacked(whole["inside"], rng) if is_packed else damaged(whole["content"], rng))
        use(path, rng.randrange(PREPARED) == 0)

    return Attack(f"file {kind}", attempt, 200_000, prepare)
