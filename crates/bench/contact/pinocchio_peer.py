"""Pinocchio's contact solvers on one frictional contact problem in space: from zero impulses, their
tolerances tightened tenfold until the measures of the benchmark hold at each asked tolerance.

    python pinocchio_peer.py PROBLEM.bin SOLVER TOLERANCES FIRST REPEATS BUDGET LIMIT OUT
    python pinocchio_peer.py --list

The words mean what they mean for the Siconos program beside this. Pinocchio's contact frame has its normal
last.
Timed: thread CPU time of `solve` alone; calls shorter than SHORT several at a time. The measures here only
steer; another program judges.
"""

import json
import math
import signal
import struct
import sys
import time

import numpy
import pinocchio
import scipy.sparse

# reading the clock takes a good part of a microsecond: calls shorter than this [s] are timed so many at once
# that they fill it together, at most MANY; the timed programs of the others do the same
SHORT, MANY = 20e-6, 64
# what is timed in less is timed by the clock on the wall: it can be repeated until nobody disturbs it, and
# the CPU clock of a machine that others share loses time now and then; the others' programs do the same
BRIEF = 10e-3

SOLVERS = ("pin_admm", "pin_admm_spectral", "pin_admm_linear", "pin_admm_dense", "pin_pgs")


class Problem:
    """The problem of a flat file, with what the measures need."""

    def __init__(self, path):
        """Reads the file."""

        def take(kind, count):
            return numpy.frombuffer(file.read(numpy.dtype(kind).itemsize * count), kind)

        with open(path, "rb") as file:
            d, nc, nnz = struct.unpack("<iii", file.read(12))
            indptr, indices, values = take("<i4", d * nc + 1), take("<i4", nnz), take("<f8", nnz)
            self.q, self.mu = take("<f8", d * nc), take("<f8", nc)
        self.contacts = nc
        self.rows_per_contact = d
        self.matrix = scipy.sparse.csr_matrix((values, indices, indptr), shape=(d * nc, d * nc))
        blocks = [self.matrix[d * i : d * i + d, d * i : d * i + d].toarray() for i in range(nc)]
        self.largest = numpy.array([numpy.linalg.norm(b, 2) or 1.0 for b in blocks])
        self.size = numpy.linalg.norm(self.q) or 1.0

    def project(self, x):
        """Rows of x on the cones."""
        normal, slip = x[:, 0], numpy.linalg.norm(x[:, 1:], axis=1)
        inside, polar = slip <= self.mu * normal, self.mu * slip <= -normal
        out = numpy.where((polar & ~inside)[:, None], 0.0, x)
        edge = ~(inside | polar)
        height = (normal[edge] + self.mu[edge] * slip[edge]) / (1 + self.mu[edge] ** 2)
        out[edge, 0] = height
        out[edge, 1:] = (self.mu[edge] * height / slip[edge])[:, None] * x[edge, 1:]
        return out

    def measure(self, r):
        """Larger of the natural error and a tenth of the scaled one."""
        if not numpy.isfinite(r).all():
            return numpy.inf
        u = (self.matrix @ r.ravel() + self.q).reshape(r.shape)
        u[:, 0] += self.mu * numpy.linalg.norm(u[:, 1:], axis=1)
        natural = numpy.linalg.norm(r - self.project(r - u))
        scaled = numpy.linalg.norm((r - self.project(r - u / self.largest[:, None])) * self.largest[:, None])
        return max(natural, scaled / 10) / self.size


class Peer:
    """One solver with its constraint models."""

    def __init__(self, problem, name):
        """Permutes the problem and makes a model per contact."""
        self.problem, self.name = problem, name
        order = numpy.arange(3 * problem.contacts).reshape(-1, 3)[:, [1, 2, 0]].ravel()
        self.order = order
        self.matrix = scipy.sparse.csc_matrix(problem.matrix[order][:, order])
        self.velocity = problem.q[order].copy()
        model = pinocchio.Model()
        model.addJoint(0, pinocchio.JointModelFreeFlyer(), pinocchio.SE3.Identity(), "free")
        self.models, self.data = pinocchio.StdVec_ConstraintModel(), pinocchio.StdVec_ConstraintData()
        for friction in problem.mu:
            contact = pinocchio.PointContactConstraintModel(model, 1)
            contact.setFriction(float(friction))
            contact = pinocchio.ConstraintModel(contact)
            self.models.append(contact)
            self.data.append(contact.createData())

    def call(self, tolerance, count=1):
        """Impulses of the first of some calls, seconds of one and iterations."""
        states = [self.fresh(tolerance) for _ in range(count)]
        cpu, wall = time.clock_gettime(time.CLOCK_THREAD_CPUTIME_ID), time.perf_counter()
        for solver, operator, settings, result in states:
            solver.solve(operator, self.velocity, self.models, self.data, settings, result)
        spent = time.perf_counter() - wall
        if spent >= BRIEF:
            spent = time.clock_gettime(time.CLOCK_THREAD_CPUTIME_ID) - cpu
        result = states[0][-1]
        r = numpy.empty(3 * self.problem.contacts)
        r[self.order] = result.retrieveConstraintImpulses()
        return self.problem.project(r.reshape(-1, 3)), spent / count, result.iterations

    def fresh(self, tolerance):
        """Solver, operator, settings and result of a call."""
        sweeps = self.name == "pin_pgs"
        settings = pinocchio.PGSSolverSettings() if sweeps else pinocchio.ADMMSolverSettings()
        settings.max_iterations = 1_000_000
        settings.absolute_feasibility_tol = tolerance * self.problem.size
        settings.absolute_complementarity_tol = tolerance * self.problem.size
        settings.relative_feasibility_tol = settings.relative_complementarity_tol = 0.0
        if not sweeps:
            rules = pinocchio.ADMMUpdateRule
            chosen = {"pin_admm_spectral": rules.SPECTRAL, "pin_admm_linear": rules.LINEAR}
            settings.admm_update_rule = chosen.get(self.name, rules.OSQP)
        dense = sweeps or self.name == "pin_admm_dense"
        kind = pinocchio.DelassusOperatorDense if dense else pinocchio.DelassusOperatorSparse
        operator = kind(self.matrix.toarray() if dense else self.matrix)
        solver = pinocchio.PGSConstraintSolver() if sweeps else pinocchio.ADMMConstraintSolver()
        result = pinocchio.PGSSolverResult() if sweeps else pinocchio.ADMMSolverResult()
        return solver, operator, settings, result


def climb(peer, wanted, own, first, limit):
    """The loosest own tolerance, by steps of ten and then half a step, that reaches the wanted measure."""

    def attempt(tolerance):
        signal.setitimer(signal.ITIMER_PROF, limit)
        r, seconds, iterations = peer.call(tolerance)
        signal.setitimer(signal.ITIMER_PROF, 0)
        return tolerance, r, seconds, iterations, peer.problem.measure(r)

    spent = 0.0
    while own > 1e-17:
        done = attempt(own)
        spent += done[2]
        if done[4] <= wanted:
            if own < first:
                looser = attempt(own * 10**0.5)
                if looser[4] <= wanted and looser[2] < done[2]:
                    done = looser
            return done
        if spent > 3 * limit:
            return None
        own *= 0.1
    return None


def main(words):
    """Runs the command line; the exit status."""
    if words == ["--list"]:
        print("\n".join(f"3 {name}" for name in SOLVERS))
        return 0
    path, name, tolerances, first, repeats, budget, limit, out = words
    problem = Problem(path)
    if name not in SOLVERS or problem.rows_per_contact != 3:
        print(f"no solver {name} for {problem.rows_per_contact} rows per contact", file=sys.stderr)
        return 2
    peer, own = Peer(problem, name), numpy.inf
    for asked in tolerances.split(","):
        wanted = float(asked)
        start = min(own, wanted * float(first))
        done = climb(peer, wanted, start, start, float(limit))
        if done is None:
            return 1
        own, r, seconds, iterations, error = done
        spent = seconds
        for _ in range(1, int(repeats)):
            if spent + seconds >= float(budget):
                break
            count = min(MANY, math.ceil(SHORT / seconds)) if seconds < SHORT else 1
            again = peer.call(own, count)[1]
            spent += count * again
            seconds = min(seconds, again)
        saved = f"{out}.{asked}.bin"
        r.astype("<f8").tofile(saved)
        line = {"solver": name, "tolerance": wanted, "own_tolerance": own, "seconds": seconds}
        line |= {"iterations": iterations, "steering_error": error, "impulses": saved}
        with open(f"{out}.jsonl", "a") as file:
            file.write(json.dumps(line) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
