"""The arm's equations written a second time, without the kernel and without MuJoCo, for scipy.

State: angle, rate, and per muscle the Bouc-Wen variable, the length that the muscle has left on its
tendon (not the extension of the chain), the absolute pressure itself (not the air state y), the
strain of the creeping element (not its damper's), the set point on its line and the force of the
bristles along its tendon, so that even chain, chamber and creep are integrated in another form.
Last comes the sag of the supply that both share.
Left out: play of the chain, dead zone, delay.
"""

from __future__ import annotations

import dataclasses
import functools
import math

import numpy as np
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq


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

    def force(self, length, pressure, z, strain=0.0, shortening=0.0):
        m, f = self.m, self.m.force
        grown = 1.0 + m.braid.extensibility * max(pressure, 0.0)
        kappa = 1.0 - length / m.braid.nominal_length / grown
        decay = math.exp(f.c * kappa)
        active = (f.a * pressure + f.b) * decay + f.d * pressure * kappa + f.e * pressure + f.f
        end = m.end_shape
        beyond = max(kappa - end.onset, 0.0) / 0.1
        active *= f.scale * (1.0 - end.loss + end.loss / (1.0 + beyond**2))
        passive = self.spring(m.passive.slack_contraction - kappa)
        loop = (m.hysteresis.force + m.hysteresis.force_per_pressure * max(pressure, 0.0)) * z
        loop += m.braid.friction * max(pressure, 0.0) * shortening
        return max(0.0, active + passive - loop - m.creep.stiffness * strain)

    def spring(self, stretch):
        p = self.m.passive
        if stretch < 0.0:
            return p.stiffness / p.softening * (math.exp(p.softening * stretch) - 1.0)
        inside = stretch if p.locking == 0.0 else min(stretch, 0.95 / p.locking)
        room = (1.0 - inside * p.locking) * (1.0 + inside * p.locking)
        slope = (2.0 - room) / room**2  # derivative of x / (1 - (x/x_lock)^2)
        return p.stiffness * (inside / room + slope * (stretch - inside))

    @functools.cached_property
    def per_pressure(self):
        """dF/dp of the active force over contraction [m^2], on a fine grid as a spline."""
        kappa = np.linspace(-0.3, 0.5, 16001)
        f, end = self.m.force, self.m.end_shape
        beyond = np.maximum(kappa - end.onset, 0.0) / 0.1
        left = 1.0 - end.loss + end.loss / (1.0 + beyond**2)
        slope = f.scale * left * (f.a * np.exp(f.c * kappa) + f.d * kappa + f.e)
        return CubicSpline(kappa, slope)

    @functools.cached_property
    def gained(self):
        """Its integral from nominal length: the volume gained, per nominal length [m^2]."""
        return self.per_pressure.antiderivative()

    def volume(self, length):
        braid = self.m.braid
        kappa = 1.0 - length / braid.nominal_length
        cylinder = math.pi * braid.diameter**2 / 4 * braid.nominal_length
        gained = float(self.gained(kappa) - self.gained(0.0)) * braid.nominal_length
        inside = cylinder + self.m.chamber.dead_volume + gained
        return inside, -float(self.per_pressure(kappa))

    def opening(self, pressure_abs, set_point):
        error = set_point - (pressure_abs - self.m.chamber.atmosphere)
        return min(1.0, max(-1.0, error / self.m.valve.regulator_band))

    def flow(self, opening, pressure_abs, sag):
        chamber, valve = self.m.chamber, self.m.valve
        leak = self.nozzle(pressure_abs, chamber.atmosphere, chamber.leak_conductance)
        if opening > 0:
            return self.fill(opening, pressure_abs, sag) - leak
        vent = opening * self.nozzle(pressure_abs, chamber.atmosphere, valve.conductance_exhaust)
        return vent - leak

    def fill(self, opening, pressure_abs, sag):
        valve = self.m.valve
        line = valve.supply_pressure + self.m.chamber.atmosphere - sag
        return self.nozzle(line, pressure_abs, max(opening, 0.0) * valve.conductance_fill)

    def supply(self, openings, pressures_abs, sag):
        """Sag of the supply of both muscles, and its rate; without volume it needs no memory."""
        valve, chamber = self.m.valve, self.m.chamber
        if valve.supply_resistance == 0.0:
            return 0.0, 0.0

        def rise(sag):
            drawn = sum(map(self.fill, openings, pressures_abs, (sag, sag)))
            return drawn - sag / valve.supply_resistance

        if valve.supply_volume > 0.0:
            return sag, rise(sag) * 287.05 * chamber.temperature / valve.supply_volume
        source = valve.supply_pressure + chamber.atmosphere
        ends = [0.0, *(source - pressure for pressure in pressures_abs)]
        if rise(min(ends)) <= 0.0:  # all shut
            return 0.0, 0.0
        return brentq(rise, min(ends), max(ends), xtol=1e-9, rtol=1e-12), 0.0

    def brake(self, speed):
        friction = self.m.friction
        share = speed / friction.stribeck_velocity
        return friction.stribeck_force * share * math.exp((1.0 - share**2) / 2.0)

    def teeth(self, travel):
        """Travel of the chain behind the sprocket's teeth, and its slope."""
        chain = self.m.chain
        turn = 2.0 * math.pi / chain.ripple_pitch
        wave = turn * travel + chain.ripple_phase
        return travel + chain.ripple * math.sin(wave), 1.0 + chain.ripple * turn * math.cos(wave)

    def bristles(self, force, speed, tension):
        """Rate of the dry friction along a tendon, and what its damping adds to it."""
        friction = self.m.friction
        always = friction.coulomb_force + friction.tension_share * tension
        if always + friction.breakaway_force == 0.0:
            return 0.0, 0.0
        lost = math.exp(-((speed / friction.stribeck_velocity) ** 2))
        stiffness = (always + friction.breakaway_force) / friction.presliding
        sliding = always + friction.breakaway_force * lost
        rate = stiffness * (speed - abs(speed) * force / sliding)
        return rate, friction.bristle_time * rate

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
        out = np.empty(15)
        torque = 0.0
        lag = self.m.valve.line_lag
        commanded = state[[6, 12]] if lag else set_points
        openings = list(map(self.opening, state[[4, 10]], commanded))
        sag, out[14] = self.supply(openings, state[[4, 10]], state[14])
        for i, sign in enumerate((-1.0, 1.0)):
            z, length, pressure_abs, strain, carried, rubbing = state[2 + 6 * i : 8 + 6 * i]
            speed = sign * self.radius * rate
            behind, ratio = self.teeth(sign * self.radius * angle)
            gauge = pressure_abs - self.m.chamber.atmosphere
            rubbed = -ratio * speed / self.m.braid.nominal_length
            tension = self.force(length, gauge, z, strain, rubbed)
            out[7 + 6 * i], damped = self.bristles(rubbing, speed, tension)
            brake = self.brake(speed) + rubbing + damped
            torque -= sign * self.radius * (ratio * tension + brake)
            speed *= ratio
            chain = self.m.chain
            if chain.compliance > 0.0:
                give = self.m.mounting.length_at_zero + behind - length
                speed -= (chain.compliance * tension - give) / chain.relaxation_time
            shortening = -speed / self.m.braid.nominal_length
            h = self.m.hysteresis
            size = abs(z) ** h.sharpness
            sense = math.copysign(1.0, z * shortening) if z * shortening != 0 else -1.0
            blocked = size * (h.sigma * sense + 1.0 - h.sigma)
            out[2 + 6 * i] = shortening / h.yield_contraction * (1.0 - blocked)
            out[3 + 6 * i] = speed
            out[5 + 6 * i] = shortening - strain / self.m.creep.relaxation_time
            out[6 + 6 * i] = (set_points[i] - carried) / lag if lag else 0.0
            volume, slope = self.volume(length)
            chamber = self.m.chamber
            supplied = 287.05 * chamber.temperature * self.flow(openings[i], pressure_abs, sag)
            swept = pressure_abs * slope * speed
            out[4 + 6 * i] = chamber.polytropic_index * (supplied - swept) / volume
        # A rig tilted about x: gravity has a component -g sin(tilt) along the tilted y axis.
        along = self.direction + angle
        torque -= self.moment * self.gravity * math.sin(self.tilt) * math.cos(along)
        out[0] = rate
        out[1] = (torque - self.damping * rate) / self.inertia
        return out

    def run(self, start, set_points, duration, samples):
        atmosphere = self.m.chamber.atmosphere
        length = self.m.mounting.length_at_zero + self.teeth(0.0)[0]
        muscles = [[0.0, length, pressure + atmosphere, 0.0, pressure, 0.0] for pressure in start]
        at_rest = np.array([0.0, 0.0, *muscles[0], *muscles[1], 0.0])
        options = {"method": "LSODA", "rtol": 1e-9, "atol": 1e-10, "max_step": 0.01}
        # The relaxed element carries nothing, so that the arm rests where it would without.
        creep = self.m.creep
        bare = dataclasses.replace(creep, stiffness=0.0)
        self.m = dataclasses.replace(self.m, creep=bare)
        settled = solve_ivp(self.rates, (0, 4.0), at_rest, args=(start,), **options).y[:, -1]
        self.m = dataclasses.replace(self.m, creep=creep)
        settled[[5, 11]] = 0.0
        grid = np.linspace(0.0, duration, samples)
        found = solve_ivp(
            self.rates, (0, duration), settled, args=(set_points,), t_eval=grid, **options
        )
        assert found.success, found.message
        return found.y[0], found.y[[4, 10]].T - atmosphere
