"""Instructions of a step of the race, and memory that comes to it from beyond the second cache.

`count.py RACE TABLE SCENES ENGINES [PATIENCE]` runs RACE (`carom-race`) under valgrind, a scene and an engine
at a time on one thread, and counts within the engine's step alone. Each is a row of TABLE, in means over the
steps taken: what is counted, the times that it takes at `WIDTH` instructions a cycle of `CLOCK` and at
`BANDWIDTH`, and the larger of these, below which the code as it is cannot go. Caches are simulated: a first
one as the machine's, behind it one as the machine's second, and nothing is fetched before it is asked for.
What it does not do: count waits, or work of other cores.
"""

from __future__ import annotations

import csv
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

# instructions that a processor of today takes up in a cycle at most, and cycles in a microsecond
WIDTH = 4.0
CLOCK = 3000.0
# what one core streams from memory and back [bytes/us]
BANDWIDTH = 10_000.0
LINE = 64
COLUMNS = [
    "scene",
    "space",
    "engine",
    "steps",
    "instructions",
    "bytes",
    "us_by_instructions",
    "us_by_bytes",
    "us_floor",
]
# a data cache's size, ways and line where the system does not tell them
USUAL = {"LEVEL1_DCACHE": [32768, 8, 64], "LEVEL2_CACHE": [524288, 8, 64]}


def cache(name: str) -> str:
    """A data cache of this machine, as valgrind wants to be told of it."""
    told = []
    for what in ("SIZE", "ASSOC", "LINESIZE"):
        asked = subprocess.run(["getconf", f"{name}_{what}"], capture_output=True, text=True, check=False)
        told.append(int(asked.stdout) if asked.stdout.strip().isdigit() else 0)
    return ",".join(str(n) for n in (told if all(told) else USUAL[name]))


def counted(race: str, scene: str, engine: str, patience: str) -> dict[str, str]:
    """The row of a scene and an engine.

    Raises:
        SystemExit: the race failed, or nothing was counted.
    """
    tool = ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null", "--cache-sim=yes"]
    tool += ["--simulate-wb=yes", f"--D1={cache('LEVEL1_DCACHE')}", f"--LL={cache('LEVEL2_CACHE')}"]
    tool += ["--toggle-collect=*Engine*>::step"]
    with tempfile.TemporaryDirectory() as folder:
        asked = ["--scenes", scene, "--engines", engine, "--threads", "1", "--sleeping", "off"]
        asked += ["--repeats", "1", "--patience", patience, "--out", folder]
        done = subprocess.run([*tool, race, *asked], capture_output=True, text=True, check=False)
        if done.returncode != 0:
            sys.exit(f"{scene}, {engine}: {done.stderr.strip()[-800:]}")
        raced = [row for table in Path(folder).glob("*/peers.csv") for row in rows_of(table)]
    names = re.search(r"Events\s*:\s*(.+)", done.stderr)
    totals = re.search(r"Collected\s*:\s*(.+)", done.stderr)
    if len(raced) != 1 or names is None or totals is None or totals[1].split()[0] == "0":
        sys.exit(
            f"{scene}, {engine}: nothing counted; name the space, and an engine that steps in this process"
        )
    told = dict(zip(names[1].split(), map(int, totals[1].split()), strict=False))
    steps = int(raced[0]["steps"])
    lines = sum(told.get(event, 0) for event in ("ILmr", "DLmr", "DLmw", "ILdmr", "DLdmr", "DLdmw"))
    instructions, moved = told["Ir"] / steps, LINE * lines / steps
    times = [instructions / (WIDTH * CLOCK), moved / BANDWIDTH]
    numbers = [str(steps), f"{instructions:.0f}", f"{moved:.0f}", *(f"{t:.1f}" for t in (*times, max(times)))]
    return dict(zip(COLUMNS, [raced[0]["scene"], raced[0]["space"], engine, *numbers], strict=True))


def rows_of(table: Path) -> list[dict[str, str]]:
    """Rows of a table; none where it is not there."""
    if not table.exists():
        return []
    with table.open(newline="") as file:
        return list(csv.DictReader(file))


def main() -> None:
    """Counts every scene on every engine; rows of others stay in the table."""
    race, table, scenes, engines, *rest = sys.argv[1:]
    if shutil.which("valgrind") is None:
        sys.exit("instructions are counted by valgrind, which is not here: install its package")
    rows = {(row["space"], row["scene"], row["engine"]): row for row in rows_of(Path(table))}
    for scene in scenes.split(","):
        for engine in engines.split(","):
            row = counted(race, scene, engine, rest[0] if rest else "60")
            rows[row["space"], row["scene"], engine] = row
            print("  ".join(f"{name} {row[name]}" for name in COLUMNS), flush=True)
            with Path(table).open("w", newline="") as file:
                writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
                writer.writeheader()
                writer.writerows(rows[key] for key in sorted(rows))


if __name__ == "__main__":
    main()
