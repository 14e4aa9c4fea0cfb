"""Files of friction problems: which form a path has, and how what is wrong with one is told.

``.npz`` is read and written as arrays; ``.hdf5`` and ``.h5`` as FCLIB's layout; both, and ``.json``, are also
read as what `ContactProblem.save` wrote. Knows no physics.
"""

from __future__ import annotations

import json
import struct
import tokenize
import zipfile
import zlib
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from carom._friction_problem_body import BodyForm
from carom._friction_problem_npz import csr_arrays, problem_arguments, read_npz, write_npz
from carom._friction_problem_sparse import from_compressed
from carom._space import Floats
from carom.errors import BuildError, CaromError, RunFileError, refused

if TYPE_CHECKING:
    from carom._friction_problem import FrictionProblem

    Problem = TypeVar("Problem", bound=FrictionProblem)

#: Largest file that is read [bytes].
MOST_BYTES = 1 << 32
_HDF5 = (".hdf5", ".h5")
#: Names of a problem's parts as the datasets of an npz call them.
_PARTS = {"W.data": "W_data", "W.indices": "W_indices", "W.indptr": "W_indptr", "dimension": "d"}


def read_friction_problem(cls: type[Problem], path: Path) -> Problem:
    """See `FrictionProblem.load`."""
    suffix = path.suffix.lower()
    if suffix not in (".npz", ".json", *_HDF5):
        raise refused_file(path, "has no known suffix", "give a file that ends in .npz, .hdf5, .h5 or .json")
    try:
        if path.stat().st_size > MOST_BYTES:
            raise refused_file(path, f"is larger than {MOST_BYTES} bytes", "split the problem")
        found = _read_npz(cls, path) if suffix == ".npz" else _read_other(cls, path, suffix)
    except BuildError as error:
        raise _in_file(path, error) from error
    except OSError as error:
        raise refused_file(path, f"cannot be read: {_reason(error)}", "check the path") from error
    except _MALFORMED as error:
        raise refused_file(path, f"is no friction problem: {str(error)[:200]}", _LAYOUTS) from error
    except (zipfile.BadZipFile, zlib.error, NotImplementedError) as error:
        raise refused_file(path, f"is no archive of arrays: {str(error)[:200]}", _LAYOUTS) from error
    return found if found.name else found.renamed(path.stem)


#: What readers of archives, of array headers and of HDF5 raise on bytes that are none.
_MALFORMED = (
    ValueError, LookupError, TypeError, EOFError, RuntimeError, MemoryError, AttributeError, ArithmeticError,
    SyntaxError, tokenize.TokenError, struct.error,
)  # fmt: skip
_LAYOUTS = "see `carom.FrictionProblem` for the layouts"


def _read_npz(cls: type[Problem], path: Path) -> Problem:
    found = read_npz(path)
    arguments = problem_arguments(found)
    problem = cls(**arguments, body_form=_body_form(found))
    if problem.body_form is not None:
        _check_body_form(problem, problem.body_form)
    return problem


def _read_other(cls: type[Problem], path: Path, suffix: str) -> Problem:
    if suffix == ".json" or _is_contact_problem(path):
        from carom._problem import ContactProblem

        return cls.from_problem(ContactProblem.load(path), source=str(path))
    import h5py

    from carom._friction_problem_fclib import read_fclib

    with h5py.File(path, "r") as file:
        return cls(**read_fclib(file), source=f"FCLIB file {path.name}")


def _is_contact_problem(path: Path) -> bool:
    import h5py

    with h5py.File(path, "r") as file:
        return bool(file.attrs.get("format") == "carom-problem")


def _body_form(found: dict[str, Any]) -> BodyForm | None:
    """The body form that an npz may hold beside W."""
    if "body_M_data" not in found:
        return None

    def matrix(name: str) -> Any:
        parts = [_entry(found, f"body_{name}_{part}") for part in ("data", "indices", "indptr", "shape")]
        return from_compressed(f"body_{name}", *parts)

    has_bilaterals = "body_G_data" in found
    return BodyForm(
        matrix("M"), matrix("H"), _entry(found, "body_f"), _entry(found, "body_w"),
        matrix("G") if has_bilaterals else None, _entry(found, "body_b") if has_bilaterals else None,
    )  # fmt: skip


def _entry(found: dict[str, Any], name: str) -> Any:
    if name not in found:
        raise BuildError(f"{name} is missing; the body form needs it", field=name)
    return found[name]


def _check_body_form(problem: FrictionProblem, body: BodyForm) -> None:
    """Refuses two forms that are different problems: both must give the same velocities for some r."""
    if body.directions.shape[1] != problem.q.size:
        sizes = (body.directions.shape[1], problem.q.size)
        raise refused(None, "body_H", "must have as many columns as W", sizes, "leave the body form out")
    r = np.random.default_rng(0).standard_normal(problem.q.size)
    u = problem.velocity(r)
    by_bodies = body.directions.matrix.T @ body.motion(r)[0] + body.offset
    scale = np.abs(problem.csr.matrix).sum() / max(1, problem.q.size) + np.abs(problem.q).max(initial=0.0)
    apart = float(np.abs(u - by_bodies).max(initial=0.0))
    if apart > 1e-6 * scale:
        raise refused(None, "body form", "must give the same velocities as W and q", f"{apart:.1e} m/s apart",
                      "leave the body form out")  # fmt: skip


def write_friction_problem(
    path: Path, problem: FrictionProblem, impulse: Floats | None, *, whole: bool = False
) -> None:
    """See `FrictionProblem.save`; `whole` writes FCLIB's global form."""
    suffix = path.suffix.lower()
    if suffix not in (".npz", *_HDF5):
        raise refused_file(path, "has no known suffix", "end it in .npz or .hdf5")
    if suffix == ".npz" and impulse is not None:
        raise refused_file(path, "keeps no impulses", "save them with numpy.save, or end the path in .hdf5")
    try:
        if suffix == ".npz":
            write_npz(path, _arrays(problem))
        else:
            from carom._friction_problem_fclib import write_fclib

            write_fclib(path, problem, impulse, whole=whole)
    except BuildError as error:
        raise _in_file(path, error) from error
    except OSError as error:
        raise refused_file(path, f"cannot be written: {_reason(error)}", "choose another path") from error


def _arrays(problem: FrictionProblem) -> dict[str, Any]:
    """What an npz holds."""
    arrays: dict[str, Any] = {
        "kind": problem.kind, "name": problem.name, "source": problem.source,
        "d": np.int64(problem.dimension), **csr_arrays("W", problem.csr), "q": problem.q,
        "meta": json.dumps(dict(problem.meta), default=str),
    }  # fmt: skip
    if problem.kind == "friction":
        arrays["mu"] = problem.mu
    if problem.target is not None:
        arrays["target"] = problem.target
    body = problem.body_form
    if body is not None:
        arrays |= {**csr_arrays("body_M", body.mass), **csr_arrays("body_H", body.directions)}
        arrays |= {"body_f": body.momentum, "body_w": body.offset}
        if body.bilateral is not None:
            arrays |= {**csr_arrays("body_G", body.bilateral), "body_b": body.bilateral_offset}
    return arrays


def refused_file(
    path: Path, problem: str, remedy: str, field: str = "path", value: Any = None
) -> RunFileError:
    """A file that cannot be read or written, in the form of all messages."""
    shown = str(path) if value is None else value
    return RunFileError(
        f"problem file {str(path)!r}: {problem}; {remedy}", field=field, value=shown, remedy=remedy
    )


def _in_file(path: Path, error: CaromError) -> RunFileError:
    """What is wrong with a problem, as what is wrong with the file that holds it."""
    message = str(error)
    if path.suffix.lower() == ".npz":
        for part, name in _PARTS.items():
            message = name + message[len(part) :] if message.startswith(part) else message
    return RunFileError(
        f"problem file {str(path)!r}: {message}", field=error.field, value=error.value, remedy=error.remedy
    )


def _reason(error: OSError) -> str:
    return (error.strerror or str(error).split(",")[0])[:160]


def read_impulse_file(path: Path) -> Floats:
    """Impulses of a ``.npy`` file, or of the solution of an FCLIB file, as they stand [N s].

    Raises
    ------
    RunFileError
        When the file cannot be read as numbers.
    """
    suffix = path.suffix.lower()
    try:
        if path.stat().st_size > MOST_BYTES:
            raise refused_file(path, f"is larger than {MOST_BYTES} bytes", "split the problem")
        if suffix in _HDF5:
            from carom._friction_problem_fclib import read_impulse

            return read_impulse(path)
        if suffix != ".npy":
            raise refused_file(path, "has no known suffix", "give impulses as .npy, or .hdf5 with a solution")
        array = np.lib.format.open_memmap(path, mode="r")
        if array.dtype.kind not in "fiu" or array.ndim > 2:
            raise refused_file(
                path, f"holds a {array.dtype} array of shape {array.shape}", "give impulses in N s"
            )
        return np.array(array, dtype=np.float64)
    except BuildError as error:
        raise _in_file(path, error) from error
    except OSError as error:
        raise refused_file(path, f"cannot be read: {_reason(error)}", "check the path") from error
    except _MALFORMED as error:
        raise refused_file(path, f"holds no impulses: {str(error)[:200]}", "give impulses as .npy") from error


def write_impulse_file(path: Path, problem: FrictionProblem, impulse: Floats) -> None:
    """Writes impulses as ``.npy``, flat (n,), or with their problem as FCLIB's HDF5 [N s].

    Raises
    ------
    RunFileError
        For another suffix, and when the path cannot be written.
    """
    if path.suffix.lower() in _HDF5:
        return write_friction_problem(path, problem, problem.flat(impulse))
    if path.suffix.lower() != ".npy":
        raise refused_file(path, "has no known suffix", "end it in .npy, or .hdf5 for FCLIB")
    try:
        np.save(path, problem.flat(impulse))
    except OSError as error:
        raise refused_file(path, f"cannot be written: {_reason(error)}", "choose another path") from error
