"""A policy survives its file; nothing else in a file survives the door."""

import io
import json
import os
import pickle
import signal
import stat
import subprocess
import sys
import zipfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_array_equal
from sklearn.base import clone

import unconstrain as uc
from samples import draw
from unconstrain import storage
from unconstrain.base.errors import ModelFileError

VALIDATIONS = {
    "default": None,
    "folds_of_samples": uc.Folds(3, by="sample", seed=5),
    "folds_of_demonstrations": uc.Folds(3, by="demonstration"),
    "held_out": uc.HeldOut(0.3),
}
STATES = draw(seed=9, samples=40).states


@pytest.fixture(params=VALIDATIONS.values(), ids=VALIDATIONS)
def validation(request):
    return request.param


@pytest.fixture
def small():
    """A fitted policy of few numbers."""
    data = draw(samples=30)
    return uc.ParametricPolicy(uc.Affine(), uc.Hybrid()).fit(data.states, data.actions, groups=data.groups)


@pytest.fixture(scope="module")
def whole_file(tmp_path_factory):
    """The bytes of a policy file, and what the policy in it says."""
    data = draw(samples=30)
    policy = uc.ParametricPolicy(uc.Affine(), uc.Hybrid(), uc.Folds(2)).fit(data.states, data.actions)
    path = tmp_path_factory.mktemp("whole") / "policy.npz"
    uc.save(policy, path)
    return path.read_bytes(), policy.predict(STATES)


def saved(policy, folder, **options):
    """The same policy after a way through a file."""
    storage.save(policy, folder / "policy.npz", **options)
    return storage.load(folder / "policy.npz")


def assert_equal_policies(actual, expected):
    assert type(actual) is type(expected)
    assert_array_equal(actual.predict(STATES), expected.predict(STATES))
    assert_array_equal(actual.support(STATES), expected.support(STATES)) if hasattr(expected, "fields_") else None
    assert actual.n_features_in_ == expected.n_features_in_
    for part in ("weights", "determined", "threshold", "eigenvalues", "scores"):
        mine, theirs = getattr(actual.solution_, part), getattr(expected.solution_, part)
        assert (mine is None) == (theirs is None)
        if mine is not None:
            assert_array_equal(mine, theirs)
    for mine, theirs in zip(actual.moments_.sums, expected.moments_.sums, strict=True):
        assert_array_equal(mine, theirs)


# Round trips


def test_a_policy_comes_back_as_it_was(policy, validation, data, tmp_path):
    policy.set_params(validation=validation).fit(data.states, data.actions, groups=data.groups)
    loaded = saved(policy, tmp_path)
    assert_equal_policies(loaded, policy)
    assert loaded.learner == policy.learner
    assert loaded.validation == policy.validation


def test_a_loaded_policy_learns_on_as_the_original_would(policy, validation, data, tmp_path):
    half, rest = slice(60), slice(60, None)
    groups = np.array([f"demo {group}" for group in data.groups])
    policy.set_params(validation=validation).fit(data.states[half], data.actions[half], groups=groups[half])
    loaded = saved(policy, tmp_path)
    for one in (policy, loaded):
        one.partial_fit(data.states[rest], data.actions[rest], groups=groups[rest])
    assert_equal_policies(loaded, policy)


def test_a_loaded_policy_takes_another_learner(policy_of, learner, data, tmp_path):
    policy = policy_of(uc.Direct()).fit(data.states, data.actions, groups=data.groups)
    assert_equal_policies(saved(policy, tmp_path).with_learner(learner), policy.with_learner(learner))


@pytest.mark.parametrize(
    "names",
    [
        np.arange(6) - 3,
        np.array([0.5, 1.5, 2.5, 3.5, 4.5, 5.5]),
        np.array(list("abcdef")),
        np.array(["wipe 1", "Wischen ü", "拭く", "", "a", "b"]),
        np.array(["x", "y", "z", "u", "v", "w"], dtype=object),
        np.array([True, False, True, False, True, False]),
    ],
    ids=["integers", "floats", "letters", "unicode", "objects", "booleans"],
)
def test_demonstrations_keep_their_folds_whatever_they_are_called(names, data, tmp_path):
    groups = names[data.groups]
    policy = uc.ParametricPolicy(uc.Affine(), uc.Hybrid(), validation=uc.Folds(3, by="demonstration"))
    policy.fit(data.states, data.actions, groups=groups)
    loaded = saved(policy, tmp_path)
    for one in (policy, loaded):  # the same demonstrations again, in another order
        one.partial_fit(data.states, data.actions[::-1], groups=groups[::-1])
    assert_equal_policies(loaded, policy)


def test_a_policy_of_one_action_stays_flat(data, tmp_path):
    policy = uc.ParametricPolicy(uc.Affine(), uc.Hybrid()).fit(data.states, data.actions[:, 0])
    loaded = saved(policy, tmp_path)
    assert loaded.predict(STATES).shape == (40,)
    assert_array_equal(loaded.predict(STATES), policy.predict(STATES))


def test_centres_of_ones_own_come_back(data, tmp_path):
    policy = uc.LocallyLinearPolicy(variance=0.5, centres=[[0.0, 0.0], [0.5, 0.5]]).fit(data.states, data.actions)
    loaded = saved(policy, tmp_path)
    assert_equal_policies(loaded, policy)
    assert_array_equal(clone(loaded).fit(data.states, data.actions).predict(STATES), policy.predict(STATES))


def test_a_policy_that_has_learnt_nothing_can_be_stored(tmp_path):
    loaded = saved(uc.LocallyLinearPolicy(variance=2.0, learner=uc.Hybrid(alpha=0.5)), tmp_path)
    assert loaded.get_params()["variance"] == 2.0
    assert loaded.learner == uc.Hybrid(alpha=0.5)
    assert not hasattr(loaded, "solution_")


def test_names_of_columns_come_back(data, tmp_path):
    table = pd.DataFrame(data.states, columns=["x", "y"])
    policy = uc.ParametricPolicy(uc.Affine(), uc.Hybrid()).fit(table, data.actions)
    loaded = saved(policy, tmp_path)
    assert list(loaded.feature_names_in_) == ["x", "y"]
    assert_array_equal(loaded.predict(table), policy.predict(table))


def test_notes_come_back(small, tmp_path):
    notes = {"recipe": {"rate": 20.0, "states": ["x", "y"]}, "by": "Zoë", "count": 3, "none": None}
    uc.save(small, tmp_path / "p.npz", notes)
    assert storage.load_notes(tmp_path / "p.npz") == notes


def test_notes_come_back_as_json_has_them(small, tmp_path):
    uc.save(small, tmp_path / "p.npz", {2: "b", 10: ("c", "d")})
    assert storage.load_notes(tmp_path / "p.npz") == {"2": "b", "10": ["c", "d"]}


def test_without_notes_there_are_none(small, tmp_path):
    uc.save(small, str(tmp_path / "p.npz"))
    assert storage.load_notes(str(tmp_path / "p.npz")) == {}


@pytest.mark.parametrize("notes", [{"a": {1, 2}}, {("a", "b"): 1}, {"a": object()}], ids=["set", "tuple key", "object"])
def test_notes_that_json_cannot_say_are_refused(small, tmp_path, notes):
    with pytest.raises(ModelFileError, match=r"^notes: .*; expected what JSON can say: text, numbers, lists, mappings"):
        uc.save(small, tmp_path / "p.npz", notes)
    assert not list(tmp_path.iterdir())


# Damage


def opened(content, folder):
    """What comes out of a file of these bytes: a policy, or the error."""
    path = Path(folder) / "damaged.npz"
    path.write_bytes(content)
    try:
        return storage.load(path)
    except ModelFileError as error:
        refusal = error
    assert str(refusal).startswith(f"{path}: ")
    assert "\n" not in str(refusal)
    return refusal


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("damaged")


@settings(max_examples=100)
@given(st.data())
def test_a_truncated_file_is_refused(whole_file, folder, data):
    content, _ = whole_file
    kept = data.draw(st.integers(0, len(content) - 1))
    assert isinstance(opened(content[:kept], folder), ModelFileError)


@settings(max_examples=250)
@given(st.data())
def test_one_changed_byte_is_refused_or_does_not_matter(whole_file, folder, data):
    content, expected = whole_file
    at = data.draw(st.integers(0, len(content) - 1))
    changed = bytearray(content)
    changed[at] ^= data.draw(st.integers(1, 255))
    found = opened(bytes(changed), folder)
    # Dates and padding of the zip carry nothing.
    assert isinstance(found, ModelFileError) or np.array_equal(found.predict(STATES), expected)


@settings(max_examples=100)
@given(st.binary(max_size=300), st.sampled_from([b"", b"PK\x03\x04", b"PK\x05\x06", b"\x93NUMPY", b"\x80\x04"]))
def test_random_bytes_are_refused(folder, content, magic):
    assert isinstance(opened(magic + content, folder), ModelFileError)


@settings(max_examples=100)
@given(st.data())
def test_random_bytes_in_the_middle_are_refused(whole_file, folder, data):
    content, expected = whole_file
    at = data.draw(st.integers(0, len(content)))
    put = data.draw(st.binary(min_size=1, max_size=40))
    found = opened(content[:at] + put + content[at + len(put) :], folder)
    assert isinstance(found, ModelFileError) or np.array_equal(found.predict(STATES), expected)


# Tampering


def contents(path):
    """Header and arrays of a policy file, by numpy alone."""
    with np.load(path, allow_pickle=False) as file:
        arrays = dict(file)
    return json.loads(str(arrays.pop("header"))), arrays


def written(path, header, arrays, digest=None):
    """A file with this header and these arrays, whoever wrote them."""
    if digest is not None:
        header = {name: value for name, value in header.items() if name != "digest"}
        header["digest"] = digest(header, arrays)
    np.savez_compressed(path, header=np.array(json.dumps(header)), **arrays)
    return path


@pytest.fixture
def parts(small, tmp_path):
    uc.save(small, tmp_path / "p.npz")
    return contents(tmp_path / "p.npz")


def test_a_changed_number_is_seen(parts, tmp_path):
    header, arrays = parts
    name = next(name for name, array in arrays.items() if array.dtype == np.float64 and array.size)
    arrays[name].flat[0] += 1e-15 + abs(arrays[name].flat[0]) * 1e-15
    with pytest.raises(ModelFileError, match=r"is damaged: its content does not match its digest\. Save the policy"):
        uc.load(written(tmp_path / "t.npz", header, arrays))


def test_a_changed_setting_is_seen(parts, tmp_path):
    header, arrays = parts
    header["content"]["policy"]["parts"]["n_outputs_"] = 3
    with pytest.raises(ModelFileError, match="does not match its digest"):
        uc.load(written(tmp_path / "t.npz", header, arrays))


def test_changed_notes_are_seen(parts, tmp_path):
    header, arrays = parts
    header["content"]["notes"] = {"group": "other"}
    with pytest.raises(ModelFileError, match="does not match its digest"):
        storage.load_notes(written(tmp_path / "t.npz", header, arrays))


def test_a_missing_digest_is_seen(parts, tmp_path):
    header, arrays = parts
    del header["digest"]
    with pytest.raises(ModelFileError, match="does not match its digest"):
        uc.load(written(tmp_path / "t.npz", header, arrays))


def test_a_newer_version_asks_for_an_upgrade(parts, tmp_path):
    header, arrays = parts
    path = written(tmp_path / "t.npz", {"format": header["format"], "version": storage.VERSION + 1, "new": 1}, arrays)
    with pytest.raises(ModelFileError) as caught:
        uc.load(path)
    assert str(caught.value) == (
        f"{path}: is of format version {storage.VERSION + 1}, and this release reads up to {storage.VERSION}. "
        "Upgrade unconstrain."
    )


@pytest.mark.parametrize("name", ["Popen", "system", "object", "Policy", "LocallyLinear"])
def test_a_class_that_is_not_known_is_refused_by_name(parts, tmp_path, name):
    header, arrays = parts
    header["content"]["policy"] = {"class": name, "parts": {"args": "true"}}
    path = written(tmp_path / "t.npz", header, arrays, storage._digest)
    with pytest.raises(ModelFileError) as caught:
        uc.load(path)
    assert str(caught.value) == (
        f"{path}: holds the class {name}, which is not known here. Import the module that defines it and pass it to "
        "storage.register before loading."
    )


@pytest.mark.parametrize(
    ("policy", "sentence"),
    [
        ({"class": "Direct", "parts": {}}, r": holds a Direct, expected a policy\.$"),
        (None, r": holds a NoneType, expected a policy\.$"),
        ([1, 2], r": holds a list, expected a policy\.$"),
        ({"class": "Hybrid", "parts": {"alpha": -1.0}}, r"is not complete \(SettingError: alpha: got -1\.0"),
        ({"class": "Hybrid", "parts": {"none": 1}}, r"is not complete \(TypeError"),
        ({"class": "Solution", "parts": {}}, r"is not complete \(TypeError"),
        ({"class": ["Hybrid"], "parts": {}}, r"is not complete \(TypeError"),
        ({"class": "Hybrid"}, r"is not complete \(KeyError"),
        ({"class": "Solution", "parts": {"method": {"array": "array0"}}}, r"method of a Solution should be text"),
        ({"array": "array999"}, r"is not complete \(KeyError"),
        ({"range": [0, 1, 0]}, r"is not complete \(ValueError"),
        ({}, r"is not complete \(KeyError"),
    ],
)
def test_a_file_whose_digest_was_mended_must_still_hold_a_policy(parts, tmp_path, policy, sentence):
    header, arrays = parts
    header["content"]["policy"] = policy
    with pytest.raises(ModelFileError, match=sentence):
        uc.load(written(tmp_path / "t.npz", header, arrays, storage._digest))


def test_a_file_without_content_is_not_complete(parts, tmp_path):
    header, arrays = parts
    del header["content"]
    path = written(tmp_path / "t.npz", header, arrays, storage._digest)
    with pytest.raises(ModelFileError, match="the policy in it is not complete"):
        uc.load(path)
    with pytest.raises(ModelFileError, match="the notes in it are not complete"):
        storage.load_notes(path)


def test_a_header_nested_without_end_is_refused(tmp_path):
    np.savez(tmp_path / "t.npz", header=np.array("[" * 200_000))
    with pytest.raises(ModelFileError, match="was not written by unconstrain"):
        uc.load(tmp_path / "t.npz")


json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.sampled_from(["array0", "Hybrid", "Affine", ""]),
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.dictionaries(st.sampled_from(["class", "parts", "array", "list", "range", "pairs", "alpha"]), inner)
    ),
    max_leaves=12,
)


@settings(max_examples=100)
@given(json_values)
def test_whatever_a_header_says_there_is_one_clear_error(folder, content):
    header = {"format": "unconstrain-policy", "version": 1, "content": {"policy": content, "notes": content}}
    path = written(folder / "fuzz.npz", header, {"array0": np.zeros(3)}, storage._digest)
    with pytest.raises(ModelFileError, match=r"expected a policy|is not complete|which is not known here"):
        storage.load(path)


# Not ours


def test_a_plain_archive_was_not_written_by_us(tmp_path):
    np.savez(tmp_path / "plain.npz", states=np.zeros((3, 2)), actions=np.zeros((3, 2)))
    with pytest.raises(ModelFileError) as caught:
        uc.load(tmp_path / "plain.npz")
    assert str(caught.value) == (
        f"{tmp_path / 'plain.npz'}: was not written by unconstrain. Expected a file that 'unconstrain fit' or save() "
        "wrote."
    )


@pytest.mark.parametrize(
    "header", ["{}", "[]", "3", "no json", '{"format": "other", "version": 1}', '{"format": "unconstrain-policy"}']
)
def test_another_header_was_not_written_by_us(tmp_path, header):
    np.savez(tmp_path / "other.npz", header=np.array(header))
    with pytest.raises(
        ModelFileError, match=r"was not written by unconstrain\. Expected a file that 'unconstrain fit'"
    ):
        uc.load(tmp_path / "other.npz")


@pytest.mark.parametrize("version", ["null", '"two"', "[1]", "Infinity", "NaN"])
def test_a_version_that_is_no_number_was_not_written_by_us(tmp_path, version):
    header = f'{{"format": "unconstrain-policy", "version": {version}}}'
    np.savez(tmp_path / "other.npz", header=np.array(header))
    with pytest.raises(ModelFileError, match="was not written by unconstrain"):
        uc.load(tmp_path / "other.npz")


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(ModelFileError) as caught:
        uc.load(tmp_path / "none.npz")
    assert str(caught.value) == f"{tmp_path / 'none.npz'}: no such file, expected a policy file."


def test_a_folder_is_no_policy_file(tmp_path):
    with pytest.raises(ModelFileError) as caught:
        uc.load(tmp_path)
    assert str(caught.value) == f"{tmp_path}: a folder, expected a policy file."


class Trap:
    """Leaves a mark where it is unpickled."""

    def __init__(self, mark):
        self.mark = str(mark)

    def __reduce__(self):
        return os.mkdir, (self.mark,)


def trapped(mark):
    array = np.empty(1, dtype=object)
    array[0] = Trap(mark)
    return array


def pickle_of_ours(path, mark, parts):
    path.write_bytes(pickle.dumps(Trap(mark)))


def array_with_a_pickle(path, mark, parts):
    with path.open("wb") as stream:
        np.save(stream, trapped(mark), allow_pickle=True)


def archive_with_a_pickled_header(path, mark, parts):
    np.savez(path, header=trapped(mark))


def our_file_with_a_pickled_array(path, mark, parts):
    header, arrays = parts
    np.savez(path, header=np.array(json.dumps(header)), **(arrays | {"array0": trapped(mark)}))


def our_file_with_a_pickle_beside(path, mark, parts):
    header, arrays = parts
    written(path, header, arrays)
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr("extra.npy", pickle.dumps(Trap(mark)))


@pytest.mark.parametrize(
    "craft",
    [
        pickle_of_ours,
        array_with_a_pickle,
        archive_with_a_pickled_header,
        our_file_with_a_pickled_array,
        our_file_with_a_pickle_beside,
    ],
)
def test_no_pickle_is_ever_run(craft, parts, tmp_path):
    mark, path = tmp_path / "run", tmp_path / "trap.npz"
    craft(path, mark, parts)
    for opener in (uc.load, storage.load_notes):
        with pytest.raises(ModelFileError):
            opener(path)
    assert not mark.exists()


def test_the_trap_does_work_where_pickles_are_allowed(tmp_path):
    mark = tmp_path / "run"
    archive_with_a_pickled_header(tmp_path / "trap.npz", mark, None)
    np.load(tmp_path / "trap.npz", allow_pickle=True)["header"]
    assert mark.exists()


# Writing


def test_the_old_file_is_replaced_and_nothing_else_is_left(small, data, tmp_path):
    other = uc.LocallyLinearPolicy(variance=0.5).fit(data.states, data.actions)
    uc.save(small, tmp_path / "p.npz")
    uc.save(other, tmp_path / "p.npz")
    assert_equal_policies(uc.load(tmp_path / "p.npz"), other)
    assert [path.name for path in tmp_path.iterdir()] == ["p.npz"]


def test_the_name_is_kept_as_given(small, tmp_path):
    uc.save(small, tmp_path / "policy.model")
    assert [path.name for path in tmp_path.iterdir()] == ["policy.model"]
    assert_equal_policies(uc.load(tmp_path / "policy.model"), small)


def test_a_bare_name_is_in_the_working_folder(small, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    uc.save(small, "p.npz")
    assert_equal_policies(uc.load("p.npz"), small)


def test_a_folder_that_does_not_exist_is_named(small, tmp_path):
    path = tmp_path / "none" / "p.npz"
    with pytest.raises(ModelFileError) as caught:
        uc.save(small, path)
    assert str(caught.value) == f"{path}: cannot be written (No such file or directory)."


def test_a_folder_cannot_be_replaced_by_a_policy(small, tmp_path):
    with pytest.raises(ModelFileError, match=r"cannot be written \(it is a folder or a device, expected a file\)\."):
        uc.save(small, tmp_path)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no named pipes")
def test_a_device_is_not_replaced_by_a_policy(small, tmp_path):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(ModelFileError, match="it is a folder or a device"):
        uc.save(small, tmp_path / "pipe")
    assert stat.S_ISFIFO((tmp_path / "pipe").stat().st_mode)


@pytest.mark.skipif(os.name != "posix" or os.getuid() == 0, reason="root may write anywhere")
def test_a_folder_that_may_not_be_written_to_is_named(small, tmp_path):
    tmp_path.chmod(0o500)
    try:
        with pytest.raises(ModelFileError, match=r"p\.npz: cannot be written \(Permission denied\)\."):
            uc.save(small, tmp_path / "p.npz")
    finally:
        tmp_path.chmod(0o700)


def full_disk(*_, **__):
    raise OSError(28, "No space left on device")


def half_an_archive(stream, **_):
    stream.write(b"PK\x03\x04 half")
    full_disk()


def interrupted(*_, **__):
    raise KeyboardInterrupt


@pytest.mark.parametrize(
    ("module", "name", "failure"),
    [
        (np, "savez_compressed", half_an_archive),
        (os, "fsync", full_disk),
        (os, "chmod", full_disk),
        (Path, "replace", full_disk),
        (os, "fsync", interrupted),
        (Path, "replace", interrupted),
    ],
)
def test_a_failed_save_leaves_the_old_file_and_no_other(small, data, tmp_path, monkeypatch, module, name, failure):
    uc.save(small, tmp_path / "p.npz")
    before = (tmp_path / "p.npz").read_bytes()
    other = clone(small).fit(data.states, 2 * data.actions)
    with monkeypatch.context() as patch:
        patch.setattr(module, name, failure)
        with pytest.raises((ModelFileError, KeyboardInterrupt)) as caught:
            uc.save(other, tmp_path / "p.npz")
    if failure is not interrupted:
        assert str(caught.value) == f"{tmp_path / 'p.npz'}: cannot be written (No space left on device)."
    assert [path.name for path in tmp_path.iterdir()] == ["p.npz"]
    assert (tmp_path / "p.npz").read_bytes() == before


KILLED = """
import os, sys, time
import numpy as np
import unconstrain as uc

def stop(*_, **__):
    print("writing", flush=True)
    time.sleep(60)

def half(stream, **arrays):
    whole(stream, **arrays)
    stream.truncate(stream.tell() // 2)
    stream.flush()
    stop()

whole, where = np.savez_compressed, sys.argv[2]
if where == "half": np.savez_compressed = half
if where == "fsync": os.fsync = stop
states = np.random.default_rng(1).uniform(-1, 1, (50, 2))
uc.save(uc.ParametricPolicy(uc.Affine(), uc.Hybrid()).fit(states, 3 * states), sys.argv[1])
"""


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="this system has no SIGKILL")
@pytest.mark.parametrize("where", ["half", "fsync"])
def test_a_kill_during_save_leaves_the_old_file(small, tmp_path, where):
    path = tmp_path / "p.npz"
    uc.save(small, path)
    child = subprocess.Popen([sys.executable, "-c", KILLED, path, where], stdout=subprocess.PIPE, env=environment())
    with child:
        assert child.stdout.readline() == b"writing\n"
        child.kill()
    assert child.returncode == -signal.SIGKILL
    assert_equal_policies(uc.load(path), small)
    uc.save(small, path)  # what the killed one left behind is in nobody's way
    assert_equal_policies(uc.load(path), small)


def environment():
    """The package under test, for a process of its own."""
    return os.environ | {"PYTHONPATH": str(Path(uc.__file__).parents[1]), "OPENBLAS_NUM_THREADS": "1"}


@pytest.mark.skipif(os.name != "posix", reason="permissions as on POSIX")
@pytest.mark.parametrize(("mask", "mode"), [(0o022, 0o644), (0o077, 0o600), (0o002, 0o664)])
def test_permissions_are_those_of_any_new_file(small, tmp_path, mask, mode):
    before = os.umask(mask)
    try:
        uc.save(small, tmp_path / "p.npz")
        now = os.umask(mask)
    finally:
        os.umask(before)
    assert stat.S_IMODE((tmp_path / "p.npz").stat().st_mode) == mode
    assert now == mask


# A feature map of the user's own


@dataclass(frozen=True)
class Powers:
    """Powers of each coordinate."""

    degree: int

    def __call__(self, states):
        return np.hstack([states**power for power in range(self.degree + 1)])


@pytest.fixture
def powers(data):
    return uc.ParametricPolicy(Powers(2)).fit(data.states, data.actions)


def test_an_unknown_feature_map_is_refused_with_what_to_do(powers, tmp_path):
    with pytest.raises(ModelFileError) as caught:
        uc.save(powers, tmp_path / "p.npz")
    said = str(caught.value)
    assert said.startswith(
        "cannot store a Powers: only classes that are known by name can be read back without running"
    )
    assert "Known are Affine, " in said
    assert said.endswith("add a dataclass of your own with storage.register.")
    assert not list(tmp_path.iterdir())


def test_a_registered_feature_map_is_accepted(powers, tmp_path, monkeypatch):
    monkeypatch.setattr(storage, "_KNOWN", dict(storage._KNOWN))
    assert storage.register(Powers) is Powers
    assert storage.register(Powers) is Powers  # twice does no harm
    loaded = saved(powers, tmp_path)
    assert loaded.features == Powers(2)
    assert_equal_policies(loaded, powers)


def test_a_feature_map_has_to_be_registered_before_loading_too(powers, tmp_path, monkeypatch):
    with monkeypatch.context() as patch:
        patch.setattr(storage, "_KNOWN", storage._KNOWN | {"Powers": Powers})
        uc.save(powers, tmp_path / "p.npz")
    with pytest.raises(
        ModelFileError, match=r"holds the class Powers, which is not known here\. Import the module that"
    ):
        uc.load(tmp_path / "p.npz")


def test_a_bare_function_cannot_be_stored(data, tmp_path):
    policy = uc.ParametricPolicy(lambda states: states).fit(data.states, data.actions)
    with pytest.raises(ModelFileError, match=r"^cannot store a function: only classes that are known by name"):
        uc.save(policy, tmp_path / "p.npz")


def test_only_dataclasses_can_be_registered():
    with pytest.raises(ModelFileError, match=r"^Trap: expected a dataclass whose name is not taken by another\.$"):
        storage.register(Trap)


def test_a_name_that_is_taken_cannot_be_registered():
    taken = dataclass(type("Hybrid", (), {}))
    with pytest.raises(ModelFileError, match=r"^Hybrid: expected a dataclass whose name is not taken by another\.$"):
        storage.register(taken)


def test_files_are_small_and_of_plain_arrays(small, tmp_path):
    uc.save(small, tmp_path / "p.npz")
    with zipfile.ZipFile(tmp_path / "p.npz") as archive:
        for name in archive.namelist():
            assert np.lib.format.read_array(io.BytesIO(archive.read(name)), allow_pickle=False).dtype.kind in "fiubU"
    assert (tmp_path / "p.npz").stat().st_size < 50_000
