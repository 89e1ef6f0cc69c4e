"""Attacks on what docs/reliability promises: damaged files, odd data, kills, full disks, names that are hostile.

``python -m fuzz`` (in this folder's parent) goes on for a minute, ``--seconds S`` for as long as that, and ``--long``
until each attack was tried as often as its row of the table wants, going on where an earlier run stopped; ``--only NAME
...`` chooses some of them. Trial number N of an attack is made from its name and number alone; what goes wrong is tried
once more in a process of its own, as ``--trial NAME N`` does. The exit code is 1 if there was a fault.
"""

import os

os.environ |= {f"{library}_NUM_THREADS": "1" for library in ("OMP", "OPENBLAS", "MKL")}

from .attack import Attack, trial
from .commands import commands
from .files import FILES, of_files
from .kills import of_kills
from .learning import learning
from .models import of_tampering
from .running import Tally, run
from .streams import streams

__all__ = ["ATTACKS", "Attack", "Tally", "run", "trial"]

ATTACKS = {
    attack.name: attack
    for attack in (
        *map(of_files, FILES),
        Attack("learning", learning, 50_000),
        of_tampering(),
        of_kills(),
        Attack("commands", commands, 1_000),
        Attack("streams", streams, 100),
    )
}
