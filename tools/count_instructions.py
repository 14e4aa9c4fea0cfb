"""Instructions of the hot kernels, so that a change that slows one is seen on a machine with a noisy clock.

`count_instructions.py PROGRAM TABLE [--check]` runs every kernel of PROGRAM
(`crates/scenes/src/bin/instructions.rs`) twice under valgrind, the second time with twice the work: the
difference over the count is what one costs, without the set-up. It prints the counts beside those of TABLE
and writes them there; with `--check` it leaves the table and ends with 1 where a count is more than a
twentieth above its row. Counts repeat to a few in a million on one compiler.
"""

from __future__ import annotations

import csv
import re
import shutil
import subprocess
import sys
from pathlib import Path

# what a kernel may cost more before it counts as slower [1]
ALLOWED = 0.05
COLUMNS = ["kernel", "unit", "instructions", "compiler"]


def instructions(program: str, kernel: str, count: int) -> int:
    """Instructions that the program takes for so many of a kernel.

    Raises:
        SystemExit: the program failed, or valgrind told no count.
    """
    tool = ["valgrind", "--tool=cachegrind", "--cache-sim=no", "--cachegrind-out-file=/dev/null"]
    done = subprocess.run([*tool, program, kernel, str(count)], capture_output=True, text=True, check=False)
    told = re.search(r"I\s+refs:\s+([\d,]+)", done.stderr)
    if done.returncode != 0 or told is None:
        sys.exit(f"{kernel}: {done.stderr.strip()[-400:]}")
    return int(told[1].replace(",", ""))


def counted(program: str, kernel: str, count: int) -> int:
    """Instructions of one of a kernel: those of twice the count less those of the count, over it."""
    once, twice = (instructions(program, kernel, n) for n in (count, 2 * count))
    return round((twice - once) / count)


def main() -> None:
    """Counts all kernels and compares them with the table."""
    program, table, check = sys.argv[1], Path(sys.argv[2]), "--check" in sys.argv[3:]
    if shutil.which("valgrind") is None:
        sys.exit("instructions are counted by valgrind, which is not here: install its package")
    before: dict[str, int] = {}
    if table.exists():
        with table.open(newline="") as file:
            before = {row["kernel"]: int(row["instructions"]) for row in csv.DictReader(file)}
    version = subprocess.run(["rustc", "--version"], capture_output=True, text=True, check=True).stdout
    compiler = " ".join(version.split()[:2])
    listed = subprocess.run([program], capture_output=True, text=True, check=True).stdout.splitlines()
    rows, slower = [], []
    for kernel, unit, count in (line.split("\t") for line in listed):
        now = counted(program, kernel, int(count))
        ratio = now / before[kernel] if kernel in before else float("nan")
        print(f"{kernel:44}{now:14,} per {unit:8}{ratio:8.3f} of the table's", flush=True)
        rows.append([kernel, unit, str(now), compiler])
        if ratio > 1.0 + ALLOWED:
            slower.append(kernel)
    if check:
        if slower:
            sys.exit("more instructions than the table allows: " + "; ".join(slower))
        return
    with table.open("w", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows([COLUMNS, *rows])


if __name__ == "__main__":
    main()
