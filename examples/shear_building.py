"""A five-storey shear building under a synthetic earthquake."""

import numpy as np

import spim

STOREYS, STEP = 5, 0.02

M = 2e5 * np.eye(STOREYS)  # kg
K = 1.2e8 * (2.0 * np.eye(STOREYS) - np.eye(STOREYS, k=1) - np.eye(STOREYS, k=-1))  # N/m
K[-1, -1] = 1.2e8
w = spim.StructuralSystem(M, K).modal().frequencies
C = spim.damping.rayleigh(M, K, frequencies=w[:2], ratios=0.05)

# White noise through the ground (Kanai & Tajimi: 15.6 rad/s, 60 %), under an envelope.
ground, ratio = 15.6, 0.6
A = [[0.0, 1.0], [-(ground**2), -2.0 * ratio * ground]]
step_matrix, drive = spim.discretize(A, [[0.0], [1.0]], STEP)
noise = np.random.default_rng(7).normal(size=1000)
x, record = np.zeros(2), []
for k, white in enumerate(noise):
    x = step_matrix @ x + drive[:, 0] * white
    envelope = min(1.0, k / 100) * np.exp(-0.25 * max(0.0, k * STEP - 8.0))
    record.append(envelope * (ground**2 * x[0] + 2.0 * ratio * ground * x[1]))
record = 3.0 * np.array(record) / np.abs(record).max()  # m/s^2

load = spim.loads.GroundMotion(spim.loads.Sampled(record, STEP), np.ones(STOREYS))
building = spim.StructuralSystem(M, K, damping=C, load=load)
end = STEP * (len(record) - 1)
motion = spim.integrate(building, building.state(), (0.0, end), STEP)

drift = np.abs(np.diff(motion.q, axis=1, prepend=0.0)).max(axis=0)
total = motion.a + record[:, None]  # accelerations of the floors, not relative to the ground
print(f"periods: {np.array2string(2.0 * np.pi / w, precision=2)} s")
print(f"largest drifts of the storeys: {np.array2string(1e3 * drift, precision=1)} mm")
print(f"largest acceleration of the roof: {np.abs(total[:, -1]).max():.2f} m/s^2")
