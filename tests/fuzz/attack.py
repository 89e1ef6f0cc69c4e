"""One trial of one attack."""

import os
import random
import shutil
import traceback
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

import unconstrain as uc


class Attack(NamedTuple):
    """``attempt(rng, folder)`` gives None, or the words of a fault; ``wanted`` trials make a row of the table."""

    name: str
    attempt: Callable
    wanted: int
    prepare: Callable = lambda folder: None


def trial(attack, number, folder):
    """None, or the words of a fault; the folder is empty afterwards."""
    rng = random.Random(f"{attack.name} {number}")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return attack.attempt(rng, folder)
    except uc.UnconstrainError:
        return None
    except Exception as error:  # noqa: BLE001 - what is looked for
        place = traceback.extract_tb(error.__traceback__)[-1]
        return f"{type(error).__name__}: {str(error)[:100]} ({Path(place.filename).name}:{place.lineno})"
    finally:
        emptied(folder)


def emptied(folder):
    for each in os.scandir(folder):
        if each.is_dir(follow_symlinks=False):
            shutil.rmtree(each.path, ignore_errors=True)
        else:
            os.unlink(each.path)  # noqa: PTH108


def numbers_of(rng):
    """NumPy's random numbers, begun by Python's."""
    return np.random.default_rng(rng.getrandbits(64))


def taught(model=None, samples=60):
    """A policy of two states that goes to the origin."""
    states = np.random.default_rng(0).uniform(-1, 1, (samples, 2))
    return (model or uc.LocallyLinearPolicy()).fit(states, -states, groups=np.arange(samples) // 10)
