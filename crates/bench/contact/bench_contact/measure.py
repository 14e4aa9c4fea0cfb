"""The judge: measures of impulses against a frictional contact problem or a linear complementarity problem.

u = W r + q in contact frames, normal first; u_hat = u + mu |u_T| n; K the cone |r_T| <= mu r_N. Errors are
those of Acary, Bremond and Huber (2018) and the same in velocity units. Written from the definitions, shares
nothing with any solver that it judges.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy
from numpy.typing import NDArray

Array = NDArray[numpy.float64]


@dataclass(frozen=True)
class Problem:
    """W in compressed rows, q [m/s] of shape (d nc,), mu of shape (nc,); d = 1: a complementarity problem."""

    name: str
    rows_per_contact: int
    starts: NDArray[numpy.int64]
    columns: NDArray[numpy.int64]
    values: Array
    velocity: Array
    friction: Array

    @property
    def contacts(self) -> int:
        """Number of contacts."""
        return len(self.friction)

    def times(self, r: Array) -> Array:
        """W r, of shape (d nc,)."""
        row_of = numpy.repeat(numpy.arange(len(self.starts) - 1), numpy.diff(self.starts))
        products = self.values * r[self.columns]
        return numpy.bincount(row_of, products, minlength=len(self.velocity)).astype(float)

    def diagonal_norms(self) -> Array:
        """Spectral norm of each diagonal block of W, 1 where it is 0; shape (nc,)."""
        d = self.rows_per_contact
        row_of = numpy.repeat(numpy.arange(len(self.starts) - 1), numpy.diff(self.starts))
        own = row_of // d == self.columns // d
        blocks = numpy.zeros((self.contacts, d, d))
        where = (row_of[own] // d, row_of[own] % d, self.columns[own] % d)
        numpy.add.at(blocks, where, self.values[own])
        norms = numpy.linalg.norm(blocks, 2, axis=(1, 2))
        return numpy.where(norms > 0, norms, 1.0)


@dataclass(frozen=True)
class Measure:
    """Errors of impulses; every one is 0 exactly at a solution."""

    natural: float
    scaled: float
    cone: float

    def solves(self, tolerance: float) -> bool:
        """True when natural <= tolerance, scaled <= 10 tolerance and cone <= 1e-12."""
        return self.natural <= tolerance and self.scaled <= 10 * tolerance and self.cone <= 1e-12


def projected(x: Array, friction: Array) -> Array:
    """Rows (normal, tangents) of x, each moved to the nearest point of its cone."""
    normal, tangent = x[:, 0], numpy.sqrt((x[:, 1:] ** 2).sum(axis=1))
    height = (normal + friction * tangent) / (1.0 + friction**2)
    with numpy.errstate(invalid="ignore", divide="ignore"):
        on_edge = numpy.column_stack([height, (friction * height / tangent)[:, None] * x[:, 1:]])
    inside = tangent <= friction * normal
    behind = (friction * tangent <= -normal) & ~inside
    return numpy.where(inside[:, None], x, numpy.where(behind[:, None], 0.0, on_edge))


def measured(problem: Problem, impulses: Array) -> Measure:
    """Measures of impulses of shape (d nc,); infinite where they are not finite."""
    worst = Measure(numpy.inf, numpy.inf, numpy.inf)
    if impulses.shape != problem.velocity.shape or not numpy.isfinite(impulses).all():
        return worst
    u = problem.times(impulses) + problem.velocity
    size = float(numpy.linalg.norm(problem.velocity))
    if problem.rows_per_contact == 1:
        lower = float(numpy.linalg.norm(numpy.minimum(impulses, u))) / max(1.0, size)
        largest = max(float(abs(impulses).max(initial=0.0)), 1e-300)
        return Measure(lower, lower, max(0.0, float(-impulses.min(initial=0.0))) / largest)
    size = size if size > 0 else 1.0
    r, u = impulses.reshape(problem.contacts, -1), u.reshape(problem.contacts, -1)
    u_hat = u.copy()
    u_hat[:, 0] += problem.friction * numpy.sqrt((u[:, 1:] ** 2).sum(axis=1))
    norms = problem.diagonal_norms()[:, None]
    natural = r - projected(r - u_hat, problem.friction)
    scaled = (r - projected(r - u_hat / norms, problem.friction)) * norms
    outside = numpy.sqrt((r[:, 1:] ** 2).sum(axis=1)) - problem.friction * r[:, 0]
    strongest = max(float(numpy.sqrt((r**2).sum(axis=1)).max(initial=0.0)), 1e-300)
    cone = max(0.0, float(outside.max(initial=0.0)), float((-r[:, 0]).max(initial=0.0)))
    return Measure(
        float(numpy.linalg.norm(natural)) / size, float(numpy.linalg.norm(scaled)) / size, cone / strongest
    )
