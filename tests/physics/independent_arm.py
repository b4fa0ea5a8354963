"""The arm's equations written a second time, without the kernel and without MuJoCo, for scipy.

State: angle, rate, and per muscle the Bouc-Wen variable, the length that the muscle has left on its
tendon (not the extension of the chain) and the absolute pressure itself (not the air state y), so
that even chain and chamber are integrated in another form.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.integrate import solve_ivp


class IndependentArm:
    """MAS-20 arm from a rig's numbers, for one load."""

    def __init__(self, rig, load):
        muscle = rig.muscles["muscle_1"]
        self.m = muscle
        model = rig.model_for(load=load)
        joint = model.joint("shaft")
        self.damping = float(joint.damping[0])
        self.radius = abs(float(model.wrap_prm[model.tendon("chain_1").id]))
        self.tilt = 2.0 * math.atan2(*model.body("rig").quat[[1, 0]])
        self.inertia, self.moment = 0.0, 0.0
        for name in ("arm", "load"):
            body = model.body(name)
            index = body.id
            # Distance of the centre of mass from the shaft, at rest, along the arm.
            centre = np.array(model.body_ipos[index])
            if name == "load":
                centre = centre + np.array(model.body_pos[index])
            reach = centre[:2]
            mass = float(model.body_mass[index])
            self.inertia += mass * float(reach @ reach) + self._vertical_inertia(model, index)
            self.moment += mass * float(np.linalg.norm(reach))
            self.direction = math.atan2(reach[1], reach[0])
        self.gravity = float(-model.opt.gravity[2])

    @staticmethod
    def _vertical_inertia(model, index):
        quat = model.body_iquat[index]
        w, x, y, z = quat
        vertical = np.array(
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]
        )  # third row of the rotation: the vertical in the inertia's own axes
        return float(vertical**2 @ model.body_inertia[index])

    def force(self, length, pressure, z):
        m, f = self.m, self.m.force
        grown = 1.0 + m.braid.extensibility * max(pressure, 0.0)
        kappa = 1.0 - length / m.braid.nominal_length / grown
        decay = math.exp(f.c * kappa)
        active = (f.a * pressure + f.b) * decay + f.d * pressure * kappa + f.e * pressure + f.f
        passive = self.spring(m.passive.slack_contraction - kappa)
        loop = (m.hysteresis.force + m.hysteresis.force_per_pressure * max(pressure, 0.0)) * z
        return max(0.0, f.scale * active + passive - loop)

    def spring(self, stretch):
        p = self.m.passive
        if stretch < 0.0:
            return p.stiffness / p.softening * (math.exp(p.softening * stretch) - 1.0)
        inside = stretch if p.locking == 0.0 else min(stretch, 0.95 / p.locking)
        room = (1.0 - inside * p.locking) * (1.0 + inside * p.locking)
        slope = (2.0 - room) / room**2  # derivative of x / (1 - (x/x_lock)^2)
        return p.stiffness * (inside / room + slope * (stretch - inside))

    def volume(self, length):
        braid = self.m.braid
        fibre = braid.nominal_length / math.cos(braid.fibre_angle)
        turns = fibre * math.sin(braid.fibre_angle) / (math.pi * braid.diameter)
        inside = length * (fibre**2 - length**2) / (4 * math.pi * turns**2)
        slope = (fibre**2 - 3 * length**2) / (4 * math.pi * turns**2)
        return inside + self.m.chamber.dead_volume, slope

    def flow(self, pressure_abs, set_point):
        chamber, valve = self.m.chamber, self.m.valve
        opening = (set_point - (pressure_abs - chamber.atmosphere)) / valve.regulator_band
        opening = min(1.0, max(-1.0, opening))
        supply = valve.supply_pressure + chamber.atmosphere
        if opening > 0:
            return opening * self.nozzle(supply, pressure_abs, valve.conductance_fill)
        return opening * self.nozzle(pressure_abs, chamber.atmosphere, valve.conductance_exhaust)

    def nozzle(self, up, down, conductance):
        if down > up:
            return -self.nozzle(down, up, conductance)
        b, laminar = self.m.valve.critical_ratio, self.m.valve.laminar_ratio
        ratio = down / up

        def ellipse(r):
            return math.sqrt(1.0 - ((r - b) / (1.0 - b)) ** 2) if r > b else 1.0

        share = (
            ellipse(ratio)
            if ratio < laminar
            else ellipse(laminar) * (1.0 - ratio) / (1.0 - laminar)
        )
        density, reference = 1.185, 293.15
        return (
            conductance * density * up * math.sqrt(reference / self.m.chamber.temperature) * share
        )

    def rates(self, time, state, set_points):
        angle, rate = state[0], state[1]
        out = np.empty(8)
        torque = 0.0
        for i, sign in enumerate((-1.0, 1.0)):
            z, length, pressure_abs = state[2 + 3 * i : 5 + 3 * i]
            tension = self.force(length, pressure_abs - self.m.chamber.atmosphere, z)
            torque -= sign * self.radius * tension
            speed = sign * self.radius * rate
            chain = self.m.chain
            if chain.compliance > 0.0:
                give = self.m.mounting.length_at_zero + sign * self.radius * angle - length
                speed -= (chain.compliance * tension - give) / chain.relaxation_time
            shortening = -speed / self.m.braid.nominal_length
            h = self.m.hysteresis
            size = abs(z) ** h.sharpness
            sense = math.copysign(1.0, z * shortening) if z * shortening != 0 else -1.0
            blocked = size * (h.sigma * sense + 1.0 - h.sigma)
            out[2 + 3 * i] = shortening / h.yield_contraction * (1.0 - blocked)
            out[3 + 3 * i] = speed
            volume, slope = self.volume(length)
            chamber = self.m.chamber
            supplied = 287.05 * chamber.temperature * self.flow(pressure_abs, set_points[i])
            swept = pressure_abs * slope * speed
            out[4 + 3 * i] = chamber.polytropic_index * (supplied - swept) / volume
        # A rig tilted about x: gravity has a component -g sin(tilt) along the tilted y axis.
        along = self.direction + angle
        torque -= self.moment * self.gravity * math.sin(self.tilt) * math.cos(along)
        out[0] = rate
        out[1] = (torque - self.damping * rate) / self.inertia
        return out

    def run(self, start, set_points, duration, samples):
        atmosphere = self.m.chamber.atmosphere
        length = self.m.mounting.length_at_zero
        muscles = [[0.0, length, pressure + atmosphere] for pressure in start]
        at_rest = np.array([0.0, 0.0, *muscles[0], *muscles[1]])
        options = {"method": "LSODA", "rtol": 1e-9, "atol": 1e-10, "max_step": 0.01}
        settled = solve_ivp(self.rates, (0, 4.0), at_rest, args=(start,), **options).y[:, -1]
        grid = np.linspace(0.0, duration, samples)
        found = solve_ivp(
            self.rates, (0, duration), settled, args=(set_points,), t_eval=grid, **options
        )
        assert found.success, found.message
        return found.y[0], found.y[[4, 7]].T - atmosphere
