"""Models whose content was changed and whose digest was mended."""

import hashlib
import io
import json

import numpy as np

import unconstrain as uc

from .attack import Attack, taught

ODD_VALUES = (None, True, 0, -1, 2**70, 1e308, "word", [], {}, {"list": []}, {"array": "array0"}, {"array": "none"})
MODELS = (
    uc.LocallyLinearPolicy(),
    uc.ParametricPolicy(uc.KMeansRBF(4), "hybrid"),
    uc.LocallyLinearPolicy(scale="auto", learner="robust"),
    uc.LocallyLinearPolicy(space=uc.spaces.Circle() * uc.spaces.Circle()),
)


def mended(header, arrays):
    said = hashlib.sha256(json.dumps(header, sort_keys=True).encode())
    for name in sorted(arrays):
        array = np.ascontiguousarray(arrays[name])
        said.update(f"{name}{array.dtype.str}{array.shape}".encode() + array.tobytes())
    return said.hexdigest()


def places(value, at=()):
    """Where in a header something may be put."""
    yield at
    inner = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, inside in inner:
        yield from places(inside, (*at, key))


def tampered_array(array, rng):
    match rng.randrange(6):
        case 0:
            return array[:0]
        case 1:
            return array.astype(str)
        case 2:
            return array.reshape(-1)
        case 3:
            return np.full(array.shape, np.nan)
        case 4:
            return np.concatenate([array, array]) if array.ndim else array[None]
    return array.astype(np.int8, casting="unsafe") if array.dtype.kind in "fiu" else np.zeros(3)


def tamper(content, arrays, rng):
    """One value of a header, or one array, made another."""
    if rng.randrange(2) and arrays:
        name = rng.choice(sorted(arrays))
        arrays[name] = tampered_array(arrays[name], rng)
        return
    *way, last = rng.choice([at for at in places(content) if at and at[0] == "policy" and len(at) > 1])
    inside = content
    for key in way:
        inside = inside[key]
    if rng.randrange(4) == 0 and isinstance(inside, dict):
        del inside[last]
    else:
        inside[last] = rng.choice(ODD_VALUES)


def used(path, folder):
    """All that can be asked of a policy."""
    policy = uc.load(path)
    uc.storage.load_notes(path)
    if not hasattr(policy, "solution_"):  # it has learnt nothing, and says so
        return None
    columns = policy.n_features_in_
    found = policy.predict(np.zeros((3, columns))), policy.step(np.ones(columns)), repr(policy)
    policy.export_c(folder / "b.c")
    return None if all(len(one) for one in found) else "it predicts nothing"


def of_tampering():
    models = []

    def prepare(folder):
        models[:] = []
        for model in MODELS:
            uc.save(taught(model), folder / "a.npz")
            models.append((folder / "a.npz").read_bytes())

    def attempt(rng, folder):
        with np.load(io.BytesIO(rng.choice(models)), allow_pickle=False) as file:
            arrays = dict(file)
        header = json.loads(str(arrays.pop("header")))
        header.pop("digest")
        for _ in range(rng.randint(1, 2)):
            tamper(header["content"], arrays, rng)
        np.savez(folder / "b.npz", header=np.array(json.dumps({**header, "digest": mended(header, arrays)})), **arrays)
        return used(folder / "b.npz", folder)

    return Attack("tampered models", attempt, 5_000, prepare)
