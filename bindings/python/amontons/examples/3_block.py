"""A contact problem of its own."""
import amontons as am
import numpy as np

W, q, mu = np.eye(3), 10 / np.sqrt(2) * np.array([-1, 1, 0.0]), 0.5
s = am.solve(W, q, mu, tolerance=1e-12)
assert s and np.allclose(s.reaction, [7.0710678119, -3.5355339059, 0])
try:
    am.solve(np.eye(4), q, mu)
except am.InputError as error:
    print(error.issues[0]["place"], error.issues[0]["found"])        # W 4 x 4
problem = am.ContactProblem(W, q, mu)
am.write_fclib("block.hdf5", problem, s)
again = am.read_fclib("block.hdf5")
r = am.solve(again.W, again.q, again.mu, solver="nsgs", warm_start=s.reaction)
print(r.status, r.error, r.iterations, am.certify(W, q, mu, r.reaction).worst_penetration)
