"""A linear autoencoder and Xi in NumPy to LaTeX, C, rollouts and a controller step; run from the repository's root."""
import glob

import numpy as np
import romc

jumps = [romc.read(path) for path in sorted(glob.glob("examples/recordings/go1/train_*.csv.gz"))]
x, dx, ddx, u = map(np.vstack, zip(*[(j.x, j.dx, j.ddx, j.inputs("go1")) for j in jumps]))
contact, mean = np.vstack([j.feet for j in jumps]).any(axis=1), x.mean(axis=0)
W = np.linalg.svd(x - mean, full_matrices=False)[2][:6]  # principal components
z, dz, ddz, u_lat = (x - mean) @ W.T, dx @ W.T, ddx @ W.T, u @ np.linalg.pinv(W)
theta = np.hstack([np.ones((len(z), 1)), z, dz, u_lat])
xi = {phase: np.linalg.lstsq(theta[rows], ddz[rows], rcond=None)[0]
      for phase, rows in [("contact", contact), ("flight", ~contact)]}
model = romc.Model.from_arrays(encoder=(W, -W @ mean), decoder=(W.T, mean), xi=xi, robot="go1", name="pca",
                               library=romc.Library(degree=1, inputs=True), inputs_from=jumps)
print(model.equations(significant=3).latex())
print(*model.compile(["latex", "c"], "out/pca"), sep="\n")
test = romc.read("examples/recordings/go1/test_01.csv.gz")
print("rms of body.z, m:", model.simulate(test).rms("body.z"))
command = romc.Controller(model, horizon=20).set_reference(test).step(test.t[0], test.x[0], test.dx[0], test.feet[0])
print(command.status, command.torque)
