"""Files that change while they are read."""

import os
import shutil

import numpy as np

import unconstrain as uc
from unconstrain.recordings import readers

COLUMNS = ("x1", "x2", "u1", "u2")


def as_text(path, table, rng):
    text = b"".join(b"%.3f,0.001,0.001,0.001\n" % each for each in table[:, 0])
    path.write_bytes(",".join(COLUMNS).encode() + b"\n" + text)


def as_parquet(path, table, rng):
    import pyarrow as pa
    import pyarrow.parquet as pq

    columns = dict(zip(COLUMNS, table.T, strict=True))
    pq.write_table(pa.table(columns), path, row_group_size=rng.choice((20_000, 200_000)))


def as_hdf5(path, table, rng):
    import h5py

    made = path.with_name("made")  # the one that is being read cannot be opened
    with h5py.File(made, "w") as file:
        file["states"], file["actions"] = table[:, :2], table[:, 2:]
    path.write_bytes(made.read_bytes())


WRITTEN = {"csv": as_text, "parquet": as_parquet, "npy": lambda path, table, rng: np.save(path, table), "hdf5": as_hdf5}


def streams(rng, folder):
    kind, rows = rng.choice([*WRITTEN]), rng.randrange(140_000, 260_000)
    path = folder / f"a.{kind}"
    table = np.column_stack([np.arange(rows), np.ones((rows, 3))]) * 1e-3
    WRITTEN[kind](path, table, rng)
    stream = uc.Stream(path, uc.Recipe(COLUMNS[:2], COLUMNS[2:])) if kind != "npy" else None
    walked = (len(block.states) for block in stream) if stream else (len(block) for block in readers.read_blocks(path))
    if stream and rng.randrange(2):
        sum(walked)
        walked, got = (len(block.states) for block in stream), 0
    else:
        got = next(walked)
    match rng.randrange(3):
        case 0:
            os.truncate(path, rng.randrange(path.stat().st_size))
        case 1:
            WRITTEN[kind](path, table[: rows - rng.randrange(1, 100_000)], rng)
        case 2:
            shutil.copy(path, folder / "other")
            os.truncate(folder / "other", rng.randrange(path.stat().st_size))
            (folder / "other").replace(path)
    got += sum(walked)
    return None if got == rows else f"{kind}: {got} of {rows} rows, without a word"
