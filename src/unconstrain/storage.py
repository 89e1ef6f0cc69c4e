"""A policy, with its moments, or a learnt constraint, in one file that runs nothing when it is opened.

The file is a NumPy ``.npz`` of plain arrays and one JSON header. The header names classes from a fixed list; arrays are
never unpickled; a digest over everything shows damage. Writing goes to a new file that takes the old one's place in one
step.

Examples
--------
>>> from dataclasses import dataclass
>>> @uc.storage.register
... @dataclass(frozen=True)
... class Mirrored:
...     axis: int
...
...     def __call__(self, states):
...         return np.abs(states)
"""

import hashlib
import json
import os
import warnings
import zipfile
from collections.abc import Callable, Mapping
from copy import copy
from dataclasses import fields, is_dataclass
from importlib import import_module
from pathlib import Path
from types import MethodType
from typing import Any, TypeVar, get_args, overload

import numpy as np

from . import constraints
from .base import files
from .base.errors import ModelFileError, UnconstrainError
from .base.foreign import check_size, ours_alone
from .constraints import STORED, LearntConstraint
from .learners import (
    Belief,
    Contracting,
    Direct,
    Hybrid,
    Inconsistency,
    Judged,
    Likelihood,
    NoiseCorrected,
    Robust,
    Segments,
    Solution,
    secondary,
)
from .models import Affine, Everywhere, KMeansRBF, Model, NormalisedRBF, Polynomial, ReceptiveFields, Scale, spaces
from .motion import STORED as GUIDED
from .motion import Guided
from .policies import LocallyLinearPolicy, ParametricPolicy, Policy
from .risks import FoldedMoments, Moments
from .training import Folds, HeldOut, Split, Training

__all__ = ["load", "load_notes", "register", "save"]

Mechanism = constraints.mechanisms.Mechanism
VERSION = 3
"""Of the file format. Older files stay readable; newer ones are refused."""

_FORMAT = "unconstrain-policy"
_HEADER = "header"
_EXPECTED = "a file that 'unconstrain fit' or save() wrote"
_INCOMPLETE = "the policy in it is not complete"
_WORDS: dict[type, str] = {Policy: "policy", Guided: "guided policy"}
_WORDS |= {LearntConstraint: "learnt constraint", Mechanism: "mechanism"}

_KNOWN: dict[str, type] = {
    kind.__name__: kind
    for kind in (
        *(Affine, Everywhere, KMeansRBF, Model, NormalisedRBF, Polynomial, ReceptiveFields, Scale),
        *(spaces.Circle, spaces.Embedding, spaces.Euclidean, spaces.Product, spaces.Sphere),
        *(Belief, Contracting, Direct, Hybrid, Inconsistency, Judged),
        *(Likelihood, NoiseCorrected, Robust, Segments, Solution),
        *(FoldedMoments, Folds, HeldOut, Moments, Split, Training),
        *(LocallyLinearPolicy, ParametricPolicy),
        *GUIDED,
        *STORED,
        *secondary.STORED,
    )
} | constraints.mechanisms.STORED

K = TypeVar("K")


def register(kind: type) -> type:
    """Let a dataclass of your own, such as a feature map, be stored; usable as a decorator.

    It has to be registered before a file that holds it is loaded, too.

    Raises
    ------
    ModelFileError
        If it is no dataclass, or the name is taken by another class.
    """
    if not is_dataclass(kind) or _KNOWN.get(kind.__name__, kind) is not kind:
        raise ModelFileError(f"{kind.__name__}: expected a dataclass whose name is not taken by another.")
    _KNOWN[kind.__name__] = kind
    return kind


def save(
    policy: Policy | Guided | LearntConstraint | Mechanism,
    path: str | os.PathLike[str],
    notes: Mapping[str, Any] | None = None,
) -> None:
    """Write a policy, guided or not, a learnt constraint or a mechanism to a file, whole or not at all.

    Parameters
    ----------
    policy : Policy, Guided, LearntConstraint or Mechanism
        Fitted or not. A policy's moments go along, so that it can learn on from sums. Samples do not: what was fitted
        by a learner that looks at them, such as :class:`~unconstrain.Robust`, predicts as before, and to learn more has
        to be fitted anew, or copied or pickled in place of saved. A constraint goes without what it was learnt from,
        and with its Jacobian if that is the method of an arm, or of another registered dataclass.
    path : str or path-like
        Usually ends in ``.npz``. An existing file is replaced in one step.
    notes : mapping, optional
        Anything that JSON can say, kept beside the policy.

    Raises
    ------
    ModelFileError
        If part of the policy is of a class that is not known here, the file is called as a pickle, or the place cannot
        be written to.
    InvalidDataError
        If what was learnt is not finite.

    Examples
    --------
    >>> policy = uc.ParametricPolicy(uc.Affine(), "direct").fit([[0.0], [1.0]], [[0.0], [2.0]])
    >>> uc.save(policy, "policy.npz", notes={"of": "Monday"})
    >>> uc.storage.load_notes("policy.npz")
    {'of': 'Monday'}
    """
    if Path(path).suffix.lower() in files.PICKLES:
        raise ModelFileError(f"{path}: nothing here writes pickles, which run code when opened; name it .npz.")
    for learnt in ("solution_", "choice_"):
        if hasattr(policy, learnt):
            getattr(policy, learnt).checked()
    arrays: dict[str, np.ndarray[Any, Any]] = {}
    content = {"policy": _pack(_without_samples(policy), arrays), "notes": _plain(notes or {})}
    header = {"format": _FORMAT, "version": VERSION, "content": content}
    header["digest"] = _digest(header, arrays)
    arrays[_HEADER] = np.array(json.dumps(header))
    files.write(path, lambda stream: np.savez_compressed(stream, **arrays), ModelFileError)  # type: ignore[arg-type]


@overload
def load(path: str | os.PathLike[str]) -> Policy: ...


@overload
def load(path: str | os.PathLike[str], kind: type[K]) -> K: ...


def load(path: str | os.PathLike[str], kind: type[Any] = Policy) -> Any:
    """Read a policy from a file, or what else is asked for.

    Parameters
    ----------
    path : str or path-like
    kind : type
        ``Policy``, ``Guided``, ``LearntConstraint`` or ``constraints.mechanisms.Mechanism``.

    Raises
    ------
    ModelFileError
        If the file does not exist, is damaged, of a newer version, not ours, of another kind, or does not predict. Its
        digest shows damage, not malice: whoever writes a file can write its digest.

    Examples
    --------
    >>> uc.save(uc.ParametricPolicy(uc.Affine(), "direct").fit([[0.0], [1.0]], [[0.0], [2.0]]), "policy.npz")
    >>> uc.load("policy.npz").predict([[2.0]]).round(6)
    array([[4.]])
    """
    header, arrays = _read(path)
    # A file that was tampered with, digest included, can make any constructor fail, in any way.
    with ours_alone(path, _EXPECTED, ModelFileError, _INCOMPLETE, kinds=True):
        try:
            content = header["content"]["policy"]
            for version, change in _CHANGES.items():
                content = _changed(content, change) if header["version"] <= version else content
            policy = _unpack(content, arrays)
        except ModelFileError as error:
            raise ModelFileError(f"{path}: {error}") from error
        except UnconstrainError as error:
            raise ModelFileError(f"{path}: {_INCOMPLETE} ({type(error).__name__}: {error}).") from error
        if not isinstance(policy, kind):
            kinds = get_args(kind) or (kind,)
            wanted = "policy" if issubclass(Policy, kind) else " or ".join(_WORDS.get(k, k.__name__) for k in kinds)
            held = next((each for each in _WORDS if isinstance(policy, each)), type(policy))
            use = (
                " Give it beside a policy, as constraint= of rollout." if held in (LearntConstraint, Mechanism) else ""
            )
            use = " In Python, load it with uc.load(path, uc.Guided)." if held is Guided and kind is Policy else use
            raise ModelFileError(f"{path}: holds a {_WORDS.get(held, held.__name__)}, expected a {wanted}.{use}")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # states have no names here
            said = [each for known, tried in _TRIED.items() if isinstance(policy, known) for each in tried(policy)]
            if not all(np.isfinite(each).all() for each in said):
                raise ValueError("what it says is not finite")
    return policy


def _tried_policy(policy: Policy) -> list[Any]:
    """What a fitted policy says in the midst of its data."""
    repr(policy)
    if not hasattr(policy, "solution_"):
        return []
    training, scale = policy.training_, policy.scale_
    state = training.model.embedding.states(training.split.origin[None])
    place = state if scale is None else scale.states * state
    found = [policy.predict(place).reshape(1, policy.n_outputs_), policy.step(place[0])]
    return found if policy.solution_.belief is None else [*found, *policy.uncertainty(place)]


def _tried_constraint(constraint: LearntConstraint) -> list[Any]:
    repr((constraint, constraint.mechanism_))
    if not hasattr(constraint, "choice_"):
        return []
    place = np.ones((1, constraint.choice_.columns))
    return [constraint.projection(place).reshape(1, constraint.choice_.actions, constraint.choice_.actions)]


_TRIED: dict[type, Callable[[Any], list[Any]]] = {
    Policy: _tried_policy,
    Guided: lambda guided: [guided(guided.goal_[None]).reshape(1, len(guided.goal_))],
    LearntConstraint: _tried_constraint,
    Mechanism: lambda one: [
        one(one.centre + one.frame).reshape(len(one.frame), -1, len(one.centre)),
        [repr(one) != ""],
    ],
}
"""What is asked of each kind, once, before it is given away."""


def load_notes(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Read the notes that were saved beside a policy; raises as :func:`load` does."""
    header, _ = _read(path)
    with ours_alone(path, _EXPECTED, ModelFileError, "the notes in it are not complete", kinds=True):
        return dict(header["content"]["notes"])


def _without_samples(model: Any) -> Any:
    slim = copy(model)
    for name in ("_waiting", "evidence_"):
        slim.__dict__.pop(name, None)
    return slim


def _changed(value: Any, change: Callable[[str, dict[str, Any]], dict[str, Any]]) -> Any:
    """The content of a file with every class in it changed, the innermost first."""
    if isinstance(value, list):
        return [_changed(item, change) for item in value]
    if not isinstance(value, dict):
        return value
    if "class" not in value:
        return {name: _changed(item, change) for name, item in value.items()}
    return change(value["class"], {name: _changed(part, change) for name, part in value["parts"].items()})


def _from_version_1(kind: str, parts: dict[str, Any]) -> dict[str, Any]:
    """A class of format version 1 as version 2 says the same."""
    if kind == "Splitter":
        return {"class": "Split", "parts": {name.removeprefix("_"): part for name, part in parts.items()}}
    if kind == "RobustSolution":
        told = {name: parts.pop(name) for name in _BELIEF_1 if name in parts}
        return {"class": "Solution", "parts": parts | {"belief": {"class": "Belief", "parts": told}}}
    if "_folds" in parts and "solution_" in parts:
        model = {"features": parts.pop("features_"), "fields": parts.pop("fields_", _EVERYWHERE)}
        parts["training_"] = {
            "class": "Training",
            "parts": {
                "model": {"class": "Model", "parts": model},
                "actions": parts["n_outputs_"],
                "split": parts.pop("_splitter"),
                "at_rest": parts.pop("_at_rest"),
                "gathered": parts.pop("_folds"),
            },
        }
    return {"class": kind, "parts": parts}


def _from_version_2(kind: str, parts: dict[str, Any]) -> dict[str, Any]:
    """A class of format version 2 in version 3, where candidates are judged by another rule."""
    kept = {name: part for name, part in parts.items() if kind != "Belief" or name not in _RULE_2}
    return {"class": kind, "parts": kept}


_CHANGES = {1: _from_version_1, 2: _from_version_2}
_RULE_2 = ("compared", "refuted", "candidates")
_BELIEF_1 = ("noise", "misfit", "free_share", "free", "from_noise", "undetermined", "held_out_score", *_RULE_2)
_EVERYWHERE = {"class": "Everywhere", "parts": {}}


def _plain(notes: Mapping[str, Any]) -> dict[str, Any]:
    """What JSON makes of the notes: tuples become lists, names of any kind text."""
    try:
        return dict(json.loads(json.dumps(dict(notes))))
    except (TypeError, ValueError) as error:
        raise ModelFileError(f"notes: {error}; expected what JSON can say: text, numbers, lists, mappings.") from error


def _known(name: str) -> type | None:
    if name == "Arm" and name not in _KNOWN:  # imported only where a constraint knows one
        register(import_module(".paper.systems.arm", __package__).Arm)
    return _KNOWN.get(name)


def _pack(value: Any, arrays: dict[str, np.ndarray[Any, Any]]) -> Any:
    """Turn a value into JSON, laying arrays aside."""
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, np.generic):
        return _pack(value.item(), arrays)
    if isinstance(value, np.ndarray):
        if value.dtype == object:
            value = value.astype(str)
        name = f"array{len(arrays)}"
        arrays[name] = value
        return {"array": name}
    if isinstance(value, range):
        return {"range": [value.start, value.stop, value.step]}
    if isinstance(value, list | tuple):
        return {"list": [_pack(item, arrays) for item in value]}
    if isinstance(value, dict):
        return {"pairs": [[_pack(key, arrays), _pack(item, arrays)] for key, item in value.items()]}
    if isinstance(value, MethodType) and value.__name__ == "jacobian":
        return {"jacobian": _pack(value.__self__, arrays)}
    kind = type(value)
    name = next((name for name, one in _KNOWN.items() if one is kind), kind.__name__)
    if _known(name) is not kind:
        raise ModelFileError(
            f"cannot store a {kind.__name__}: only classes that are known by name can be read back without running "
            f"code. Known are {', '.join(sorted(_KNOWN))}; add a dataclass of your own with storage.register."
        )
    parts = (
        {
            field.name: getattr(value, field.name)
            for field in fields(value)
            if field.init and field.metadata.get("stored", True)
        }
        if is_dataclass(value)
        else value.__getstate__()
    )
    return {"class": name, "parts": {name: _pack(part, arrays) for name, part in parts.items()}}


def _unpack(value: Any, arrays: Mapping[str, np.ndarray[Any, Any]]) -> Any:
    """Undo :func:`_pack`."""
    if not isinstance(value, dict):
        return value
    if "array" in value:
        return arrays[value["array"]]
    if "range" in value:
        return range(*value["range"])
    if "list" in value:
        return tuple(_unpack(item, arrays) for item in value["list"])
    if "pairs" in value:
        return {_unpack(key, arrays): _unpack(item, arrays) for key, item in value["pairs"]}
    if "jacobian" in value:
        return _unpack(value["jacobian"], arrays).jacobian
    if (kind := _known(value["class"])) is None:
        raise ModelFileError(
            f"holds the class {value['class']}, which is not known here. Import the module that defines it and pass it "
            "to storage.register before loading."
        )
    parts = {name: _unpack(part, arrays) for name, part in value["parts"].items()}
    if is_dataclass(kind):
        texts = [one.name for one in fields(kind) if one.type in ("str", str) and one.name in parts]
        if not all(isinstance(parts[name], str) for name in texts):
            raise TypeError(f"{', '.join(texts)} of a {kind.__name__} should be text")
        return kind(**parts)
    made: Any = object.__new__(kind)
    vars(made).update(parts)
    return made


def _read(path: str | os.PathLike[str]) -> tuple[dict[str, Any], dict[str, np.ndarray[Any, Any]]]:
    """Header and arrays of a file, checked."""
    if not Path(path).is_file():
        what = "a folder" if Path(path).is_dir() else "no such file"
        raise ModelFileError(f"{path}: {what}, expected a policy file.")
    if not zipfile.is_zipfile(path):
        raise ModelFileError(f"{path}: is no policy file, or a damaged one. Expected {_EXPECTED}.")
    with (
        ours_alone(path, _EXPECTED, ModelFileError, "is no policy file, or a damaged one", kinds=True),
        Path(path).open("rb") as stream,  # opened here, because NumPy leaves a damaged one open
        np.load(stream, allow_pickle=False) as file,
    ):
        held = file.zip.infolist()
        check_size(sum(one.file_size for one in held) // 8, sum(one.compress_size for one in held))
        arrays = {name: file[name] for name in file.files}
    try:
        header = json.loads(str(arrays.pop(_HEADER)))
        if header["format"] != _FORMAT:
            raise ValueError(f"format {header['format']!r}")
        version = int(header["version"])
    except (KeyError, TypeError, ValueError, OverflowError, RecursionError) as error:
        raise ModelFileError(f"{path}: was not written by unconstrain. Expected {_EXPECTED}.") from error
    if version > VERSION:
        raise ModelFileError(
            f"{path}: is of format version {version}, and this release reads up to {VERSION}. Upgrade unconstrain."
        )
    if header.pop("digest", None) != _digest(header, arrays):
        raise ModelFileError(f"{path}: is damaged: its content does not match its digest. Save the policy anew.")
    return header, arrays


def _digest(header: Mapping[str, Any], arrays: Mapping[str, np.ndarray[Any, Any]]) -> str:
    said = hashlib.sha256(json.dumps(header, sort_keys=True).encode())
    for name in sorted(arrays):
        array = np.ascontiguousarray(arrays[name])
        said.update(f"{name}{array.dtype.str}{array.shape}".encode())
        said.update(array.tobytes())
    return said.hexdigest()
