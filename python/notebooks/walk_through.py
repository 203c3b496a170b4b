"""From a scheme to a sweep, a picture and a calibration, without a file."""

import numpy as np

import obsdeg
from obsdeg import campaign

# three drifts, two positions: all are observable; where should a third position be?
pair = obsdeg.Scheme([(0, 0, 0), (180, 0, 0)], carry="inertial", latitude=28.2, terms=["F"])
print(obsdeg.analyze(pair).degrees)
schemes = {turn: pair.replace(positions=[*pair.positions, (turn, 0, 0)]) for turn in range(0, 181, 15)}
rows = campaign.table(dict(scheme=s, noise=1e-5, angle_random_walk=0, tags={"turn": turn}) for turn, s in schemes.items())
sigmas = rows.pivot(index="turn", columns="name", values="sigma")[["D_FX", "D_FY", "D_FZ"]]
sigmas.plot(logy=True, xlabel="third position turned by [deg]", ylabel="sigma at the end [deg/h]")
best = schemes[int(sigmas.max(axis=1).idxmin())]
obsdeg.simulate(best, noise=1e-5, requirement={"D_F": 0.05}).plot()

# its run: psi' = -w x psi + eps in North-Up-East axes, Z1 = psi_z, Z3 = -psi_x, a sample every 10 s
latitude, truth = np.radians(28.2), {"D_FX": 0.02, "D_FY": -0.01, "D_FZ": 0.03}
earth = np.radians(15.041067) / 3600 * np.array([np.cos(latitude), np.sin(latitude), 0])
drift, psi = np.radians(list(truth.values())) / 3600, np.radians([0.002, -0.005, 0.003])
samples = []
for alpha in np.radians([float(angles[0]) for angles in best.angles]):
    turn = np.array([[1, 0, 0], [0, np.cos(alpha), np.sin(alpha)], [0, -np.sin(alpha), np.cos(alpha)]])
    for _ in range(1000):
        psi = psi - np.cross(earth, psi) + turn @ drift
        samples.append((psi[2], -psi[0]))
z = np.array(samples)[9::10] + np.random.default_rng(1).normal(0, 1e-5, (300, 2))
record = {"t [s]": np.arange(1, 301) * 10, "position": np.repeat(["p1", "p2", "p3"], 100), "Z1 [g]": z[:, 0], "Z3 [g]": z[:, 1]}

fit = obsdeg.calibrate(best, record, noise=1e-5)
fit.plot()
print("the model explains the record" if fit.passed else fit.findings)
for name, value in truth.items():
    print(f"{name} = {fit[name].estimate:.4f} +- {fit[name].sigma:.4f} deg/h, true {value}")
