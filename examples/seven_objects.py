"""The notes' seven objects between walls: the contact problem as a matrix, solved in two forms."""

import numpy as np

import carom

w = carom.build_scene("seven_objects")
w.run(0.5)
problem = w.problem()
print(problem)
print("A is", problem.A.shape, "with", problem.A.nnz, "entries")

sweep = problem.solve("pgs", iterations=20000, tolerance=1e-12)
matrix = problem.solve("pgs_matrix", iterations=20000, tolerance=1e-12)
print("residuals", sweep.residual, matrix.residual)
assert np.allclose(sweep.impulse, matrix.impulse, atol=1e-12)
