"""All benchmarks, one table: ``make bench``.

Each runs in a process of its own. The rows are kept as JSON under build/;
``--against FILE`` compares with those of an earlier run, ``--full`` streams
1e8 samples instead of 1e7, and ``--only NAME`` runs some of them.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import platform
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import scipy
from table import Row, row, show
from threadpoolctl import threadpool_info

HERE = Path(__file__).parent
NAMES = ("sums", "arm", "control_loop", "streaming", "cluster", "recordings", "constraints", "default_fit", "face")
KEPT = HERE.parent / "build" / "bench.json"


def run(name: str, arguments: list[str]) -> list[Row]:
    """Rows of one benchmark; a single one of NaN where it fails."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "rows.json"
        done = subprocess.run([sys.executable, HERE / f"{name}.py", "--rows", path, *arguments], check=False)
        if done.returncode:
            return [row(f"{name}: failed, see above", float("nan"), "", 0.0)]
        rows: list[Row] = json.loads(path.read_text())
        return rows


def machine() -> dict[str, Any]:
    """What the figures depend on, without naming anybody's machine."""
    blas = [library for library in threadpool_info() if library["user_api"] == "blas"]
    return {
        "cores": os.cpu_count(),
        "blas": sorted({f"{library['internal_api']} {library['version']}" for library in blas}),
        "blas_threads": max((library["num_threads"] for library in blas), default=1),
        "python": platform.python_version(),
        "numpy": np.__version__,
        "scipy": scipy.__version__,
    }


def main() -> int:
    """Run, print, keep; 1 if a benchmark failed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--full", action="store_true", help="stream 1e8 samples")
    parser.add_argument("--only", nargs="+", choices=NAMES, default=NAMES, metavar="NAME", help=", ".join(NAMES))
    parser.add_argument("--against", type=Path, help="the JSON of an earlier run, to print ratios")
    parser.add_argument("--out", type=Path, default=KEPT, help="where to keep the rows")
    asked = parser.parse_args()
    before = None
    if asked.against is not None:
        before = {line["what"]: line["value"] for line in json.loads(asked.against.read_text())["rows"]}
    rows: list[Row] = []
    for name in asked.only:
        print(f"{name} ...", file=sys.stderr)
        rows += run(name, ["--samples", "1e8"] if name == "streaming" and asked.full else [])
    what = machine()
    title = f"{what['cores']} cores, {', '.join(what['blas'])}, {what['blas_threads']} BLAS threads where not one"
    show(rows, before, title)
    asked.out.parent.mkdir(parents=True, exist_ok=True)
    asked.out.write_text(json.dumps({"machine": what, "rows": rows}, indent=1, ensure_ascii=False))
    return int(any(math.isnan(line["value"]) and "failed" in line["what"] for line in rows))


if __name__ == "__main__":
    sys.exit(main())
