"""However the samples arrive, in blocks, from files, in any order, what is learnt is the same."""

import pickle
import sys
import tracemalloc

import h5py
import numpy as np
import pyarrow.parquet
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

import unconstrain as uc
from conftest import POLICIES
from samples import draw
from test_cli import call
from test_newcomer import text
from unconstrain.base.errors import InvalidDataError, MissingExtraError, ReadError, SettingError
from unconstrain.recordings import streams
from unconstrain.recordings.preparation import Recipe
from unconstrain.recordings.readers import blocks, hdf5, parquet, read_blocks
from unconstrain.training import Batch, FirstLook, batches, first_look

DATA = draw(samples=400, groups=7)


def same(one, other, tolerance=1e-9):
    """Whether two policies learnt the same: places, folds, sums and answers."""
    assert_array_equal(one.solution_.determined, other.solution_.determined)
    for mine, theirs in zip(one.training_.gathered.parts, other.training_.gathered.parts, strict=True):
        for a, b in zip(mine.sums, theirs.sums, strict=True):
            assert_allclose(a, b, rtol=1e-11, atol=1e-11 * max(1.0, np.abs(b).max()))
    assert_allclose(one(DATA.states), other(DATA.states), atol=tolerance)


def cut(size, *arrays):
    return [tuple(array[at : at + size] for array in arrays) for at in range(0, len(arrays[0]), size)]


# Batches


@pytest.mark.parametrize("size", [1, 7, 150, 1000])
@pytest.mark.parametrize("kind", POLICIES)
def test_batches_are_the_same_as_all_at_once(kind, size):
    make = POLICIES[kind]
    whole = make(uc.Hybrid()).fit(DATA.states, DATA.actions)
    same(make(uc.Hybrid()).fit_batches(cut(size, DATA.states, DATA.actions)), whole)


@given(size=st.integers(1, 400), seed=st.integers(0, 99))
def test_batches_with_weights_and_groups_are_the_same_too(size, seed):
    weights = np.random.default_rng(seed).integers(0, 3, 400).astype(float)
    weights[::size] = 1.0  # no batch without any
    whole = uc.ParametricPolicy(uc.KMeansRBF(7), uc.Hybrid()).fit(
        DATA.states, DATA.actions, sample_weight=weights, groups=DATA.groups
    )
    batched = cut(size, DATA.states, DATA.actions, weights, DATA.groups)
    same(uc.ParametricPolicy(uc.KMeansRBF(7), uc.Hybrid()).fit_batches(batched), whole)


def test_blocks_within_one_array_are_the_same_too(monkeypatch):
    whole = uc.ParametricPolicy(uc.KMeansRBF(7), uc.Hybrid()).fit(DATA.states, DATA.actions, groups=DATA.groups)
    monkeypatch.setattr(batches, "BLOCK_ROWS", 33)
    blocked = uc.ParametricPolicy(uc.KMeansRBF(7), uc.Hybrid()).fit(DATA.states, DATA.actions, groups=DATA.groups)
    same(blocked, whole)
    assert blocked.score(DATA.states, DATA.actions) == pytest.approx(whole.score(DATA.states, DATA.actions), abs=1e-12)


def test_a_generator_is_walked_once_and_its_first_batch_decides():
    batched = cut(150, DATA.states, DATA.actions)
    one = uc.ParametricPolicy(uc.KMeansRBF(7), uc.Hybrid()).fit_batches(batch for batch in batched)
    other = uc.ParametricPolicy(uc.KMeansRBF(7), uc.Hybrid())
    for states, actions in batched:
        other.partial_fit(states, actions)
    same(one, other)


def test_it_learns_on_after_batches():
    batched = cut(150, DATA.states, DATA.actions)
    one = uc.ParametricPolicy(uc.Affine(), uc.Hybrid()).fit_batches(batched[:2]).partial_fit(*batched[2])
    assert one.moments_.weight[0] == 400


@pytest.mark.parametrize("nothing", [[], iter([])])
def test_no_batch_is_refused(nothing):
    with pytest.raises(InvalidDataError, match="got no sample that counts"):
        uc.ParametricPolicy().fit_batches(nothing)


def test_batches_that_do_not_fit_together_are_refused():
    states, actions = DATA.states[:50], DATA.actions[:50]
    with pytest.raises(InvalidDataError, match="actions: got 1 columns, expected 2 as before"):
        uc.ParametricPolicy().fit_batches([(states, actions), (states, actions[:, :1])])
    with pytest.raises(InvalidDataError, match="features"):
        uc.ParametricPolicy().fit_batches([(states, actions), (states[:, :1], actions)])
    with pytest.raises(InvalidDataError, match="groups: got them for some batches only"):
        uc.ParametricPolicy().fit_batches([(states, actions), (states, actions, None, np.zeros(50))])


def test_bad_numbers_far_into_an_array_are_named(monkeypatch):
    states = DATA.states.copy()
    states[317, 1] = np.nan
    monkeypatch.setattr("unconstrain.base.arrays.BLOCK_ROWS", 50)
    with pytest.raises(InvalidDataError, match=r"states: found nan at row 317, column 1 \(NaN or infinity in 1 places"):
        uc.ParametricPolicy().fit(states, DATA.actions)


# First looks


@pytest.mark.parametrize("at_most", [50, 1000])
@given(cuts=st.lists(st.integers(1, 399), max_size=5), seed=st.integers(0, 9))
def test_first_looks_add_and_order_moves_no_sample(at_most, cuts, seed):
    order = np.random.default_rng(seed).permutation(400)
    parts = np.split(order, sorted(set(cuts)))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(first_look, "PLACING_SAMPLES", at_most)
        whole = FirstLook.at(Batch(DATA.states, DATA.actions))
        total = FirstLook.total(FirstLook.at(Batch(DATA.states[rows], DATA.actions[rows])) for rows in parts)
    assert len(whole.states) == min(at_most, 400)
    assert_array_equal(total.states, whole.states)
    assert_array_equal(total.size, np.abs(DATA.states).max(axis=0))
    assert total.fastest == np.abs(DATA.actions).max()
    assert_allclose(total.mean, DATA.states.mean(axis=0), atol=1e-14)
    assert_allclose(total.scatter, DATA.states.var(axis=0), rtol=1e-12)


def test_what_is_chosen_is_spread_over_all_samples(monkeypatch):
    monkeypatch.setattr(first_look, "PLACING_SAMPLES", 500)
    states = np.arange(10_000.0)[:, None]
    chosen = FirstLook.at(Batch(states, states)).states[:, 0]
    assert_allclose(np.histogram(chosen, 5, (0, 10_000))[0], 100, atol=40)
    assert not np.isin(np.diff(np.sort(chosen)), 20).all()


def test_demonstrations_keep_their_order():
    looks = [
        FirstLook.at(Batch(np.ones((3, 1)), np.ones((3, 1)), None, np.array(list(names)))) for names in ("bab", "cab")
    ]
    assert list(FirstLook.total(looks).groups) == ["b", "a", "c"]


def test_a_block_without_weight_is_passed_over(monkeypatch):
    monkeypatch.setattr(batches, "BLOCK_ROWS", 100)
    weights = np.repeat([1.0, 0.0, 2.0, 0.0], 100)
    counting = weights > 0
    blocked = uc.ParametricPolicy(uc.Affine(), uc.Hybrid()).fit(DATA.states, DATA.actions, sample_weight=weights)
    left_out = uc.ParametricPolicy(uc.Affine(), uc.Hybrid()).fit(
        DATA.states[counting], DATA.actions[counting], sample_weight=weights[counting]
    )
    same(blocked, left_out)


def test_first_looks_at_other_columns_do_not_add():
    one = FirstLook.at(Batch(np.ones((3, 2)), np.ones((3, 2))))
    with pytest.raises(InvalidDataError, match="states: got 1 columns, expected 2 as before"):
        one + FirstLook.at(Batch(np.ones((3, 1)), np.ones((3, 2))))
    with pytest.raises(InvalidDataError, match="actions: got 3 columns, expected 2 as before"):
        one + FirstLook.at(Batch(np.ones((3, 2)), np.ones((3, 3))))


# Memory


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_arrays_mapped_from_files_are_not_copied(tmp_path, dtype):
    rows, rng = 1_000_000, np.random.default_rng(0)
    mapped = []
    for name in ("x", "u"):
        array = np.lib.format.open_memmap(tmp_path / f"{name}.npy", "w+", dtype, (rows, 4))
        array[:] = rng.standard_normal((rows, 4))
        array.flush()
        del array
        mapped.append(np.load(tmp_path / f"{name}.npy", mmap_mode="r"))
    policy = uc.ParametricPolicy(uc.Affine(), uc.Direct())
    policy.fit(*(array[:1000] for array in mapped))
    tracemalloc.start()
    try:
        policy.fit(*mapped)
        policy.score(*mapped)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < 48e6 < 2 * rows * 4 * 8
    assert policy.moments_.weight[0] == rows


# Files


@pytest.fixture
def table():
    """Columns of three demonstrations."""
    times = np.concatenate([np.arange(n) * 0.05 for n in (120, 180, 100)])
    return {
        "t": times,
        "demo": np.repeat(["b", "a", "c"], (120, 180, 100)),
        **{name: DATA.states[:, i] for i, name in enumerate(("x", "y"))},
        **{name: DATA.actions[:, i] for i, name in enumerate(("vx", "vy"))},
    }


def write_parquet(path, table, **options):
    pyarrow.parquet.write_table(pyarrow.table(table), path, **options)
    return path


def write_hdf5(path, table):
    with h5py.File(path, "w") as file:
        for name, values in table.items():
            file[name] = values.astype("S") if values.dtype.kind == "U" else values
    return path


def write_csv(path, table):
    rows = zip(*(values.tolist() for values in table.values()), strict=True)
    path.write_text("\n".join([",".join(table), *(",".join(map(str, row)) for row in rows)]))
    return path


WRITERS = {"parquet": write_parquet, "h5": write_hdf5, "csv": write_csv}


def in_rows(table, rows):
    return {name: values[rows] for name, values in table.items()}


@pytest.mark.parametrize("suffix", WRITERS)
def test_each_format_says_the_same(tmp_path, table, suffix):
    recordings = uc.read(WRITERS[suffix](tmp_path / f"wipes.{suffix}", table))
    assert [recording.name for recording in recordings] == ["b", "a", "c"]
    assert [len(recording) for recording in recordings] == [120, 180, 100]
    for recording, start in zip(recordings, (0, 120, 300), strict=True):
        rows = slice(start, start + len(recording))
        assert_array_equal(recording.select(["x", "y"]), DATA.states[rows])
        assert_array_equal(recording.select(["vx", "vy"]), DATA.actions[rows])
        assert_array_equal(recording.times, table["t"][rows])


@pytest.mark.parametrize("suffix", ["parquet", "h5"])
def test_content_tells_them_without_a_suffix(tmp_path, table, suffix):
    path = WRITERS[suffix](tmp_path / f"wipes.{suffix}", table).rename(tmp_path / "wipes.data")
    assert len(uc.read(path)) == 3


@pytest.mark.filterwarnings("ignore:in-parts")
@pytest.mark.parametrize("suffix", WRITERS)
def test_a_stream_of_files_is_the_same_as_reading_them_all(tmp_path, table, suffix, monkeypatch):
    for number, rows in enumerate((slice(0, 120), slice(120, 400))):
        WRITERS[suffix](tmp_path / f"wipes_{number}.{suffix}", in_rows(table, rows))
    files = sorted(tmp_path.iterdir())
    recipe = Recipe(states=("x", "y"), actions=("vx", "vy"))
    whole = uc.LocallyLinearPolicy(0.5, learner=uc.Hybrid()).fit_demonstrations(
        uc.prepare(uc.read(files), recipe), speed_power=1.0
    )
    monkeypatch.setattr(blocks, "WHOLE_ROWS", 50)
    for module in (streams, parquet, hdf5):
        monkeypatch.setattr(module, "BLOCK_ROWS", 50)
    for held in (0, 2**20):
        monkeypatch.setattr(streams, "HELD_BYTES", held)
        stream = uc.Stream(files, recipe, speed_power=1.0)
        streamed = uc.LocallyLinearPolicy(0.5, learner=uc.Hybrid()).fit_batches(stream)
        assert_allclose(streamed(DATA.states), whole(DATA.states), atol=1e-8)
        assert_array_equal(streamed.solution_.determined, whole.solution_.determined)
        assert len(list(stream)) > 2


def test_a_stream_holds_what_is_small_and_reads_the_rest_again(tmp_path, table, monkeypatch):
    path = write_csv(tmp_path / "wipes.csv", table)
    reads = []
    monkeypatch.setattr(streams, "read_blocks", lambda *a, **k: reads.append(1) or read_blocks(*a, **k))
    recipe = Recipe(states=("x", "y"), actions=("vx", "vy"))
    for held, walks in ((2**20, 1), (0, 3)):
        monkeypatch.setattr(streams, "HELD_BYTES", held)
        reads.clear()
        stream = uc.Stream(path, recipe)
        for _ in range(3):
            assert sum(len(batch.states) for batch in stream) == 400
        assert len(reads) == 1 + walks  # a look at the first block, for the recipe


def test_parts_of_a_stream_say_what_the_stream_says(tmp_path, table):
    for number, rows in enumerate((slice(0, 120), slice(120, 400))):
        write_csv(tmp_path / f"{number}.csv", in_rows(table, rows))
    stream = uc.Stream(sorted(tmp_path.iterdir()), speed_power=2.0)
    [whole] = stream
    parts = [batch for part in stream.parts() for batch in pickle.loads(pickle.dumps(part))]
    for mine, theirs in zip(whole, map(np.concatenate, zip(*(part[:4] for part in parts), strict=True)), strict=False):
        assert_array_equal(mine, theirs)


@pytest.mark.filterwarnings("ignore:at-rest", "ignore:in-parts")
def test_a_recipe_that_needs_neighbours_keeps_recordings_whole(tmp_path, table, monkeypatch):
    path = write_parquet(tmp_path / "wipes.parquet", table)
    monkeypatch.setattr(parquet, "BLOCK_ROWS", 50)
    whole = uc.Stream(path, Recipe(states=("x", "y"), actions=("vx", "vy")))
    assert [len(demo) for _, demo in whole.named_demonstrations()] == [120, 180, 100]
    monkeypatch.setattr(blocks, "WHOLE_ROWS", 50)
    by_rows = uc.Stream(path, Recipe(states=("x", "y"), actions=("vx", "vy")))
    smoothed = uc.Stream(path, Recipe(states=("x", "y"), differentiate="savgol"))
    assert max(len(demo) for _, demo in by_rows.named_demonstrations()) == 50
    assert [len(demo) for _, demo in smoothed.named_demonstrations()] == [120, 180, 100]
    assert len({name for name, _ in by_rows.named_demonstrations()}) == 3


@pytest.fixture
def rested(tmp_path, monkeypatch):
    """Three demonstrations that stand still for 60 of 200 rows before they start, in a text of several blocks each."""
    monkeypatch.setattr("unconstrain.recordings.readers.lines.BLOCK_BYTES", 2000)
    monkeypatch.setattr("unconstrain.recordings.readers.lines.HEAD_BYTES", 2000)
    clock, rng = np.arange(200) * 0.02, np.random.default_rng(0)
    for number in range(3):
        angle = np.maximum(clock - 60 * 0.02, 0.0)
        place = np.column_stack([np.cos(angle), np.sin(angle)]) * (number + 1)
        place += 1e-4 * rng.standard_normal(place.shape)
        columns = zip(("t", "x", "y", "vx", "vy"), (clock, *place.T, *np.gradient(place, 0.02, axis=0).T), strict=True)
        write_csv(tmp_path / f"arc{number}.csv", dict(columns))
    return sorted(tmp_path.glob("arc*.csv"))


def test_a_text_of_several_blocks_is_one_demonstration_with_its_rest(rested):
    said = text(call("fit", *rested, "--model", "affine", "--learner", "direct", "-o", rested[0].with_name("p.npz")))
    assert "'arc0': stands still for 61 of 200 rows (1.22 s) before it starts, left out" in said
    assert "3 demonstrations, 417 samples" in said
    assert "at its end" not in said
    assert "in-parts" not in said


@pytest.mark.filterwarnings("ignore:at-rest")
def test_a_demonstration_too_long_to_hold_is_one_whose_parts_keep_their_rest(rested, monkeypatch):
    monkeypatch.setattr(blocks, "WHOLE_ROWS", 90)
    stream = uc.Stream(rested)
    with pytest.warns(uc.preparation.PreparationWarning) as said:
        parts = [(name, len(demo)) for name, demo in stream.named_demonstrations()]
    told = [one.message.remark.code for one in said]
    assert told.count("in-parts") >= 3
    assert told.count("rest") == 3  # where each begins
    assert len({name for name, _ in parts}) == 3 < len(parts)
    assert 400 < sum(rows for _, rows in parts) < 600
    assert [demo.name for demo in stream.beginning()] == ["arc0", "arc1", "arc2"]


def test_a_folder_stands_for_the_parquet_files_in_it(tmp_path, table):
    (tmp_path / "set" / "day=1").mkdir(parents=True)
    write_parquet(tmp_path / "set" / "b.parquet", in_rows(table, slice(120, 300)))
    write_parquet(tmp_path / "set" / "day=1" / "a.parquet", in_rows(table, slice(0, 120)))
    assert [recording.name for recording in uc.read(tmp_path / "set")] == ["a", "b"]
    (tmp_path / "empty").mkdir()
    with pytest.raises(ReadError, match="a folder without a file to read"):
        uc.read(tmp_path / "empty")


# Parquet


def test_lists_become_numbered_columns(tmp_path):
    columns = {"state": DATA.states.tolist(), "action": DATA.actions.tolist(), "episode_index": DATA.groups}
    recordings = uc.read(write_parquet(tmp_path / "a.parquet", columns))
    assert recordings[0].columns == ("state1", "state2", "action1", "action2")
    assert [recording.name for recording in recordings] == [str(number) for number in range(7)]
    assert_array_equal(recordings[2].values[:, :2], DATA.states[DATA.groups == 2])


def test_kinds_of_numbers_in_parquet(tmp_path):
    stamps = np.array(["2024-01-01T00:00:00.0", "2024-01-01T00:00:00.5"], "datetime64[us]")
    columns = {"timestamp": stamps, "x": [1, None], "on": [True, False], "said": ["a", "b"], "v": np.float32([0.5, 1])}
    [recording] = uc.read(write_parquet(tmp_path / "a.parquet", columns))
    assert recording.columns == ("x", "on", "v")
    assert_array_equal(recording.values, [[1, 1, 0.5], [np.nan, 0, 1]])
    assert_array_equal(recording.times, [0.0, 0.5])


@pytest.mark.parametrize(
    ("columns", "sentence"),
    [
        ({"said": ["a", "b"]}, "no column of numbers; it has said"),
        ({"x": [[1.0], [1.0, 2.0]]}, "column 'x': its lists are of different lengths"),
        ({"x": np.empty(0)}, "no rows, expected at least one"),
    ],
)
def test_what_parquet_cannot_say_is_refused(tmp_path, columns, sentence):
    with pytest.raises(ReadError, match=sentence):
        uc.read(write_parquet(tmp_path / "a.parquet", columns))


# HDF5


def test_groups_of_hdf5_are_recordings(tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        for number in (0, 1):
            group = file.create_group(f"data/demo_{number}")
            group["states"], group["actions"] = DATA.states[DATA.groups == number], DATA.actions[DATA.groups == number]
            group["times"] = np.arange((DATA.groups == number).sum()) * 0.1
            group["notes"] = "free text"
    recordings = uc.read(tmp_path / "a.h5")
    assert [recording.name for recording in recordings] == ["data/demo_0", "data/demo_1"]
    assert recordings[0].columns == ("u1", "u2", "x1", "x2")
    assert_array_equal(recordings[1].select(["x1", "x2"]), DATA.states[DATA.groups == 1])
    assert_allclose(np.diff(recordings[1].times), 0.1)


def test_roles_in_hdf5_may_be_told(tmp_path, table):
    path = write_hdf5(tmp_path / "a.h5", {"clock": table["t"], "who": table["demo"], "x": table["x"]})
    assert [recording.name for recording in uc.read(path, group="who", time="clock")] == ["b", "a", "c"]
    with pytest.raises(ReadError, match="no column 'whom' for group; it has clock, x, who"):
        uc.read(path, group="whom")


@pytest.mark.parametrize(
    ("sets", "sentence"),
    [
        (
            {"x": np.zeros(3), "y": np.zeros(4)},
            r"no arrays of numbers with one length in common; it holds x \(3,\), y \(4,\)\.",
        ),
        ({"x": np.zeros((2, 2, 2, 2))}, "no arrays of numbers"),
        ({"t": np.zeros(3)}, "no column of numbers; it has t"),
    ],
)
def test_what_hdf5_cannot_say_is_refused(tmp_path, sets, sentence):
    with pytest.raises(ReadError, match=sentence):
        uc.read(write_hdf5(tmp_path / "a.h5", sets))


@pytest.mark.parametrize(("suffix", "content"), [("parquet", b"PAR1 or not"), ("h5", b"\x89HDF or not")])
def test_damaged_files_are_said(tmp_path, suffix, content):
    path = tmp_path / f"a.{suffix}"
    path.write_bytes(content * 20)
    with pytest.raises(ReadError, match=rf"a\.{suffix}: cannot be read"):
        uc.read(path)


def test_missing_extras_are_said(tmp_path, monkeypatch):
    path = tmp_path / "a.parquet"
    path.write_bytes(b"PAR1")
    for name in [name for name in sys.modules if name.partition(".")[0] == "pyarrow"]:
        monkeypatch.setitem(sys.modules, name, None)
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(MissingExtraError, match=r"unconstrain\[data\]"):
        uc.read(path)


def test_a_stream_of_nothing_is_refused():
    with pytest.raises(SettingError, match="got no file to read"):
        uc.Stream([])


def test_what_a_walk_looks_at_grows_with_the_demonstrations_and_not_with_their_square(tmp_path, monkeypatch):
    looked = []

    class Counted(uc.Demonstration):
        def __len__(self):
            looked.append(1)
            return super().__len__()

    path = tmp_path / "one.csv"
    path.write_text("x,y,vx,vy\n1,2,3,4\n")
    many = [(f"0/{i}", Counted(np.ones((3, 2)), np.ones((3, 2)))) for i in range(300)]
    looked.clear()
    stream = uc.Stream(path)
    monkeypatch.setattr(stream, "named_demonstrations", lambda: iter(many))
    assert sum(len(batch.states) for batch in stream) == 900
    assert len(looked) <= 4 * len(many)


def test_a_file_that_lacks_a_column_of_the_first_is_refused_as_by_prepare(tmp_path):
    t = np.linspace(0, 1, 50)
    for name, head in (("a", "t,x,y"), ("b", "t,x,z")):
        np.savetxt(tmp_path / f"{name}.csv", np.column_stack([t, t, 1 - t]), "%.17g", ",", header=head, comments="")
    stream = uc.Stream(sorted(tmp_path.glob("*.csv")), uc.Recipe(states=("x", "y"), differentiate="savgol"))
    with pytest.raises(uc.errors.InvalidDataError, match=r"'b' has no column 'y'; it has x, z\."):
        list(stream)


@pytest.mark.parametrize("learner", [uc.Hybrid(), uc.Likelihood(), uc.Robust()])
def test_batches_at_rest_say_nothing_of_the_size_of_later_actions(learner):
    # Without actions there is no unit of theirs. In powers of two, all that is learnt is the same to the last bit.
    rng = np.random.default_rng(3)
    states, groups = rng.normal(size=(60, 2)), np.arange(60) // 10
    actions = states @ np.array([[-1.0, 2.0], [-2.0, -1.0]]) * (groups > 1)[:, None]

    def learnt(size):
        policy = uc.LocallyLinearPolicy(learner=learner).fit(states[:10], actions[:10], groups=groups[:10])
        for start in (10, 20, 40):
            part = slice(start, start + (10 if start == 10 else 20))
            policy.partial_fit(states[part], size * actions[part], groups=groups[part])
        return policy.predict(states) / size

    small = learnt(1.0)
    assert np.isfinite(small).all()
    assert np.abs(small).max() > 1.0
    for size in (2.0**-200, 2.0**40, 2.0**90):
        np.testing.assert_array_equal(learnt(size), small)


def test_later_actions_may_be_of_another_size_altogether_and_some_of_them_none():
    rng = np.random.default_rng(5)
    states, groups = rng.normal(size=(60, 1)), np.arange(60) // 10
    actions = np.column_stack([states, -0.5 * states])
    actions[30::2] = 0.0
    policy = uc.ParametricPolicy(uc.Affine(), uc.Likelihood()).fit(
        states[:20], 1e-20 * actions[:20], groups=groups[:20]
    )
    policy.partial_fit(states[20:], actions[20:], groups=groups[20:])
    assert np.isfinite(policy.predict(states)).all()
