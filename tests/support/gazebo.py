"""Gazebo's plugins by their documented formulas, slow and independent of bayesub: a model in SDF flies.

Written from the descriptions of gz-sim (classes Hydrodynamics, LiftDrag, Thruster and Buoyancy) and of SDFormat (added
mass is a part of the inertia) in its axes: forward, left and up, and a world that is x ahead, y to the left and z up.
"""

import itertools
import re
from xml.etree import ElementTree

import numpy as np

GRAVITY = 9.81
VELOCITIES, AXES = "UVWPQR", "xyzkmn"


def vector(element, path):
    return np.array([float(x) for x in element.find(path).text.split()])


def number(element, path):
    return float(element.find(path).text)


def cross(a):
    return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])


def carried(velocity, momentum):
    """The rate of change (6,) of a momentum that turns with the body, of which an engine takes mass and added mass."""
    turning = velocity[3:]
    moment = cross(turning) @ momentum[3:] + cross(velocity[:3]) @ momentum[:3]
    return np.append(cross(turning) @ momentum[:3], moment)


class Model:
    """What a file says, with changes of parameters of the plugin."""

    def __init__(self, text, changes=None):
        model = ElementTree.fromstring(text).find("model")
        self.name, link = model.get("name"), model.find("link")
        inertia = link.find("inertial/inertia")
        of = {key: number(inertia, key) for key in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")}
        tensor = np.array(
            [[of["ixx"], of["ixy"], of["ixz"]], [of["ixy"], of["iyy"], of["iyz"]], [of["ixz"], of["iyz"], of["izz"]]]
        )
        self.mass, self.centre = number(link, "inertial/mass"), vector(link, "inertial/pose")[:3]
        lever = self.mass * cross(self.centre)
        self.rigid = np.block(
            [
                [self.mass * np.eye(3), -lever],
                [lever, tensor - self.mass * cross(self.centre) @ cross(self.centre)],
            ]
        )
        self.fluid = np.zeros((6, 6))
        for i, a in enumerate("xyzpqr"):
            for j, b in enumerate("xyzpqr"[i:], start=i):
                self.fluid[i, j] = self.fluid[j, i] = number(link, f"inertial/fluid_added_mass/{a}{b}")
        self.buoyant = vector(link, "collision/pose")[:3]
        volume = 4.0 / 3.0 * np.pi * number(link, "collision/geometry/sphere/radius") ** 3
        self.added, self.linear = np.zeros((6, 6)), np.zeros((6, 6))
        self.sizes, self.products = np.zeros((6, 6, 6)), np.zeros((6, 6, 6))
        self.fins, self.thrusters = {}, {}
        for plugin in model.findall("plugin"):
            kind = plugin.get("name").rpartition("::")[2]
            if kind == "Hydrodynamics":
                self.lift = volume * number(plugin, "water_density") * GRAVITY
                assert plugin.find("disable_coriolis").text == "true"
                self.read({e.tag: float(e.text) for e in plugin if re.match("[xyzkmn][A-Z]", e.tag)} | (changes or {}))
            elif kind == "LiftDrag":
                assert number(plugin, "cla") == number(plugin, "cda") == 0.0
                lift = (
                    number(plugin, "control_joint_rad_to_cl") * number(plugin, "area") * number(plugin, "air_density")
                )
                fin = 0.5 * lift, *(vector(plugin, key) for key in ("cp", "forward", "upward"))
                self.fins[plugin.find("control_joint_name").text.removesuffix("_joint")] = fin
            elif kind == "Thruster":
                name = plugin.find("joint_name").text
                joint = next(j for j in model.findall("joint") if j.get("name") == name)
                child = next(e for e in model.findall("link") if e.get("name") == joint.find("child").text)
                axis = vector(joint, "axis/xyz")
                place = vector(child, "pose")[:3]
                self.thrusters[name.removesuffix("_joint")] = np.append(axis, cross(place) @ axis)

    def read(self, parameters):
        for name, value in parameters.items():
            axis, dot, first, size, second = re.fullmatch("([xyzkmn])(Dot)?([UVWPQR])(abs)?([UVWPQR])?", name).groups()
            i, j = AXES.index(axis), VELOCITIES.index(first)
            if dot:
                self.added[i, j] = value
            elif second is None:
                self.linear[i, j] = value
            else:
                (self.sizes if size else self.products)[i, j, VELOCITIES.index(second)] = value

    def hydrodynamics(self, velocity):
        """Force and moment (6,) of the plugin but for the accelerations."""
        force = self.linear @ velocity
        force = force + np.einsum("ijk,j,k->i", self.products, velocity, velocity)
        return force + np.einsum("ijk,j,k->i", self.sizes, velocity, np.abs(velocity))

    def fin(self, name, angle, velocity):
        """Force and moment (6,) of LiftDrag with cla = cda = 0."""
        slope, place, forward, upward = self.fins[name]
        at = velocity[:3] + cross(velocity[3:]) @ place
        spanwise = cross(forward) @ upward
        in_plane = at - at @ spanwise * spanwise
        lift = slope * angle * np.linalg.norm(in_plane) * (cross(spanwise) @ in_plane)
        return np.append(lift, cross(place) @ lift)

    def rates(self, rotation, velocity, pushed):
        """Accelerations (6,), with forces and moments (6,) that come from elsewhere."""
        force = self.hydrodynamics(velocity) + pushed - carried(velocity, (self.rigid + self.fluid) @ velocity)
        up = rotation.T @ [0.0, 0.0, 1.0]
        weight, lift = -self.mass * GRAVITY * up, self.lift * up
        force = force + np.append(weight + lift, cross(self.centre) @ weight + cross(self.buoyant) @ lift)
        return np.linalg.solve(self.rigid + self.fluid - self.added, force)

    def fly(self, times, speed, depth, pushed, substeps=1):
        """Positions (n, 3) north, east and down at times (n,), from straight and level flight.

        `pushed(time, velocity)`: forces and moments (6,) of fins, thrusters and what the file does not have.
        """

        def slope(time, state):
            rotation, velocity = state[3:12].reshape(3, 3), state[12:]
            turned = rotation @ cross(velocity[3:])
            rates = self.rates(rotation, velocity, pushed(time, velocity))
            return np.concatenate([rotation @ velocity[:3], turned.ravel(), rates])

        state = np.concatenate([[0.0, 0.0, -depth], np.eye(3).ravel(), [speed, 0.0, 0.0, 0.0, 0.0, 0.0]])
        track = [state[:3]]
        for begin, end in itertools.pairwise(times):
            dt = (end - begin) / substeps
            for time in begin + dt * np.arange(substeps):
                a = slope(time, state)
                b = slope(time + 0.5 * dt, state + 0.5 * dt * a)
                c = slope(time + 0.5 * dt, state + 0.5 * dt * b)
                d = slope(time + dt, state + dt * c)
                state = state + dt / 6.0 * (a + 2.0 * b + 2.0 * c + d)
            track.append(state[:3])
        return np.array(track) * [1.0, -1.0, -1.0]
