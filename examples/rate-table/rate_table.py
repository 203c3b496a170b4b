"""A simulated rate table on loopback, and a controller that plays a sheet of `obsdeg procedure` on it.

    obsdeg procedure examples/rate-table/scheme.toml --settle 20 -o run
    python examples/rate-table/rate_table.py run
    obsdeg calibrate run/scheme.toml run/record.csv

The table holds a platform with gyro drifts and a misalignment that the controller does not know. It is told to turn, to rest and to
read, one JSON object per line; its clock runs as fast as it computes. The simulation is independent of obsdeg: the attitude is a
matrix that the torquing rates and the drifts turn, the specific force is exact.
"""

from __future__ import annotations

import csv
import json
import math
import random
import socket
import socketserver
import sys
import threading
from pathlib import Path
from typing import Any

EARTH_RATE = 7.292115e-5
NORTH, UP, EAST = range(3)
Vector = list[float]
Matrix = list[Vector]


def multiply(a: Matrix, b: Matrix) -> Matrix:
    """Product of two matrices of three rows."""
    return [[sum(a[i][k] * b[k][j] for k in range(3)) for j in range(3)] for i in range(3)]


def turned(rows: Matrix, vector: Vector) -> Vector:
    """Product of a matrix and a vector."""
    return [sum(r * v for r, v in zip(row, vector)) for row in rows]


def transposed(a: Matrix) -> Matrix:
    """Transpose of a matrix."""
    return [list(column) for column in zip(*a)]


def rotation(v: Vector) -> Matrix:
    """Active rotation by the vector `v` in rad (Rodrigues)."""
    angle = math.sqrt(sum(x * x for x in v))
    s, c = (1.0, 0.5) if angle < 1e-12 else (math.sin(angle) / angle, (1 - math.cos(angle)) / angle**2)
    x, y, z = v
    k = [[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]
    square = multiply(k, k)
    return [[float(i == j) + s * k[i][j] + c * square[i][j] for j in range(3)] for i in range(3)]


def attitude(alpha: float, beta: float, gamma: float) -> Matrix:
    """C_c^n = Mx(alpha) My(beta) Mz(gamma) of the passive elementary matrices; angles in degrees."""
    (ca, sa), (cb, sb), (cg, sg) = ((math.cos(math.radians(x)), math.sin(math.radians(x))) for x in (alpha, beta, gamma))
    outer = [[1.0, 0.0, 0.0], [0.0, ca, sa], [0.0, -sa, ca]]
    middle = [[cb, 0.0, -sb], [0.0, 1.0, 0.0], [sb, 0.0, cb]]
    inner = [[cg, sg, 0.0], [-sg, cg, 0.0], [0.0, 0.0, 1.0]]
    return multiply(multiply(outer, middle), inner)


class Platform:
    """Platform with drifts: `c` is the attitude that the torquing computes, `p` the true one (axes to North, Up, East)."""

    def __init__(self, drifts: dict[str, float], tilt_deg: Vector, latitude_deg: float, noise_g: float, seed: int) -> None:
        latitude = math.radians(latitude_deg)
        self.earth = [EARTH_RATE * math.cos(latitude), EARTH_RATE * math.sin(latitude), 0.0]
        self.drifts, self.tilt, self.noise = drifts, [math.radians(x) for x in tilt_deg], noise_g
        self.random = random.Random(seed)
        self.c = self.p = attitude(0.0, 0.0, 0.0)
        self.time = 0.0

    def set(self, gimbals: Vector) -> None:
        """Levels and aligns the platform at these gimbal angles, but for a tilt in its own axes."""
        self.c = attitude(*gimbals)
        self.p = multiply(self.c, rotation(self.tilt))

    def drift(self) -> Vector:
        """Drift rates in the platform axes in rad/s, of the gyros of Ding, Cai, Huang 2017."""
        g = [-self.p[UP][k] for k in range(3)]
        d = self.drifts
        x = d["D_FX"] + d["D_IX"] * g[0] + d["D_SX"] * g[1] - d["D_OX"] * g[2]
        y = d["D_FY"] + d["D_IY"] * g[1] - d["D_SY"] * g[0] - d["D_OY"] * g[2]
        z = d["D_FZ"] + d["D_IZ"] * g[2] + d["D_SZ"] * g[1] + d["D_OZ"] * g[0]
        return [math.radians(rate) / 3600.0 for rate in (x, y, z)]

    def rate(self, c: Matrix, p: Matrix, slew: Vector) -> Vector:
        """Rate of the true platform against the earth in its own axes: torquing and drift, less the earth rate."""
        torqued = [w + s for w, s in zip(turned(transposed(c), self.earth), slew)]
        earth = turned(transposed(p), self.earth)
        return [t + e - w for t, e, w in zip(torqued, self.drift(), earth)]

    def advance(self, seconds: float, slew: Vector, longest: float) -> None:
        """Turns the platform for a time, with the torquing rate `slew` in rad/s about its axes besides the earth rate."""
        steps = max(1, math.ceil(seconds / longest - 1e-9))
        dt = seconds / steps
        for _ in range(steps):
            # the rate in the middle of the step
            first = self.rate(self.c, self.p, slew)
            c, p = (multiply(m, rotation([dt / 2 * w for w in v])) for m, v in ((self.c, slew), (self.p, first)))
            middle = self.rate(c, p, slew)
            self.c = multiply(self.c, rotation([dt * w for w in slew]))
            self.p = multiply(self.p, rotation([dt * w for w in middle]))
        self.time += seconds

    def force(self) -> Vector:
        """Outputs of the accelerometers in g: the specific force is up."""
        return [self.p[UP][k] + self.random.gauss(0.0, self.noise) for k in range(3)]

    def do(self, command: dict[str, Any]) -> dict[str, Any]:
        """Executes a command; returns the time, and the rows that were read."""
        rows: list[Vector] = []
        if command["do"] == "set":
            self.set(command["gimbals_deg"])
        elif command["do"] == "turn":
            rate = math.radians(command["rate_deg_s"])
            slew = [rate * x for x in command["about_platform"]]
            self.advance(command["angle_deg"] / command["rate_deg_s"], slew, 0.25)
        elif command["do"] == "rest":
            self.advance(command["seconds"], [0.0, 0.0, 0.0], 2.0)
        elif command["do"] == "read":
            every = command["every_s"]
            for _ in range(round(command["seconds"] / every)):
                self.advance(every, [0.0, 0.0, 0.0], 2.0)
                rows.append([self.time, *self.force()])
        else:
            raise ValueError(f"unknown command {command['do']!r}")
        return {"time_s": self.time, "rows": rows}


class Server(socketserver.ThreadingTCPServer):
    """Server of one platform on loopback."""

    allow_reuse_address = True
    daemon_threads = True

    def __init__(self, platform: Platform) -> None:
        self.platform = platform
        super().__init__(("127.0.0.1", 0), Handler)

    def __enter__(self) -> Server:
        threading.Thread(target=self.serve_forever, daemon=True).start()
        return self

    def __exit__(self, *_: object) -> None:
        self.shutdown()
        self.server_close()


class Handler(socketserver.StreamRequestHandler):
    """A line with a command, a line with the answer."""

    server: Server

    def handle(self) -> None:
        for line in self.rfile:
            answer = self.server.platform.do(json.loads(line))
            self.wfile.write(json.dumps(answer).encode() + b"\n")


class StoppedError(Exception):
    """A reading outside its tolerance."""


def play(sheet: dict[str, Any], address: tuple[str, int], every_s: float) -> list[list[Any]]:
    """Plays the steps of a sheet on the table at `address`; returns the rows of the record.

    Raises:
        StoppedError: a reading outside the tolerance of its step.
    """
    record: list[list[Any]] = []
    with socket.create_connection(address) as connection, connection.makefile("rw", encoding="utf-8", newline="\n") as lines:

        def ask(**command: Any) -> Any:
            lines.write(json.dumps(command) + "\n")
            lines.flush()
            return json.loads(lines.readline())

        for step in sheet["steps"]:
            kind, turn = step["kind"], step["turn"]
            if kind == "set":
                ask(do="set", gimbals_deg=step["gimbals_deg"])
            elif kind == "turn":
                ask(do="turn", about_platform=turn["about_platform"], angle_deg=turn["angle_deg"], rate_deg_s=turn["rate_deg_s"])
            elif kind in ("wait", "record"):
                rows = ask(do="read", seconds=step["duration_s"], every_s=every_s)["rows"]
                for read, expected in zip(rows[0][1:], step["force_g"]):
                    if abs(read - expected) > step["tolerance_g"]:
                        raise StoppedError(
                            f"step {step['number']}, {step['position']}: read {read:.4f} g, expected {expected:.4f} +- {step['tolerance_g']:.4f} g"
                        )
                record += [[round(t, 6), step["position"], *(round(f, 9) for f in force)] for t, *force in rows]
    return record


def write(rows: list[list[Any]], path: Path) -> None:
    """Adds the rows to the record, whose header is there."""
    with open(path, "a", encoding="utf-8", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows(rows)


def drawn(seed: int, deviations: dict[str, float]) -> dict[str, float]:
    """Drifts drawn from normal distributions with these standard deviations, by family (D_F, D_I, D_O, D_S)."""
    source = random.Random(seed)
    return {family + axis: source.gauss(0.0, sigma) for family, sigma in deviations.items() for axis in "XYZ"}


def main(folder: Path) -> None:
    """Plays the sheet in a folder of `obsdeg procedure -o`, and fills its record."""
    if any(line[:1].isdigit() for line in (folder / "record.csv").read_text(encoding="utf-8").splitlines()):
        sys.exit(f"{folder / 'record.csv'} is filled already")
    sheet = json.loads((folder / "procedure.json").read_text(encoding="utf-8"))
    drifts = drawn(7, {"D_F": 0.4, "D_I": 0.3, "D_O": 0.3, "D_S": 0.3})
    conditions = sheet["conditions"]
    platform = Platform(drifts, [0.02, -0.03, 0.01], conditions["latitude_deg"], conditions["accelerometer_noise_g"], 7)
    with Server(platform) as server:
        rows = play(sheet, ("127.0.0.1", server.server_address[1]), sheet["row_s"])
    write(rows, folder / "record.csv")
    print(f"{len(rows)} rows; true drifts in deg/h, deg/h/g:")
    print("  " + ", ".join(f"{name} {value:.4f}" for name, value in drifts.items()))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
