"""The command line of the attacks; see the package."""

import argparse
import os
import sys

import fuzz

from . import ATTACKS, Tally, run
from .running import CRASH, HANG, ROOT

KEPT = ROOT / "build" / "fuzz"
HEAD = "{:<18}{:>9}{:>9}{:>8}{:>7}{:>9}{:>9}"


def alone(attack, number):
    """What came of one trial."""
    return [*run(attack, wanted=number + 1, tally=Tally(number)).faults]


def tell(attack, tally):
    figures = sum(tally.faults.values()), tally.count(HANG), tally.count(CRASH), f"{tally.seconds:.0f} s"
    print(HEAD.format(attack.name, tally.tried, attack.wanted, *figures), flush=True)
    for said, number in [*tally.examples.items()][:8]:
        again = "" if said in alone(attack, number) else ", after others alone"
        print(f"    {tally.faults[said]} x {said}  (--trial '{attack.name}' {number}{again})", flush=True)


def main():
    asked = argparse.ArgumentParser(description=fuzz.__doc__, formatter_class=argparse.RawTextHelpFormatter)
    asked.add_argument("--long", action="store_true", help="until each attack was tried as often as it should be")
    asked.add_argument(
        "--seconds", type=float, help="in all; 60, or without end with --long, whose 0 tells what was kept"
    )
    asked.add_argument("--only", nargs="+", default=[""], help="attacks whose names begin so")
    asked.add_argument("--lanes", type=int, default=len(os.sched_getaffinity(0)), help="processes side by side")
    asked.add_argument("--trial", nargs=2, metavar=("NAME", "N"), help="one trial again")
    told = asked.parse_args()
    if told.trial:
        found = alone(ATTACKS[told.trial[0]], int(told.trial[1]))
        print(found)
        return bool(found)
    chosen = [attack for name, attack in ATTACKS.items() if name.startswith(tuple(told.only))]
    seconds = told.seconds if told.seconds is not None else float("inf") if told.long else 60.0
    print(HEAD.format("attack", "tried", "wanted", "faults", "hangs", "crashes", "time"))
    clean = True
    for attack in chosen:
        path = KEPT / f"{attack.name.replace(' ', '-')}.json"
        tally = Tally.kept(path) if told.long else Tally()
        keep = (lambda tally, path=path: tally.keep(path)) if told.long else (lambda tally: None)
        run(attack, seconds / len(chosen), attack.wanted if told.long else float("inf"), told.lanes, tally, keep)
        tell(attack, tally)
        clean &= not tally.faults
    return not clean


if __name__ == "__main__":
    sys.exit(main())
