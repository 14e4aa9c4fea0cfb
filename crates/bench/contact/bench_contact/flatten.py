"""python -m bench_contact.flatten FOLDER OUT: the .npz problems of a folder as flat files."""

from __future__ import annotations

import sys
from pathlib import Path

from bench_contact import problems


def main() -> int:
    """Writes OUT/NAME.bin for every FOLDER/NAME.npz; nothing else stays in OUT."""
    if len(sys.argv) != 3:
        print(__doc__, file=sys.stderr)
        return 2
    folder, out = Path(sys.argv[1]), Path(sys.argv[2])
    out.mkdir(parents=True, exist_ok=True)
    for old in out.glob("*.bin"):
        old.unlink()
    for file in sorted(folder.glob("*.npz")):
        problem = problems.from_npz(file)
        problems.to_flat(problem, out / f"{problem.name}.bin")
    return 0


if __name__ == "__main__":
    sys.exit(main())
