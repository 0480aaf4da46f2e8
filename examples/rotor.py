"""A rigid rotor on springs: gyroscopic splitting, and unbalance through a critical speed."""

import numpy as np

import spim

# q = [x, y, tilt about x, tilt about y]; kg, kg m^2, N/m, N m.
M = np.diag([50.0, 50.0, 2.0, 2.0])
K = np.diag([2e6, 2e6, 8e4, 8e4])
C = spim.damping.rayleigh(M, K, alpha=4.0, beta=0.0)
POLAR = 3.0  # kg m^2

for speed in (0.0, 100.0, 200.0, 400.0):
    G = np.zeros((4, 4))
    G[2, 3], G[3, 2] = POLAR * speed, -POLAR * speed
    free = spim.StructuralSystem(M, K, gyroscopic=G)
    whirl = np.sort(np.abs(np.linalg.eigvals(free.A).imag))[::2]
    print(f"{speed:5.0f} rad/s: whirl at {np.array2string(whirl, precision=1)} rad/s")

print("orbit of the centre for 1e-3 kg m of unbalance, after 5 s:")
for speed in (100.0, 190.0, 200.0, 210.0, 400.0):
    load = spim.loads.Unbalance(1e-3, speed, dofs=(0, 1))
    rotor = spim.StructuralSystem(M, K, damping=C, load=load)
    turn = 2.0 * np.pi / speed
    run = spim.integrate(rotor, rotor.state(), (0.0, 800 * turn), turn / 8)
    radius = np.hypot(*run.q[-8:, :2].T).mean()
    print(f"{speed:5.0f} rad/s: {1e6 * radius:7.2f} um")
