"""Checks impulses, and a certificate of them, from the problem's file alone: no code of carom's, no solver.

    python -m carom.check_certificate PROBLEM R.npy [CERTIFICATE]     (or: python check_certificate.py ...)

PROBLEM: .npz (d, W_data, W_indices, W_indptr, q, mu) or FCLIB's local HDF5 without bilateral rows. Find r,
u = W r + q, r in K_mu, u_hat = u + mu |u_T| n in K_mu*, <u_hat, r> = 0. Prints what is measured as JSON. Exit
code 0: the certificate agrees (without one, r solves the problem at 1e-8), 1: not, 2: files cannot be read.
The energy from the bodies is not checked: it needs them.
"""

import hashlib
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np


def load_problem(path: str) -> dict[str, Any]:
    """Numbers of a problem: d, q, mu, target, and W as rows, columns and values in order, zeros left out."""
    if Path(path).suffix == ".npz":
        with np.load(path, allow_pickle=False) as z:
            p = {"d": int(z["d"]), "q": z["q"], "target": abs(0 * z["q"])}
            p["target"] = z["target"] if "target" in z.files else p["target"]
            p["mu"] = z["mu"] if "mu" in z.files else np.zeros(len(p["q"]))
            values, columns, starts = z["W_data"], z["W_indices"], z["W_indptr"]
            rows = np.repeat(np.arange(len(starts) - 1), np.diff(starts))
    else:
        import h5py

        with h5py.File(path, "r") as f:
            g, w = f["fclib_local"], f["fclib_local/W"]
            assert "V" not in g, "bilateral rows: save the problem as .npz"
            p = {"d": int(g["spacedim"][0]), "q": g["vectors/q"][...], "mu": g["vectors/mu"][...]}
            p["target"], nz = abs(0 * p["q"]), int(w["nz"][0])
            place, line = w["i"][...], w["p"][...]
            line = line if nz >= 0 else np.repeat(np.arange(len(line) - 1), np.diff(line))
            rows, columns = (line, place) if nz == -2 else (place, line)
            rows, columns, values = (a[: nz if nz >= 0 else len(line)] for a in (rows, columns, w["x"][...]))
    order = np.lexsort((columns, rows))
    rows, columns, values = (a[order][values[order] != 0] for a in (rows, columns, values))
    return {**p, "w": (rows.astype(int), columns.astype(int), values)}


def digest(arrays: list[Any]) -> str:
    """SHA-256 of whole numbers as int64 and others as float64, little-endian."""
    parts = [array.astype("<i8" if array.dtype.kind in "iu" else "<f8").tobytes() for array in arrays]
    return hashlib.sha256(b"".join(parts)).hexdigest()


def project(x: Any, mu: Any) -> Any:
    """Rows of x on the cones |x_T| <= mu x_N."""
    t = np.linalg.norm(x[:, 1:], axis=1)
    n = (x[:, 0] + mu * t) / (1 + mu * mu)
    side = np.column_stack([n, x[:, 1:] * (mu * n / np.where(t > 0, t, 1))[:, None]])
    out = np.where((mu * t <= -x[:, 0])[:, None], 0.0, side)
    return np.where(((t <= mu * x[:, 0]) & (x[:, 0] >= 0))[:, None], x, out)


def islands(k: int, a: Any, b: Any) -> Any:
    """The first contact of the island of each contact; a and b are coupled."""
    label, before = np.arange(k), None
    while before is None or (label != before).any():
        before = label.copy()
        np.minimum.at(label, a, before[b])
        np.minimum.at(label, b, before[a])
        label = label[label]
    return label


def measured(p: dict[str, Any], r: Any, tolerance: float) -> tuple[dict[str, Any], dict[str, Any], Any]:
    """Fields of a certificate, how far rounding may move each, and the residual of each contact [m/s]."""
    d, mu, q, (rows, columns, values) = p["d"], p["mu"], p["q"], p["w"]
    k = len(mu)
    u = (np.bincount(rows, values * r[columns], len(q)) + q).reshape(-1, d)
    size = np.bincount(rows, abs(values * r[columns]), len(q)) + abs(q)
    blocks, own = np.zeros((k, d, d)), rows // d == columns // d
    np.add.at(blocks, (rows[own] // d, rows[own] % d, columns[own] % d), values[own])
    norm = np.array([np.linalg.norm(block, 2) or 1.0 for block in blocks])
    x, push, slip = r.reshape(-1, d), *(np.linalg.norm(a.reshape(-1, d)[:, 1:], axis=1) for a in (r, u))
    hat = u + np.column_stack([mu * slip, np.zeros((k, d - 1))])
    plain = x - project(x - hat, mu)
    scaled = (x - project(x - hat / norm[:, None], mu)) * norm[:, None]
    each, length = np.linalg.norm(scaled, axis=1), np.linalg.norm(q) or 1.0
    top, strong = abs(q).max(initial=0) or 1.0, max(np.linalg.norm(x, axis=1).max(initial=0), 1e-300)
    outside = max(0.0, (push - mu * x[:, 0]).max(initial=0), (-x[:, 0]).max(initial=0))
    presses = x[:, 0] > 1e-9 * strong
    slips = presses & (push > 0) & (push >= mu * x[:, 0] * (1 - 1e-6)) & (slip > 1e-9 * top)
    a, b = u[slips, 1:], -x[slips, 1:]
    cross = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0] if d == 3 else 0 * push[slips]
    errors = np.linalg.norm(plain) / length, np.linalg.norm(scaled) / length, outside / strong
    found = {
        "dimension": d, "contacts": k, "impulse_sha256": digest([r]),
        "problem_sha256": digest([np.array([d]), rows, columns, values, q, mu, p["target"]]),
        "err_nat": errors[0], "err_scaled": errors[1], "cone": errors[2],
        "solved": bool(errors[0] <= tolerance and errors[1] <= 10 * tolerance and errors[2] <= 1e-12),
        "residual": each.max(initial=0), "relative_residual": each.max(initial=0) / top,
        "cone_violation": outside, "penetration": (-u[:, 0]).max(initial=0),
        "complementarity": abs((hat * x).sum(axis=1)).max(initial=0),
        "slip_angle_error": np.arctan2(abs(cross), (a * b).sum(axis=1)).max(initial=0),
        "energy_change": r @ ((u.ravel() + q) / 2 + p["target"]),
        "take_off": int((~presses).sum()), "stick": int((presses & ~slips).sum()), "slip": int(slips.sum()),
    }  # fmt: skip
    eps = 64 * np.finfo(float).eps
    speed = eps * (size.max(initial=0) + (norm * np.linalg.norm(x, axis=1)).max(initial=0))
    root = np.sqrt(k) / length
    noise = {
        "err_nat": root * (speed + eps * strong), "err_scaled": root * speed, "cone": eps, "residual": speed,
        "relative_residual": speed / top, "cone_violation": eps * strong, "penetration": speed,
        "complementarity": speed * strong, "slip_angle_error": 1e-9,
        "energy_change": eps * float(abs(r) @ (size + abs(p["target"]))),
    }  # fmt: skip
    return {key: getattr(v, "item", lambda v=v: v)() for key, v in found.items()}, noise, each


def disagreements(stated: dict[str, Any], p: dict[str, Any], r: Any) -> list[str]:
    """What a certificate states and problem and impulses do not bear out."""
    found, noise, each = measured(p, r, float(stated["tolerance"]))
    wrong = []
    for key, value in found.items():
        given, slack = stated.get(key), noise.get(key)
        off = None if slack is None else abs(float("nan" if given is None else given) - value)
        if not (given == value if off is None else off <= 1e-9 * abs(value) + noise[key]):
            wrong.append(f"{key}: stated {given}, found {value}")
    worst, least = stated.get("worst_contact"), found["residual"] * (1 - 1e-9) - noise["residual"]
    if not (least <= 0 if worst is None else 0 <= worst < len(each) and each[worst] >= least):
        wrong.append(f"worst_contact: stated {worst}, found {int(each.argmax())}")
    label = islands(len(each), p["w"][0] // p["d"], p["w"][1] // p["d"])
    for island in stated.get("islands", []):
        mine = each[label == island["first_contact"]]
        off = abs(mine.max(initial=0) - island["residual"])
        if len(mine) != island["contacts"] or not off <= 1e-9 * island["residual"] + noise["residual"]:
            wrong.append(f"island of contact {island['first_contact']}")
    return wrong


def load_certificate(path: str) -> dict[str, Any]:
    """The fields of a certificate in JSON or HDF5 (there without islands)."""
    if Path(path).suffix == ".json":
        return dict(json.loads(Path(path).read_text()))
    import h5py

    with h5py.File(path, "r") as f:
        return dict(f.attrs)


def main(words: list[str]) -> int:
    """Checks; returns the exit code."""
    try:
        problem, r = load_problem(words[0]), np.load(words[1], allow_pickle=False).astype(float).ravel()
        stated = load_certificate(words[2]) if len(words) > 2 else None
        assert r.size == problem["q"].size, f"{r.size} impulses for {problem['q'].size} rows"
        assert np.isfinite(r).all(), "impulses must be finite"
        wrong = [] if stated is None else disagreements(stated, problem, r)
        found = measured(problem, r, 1e-8 if stated is None else float(stated["tolerance"]))[0]
    except (OSError, ValueError, LookupError, TypeError, AttributeError, AssertionError) as error:
        print(f"cannot check: {error!r}; give PROBLEM R.npy [CERTIFICATE.json]", file=sys.stderr)
        return 2
    agrees = None if stated is None else not wrong
    print(json.dumps({**found, "certificate_agrees": agrees, "disagreements": wrong}, indent=1))
    return 0 if (found["solved"] if agrees is None else agrees) else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
