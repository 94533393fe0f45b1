"""Bodies by MuJoCo (pip install mujoco): boxes as walls, robots on two slides and a hinge.

Motors hold the commanded velocity, with the force of a type's acceleration; walls have no width."""

import math

import mujoco
import numpy as np

STEPS = 4  # of MuJoCo in a tick
KG = 12.0  # a Pioneer 3-DX with its laser (our estimate)
EPISODE_NS = 500_000_000  # time without contact that ends a collision, as in desim
JOINTS = (("x", "slide", "1 0 0"), ("y", "slide", "0 1 0"), ("yaw", "hinge", "0 0 1"))


class MuJoCoBodies:
    """See ``desim.ports.Bodies``."""

    def start(self, arena):
        self._model = mujoco.MjModel.from_xml_string(_scene(arena))
        self._data = mujoco.MjData(self._model)
        self._data.qpos[:] = arena.poses.ravel()
        self._most = np.array([(t.max_speed_mps, t.max_speed_mps * (t.drive != "differential"),
                                t.max_turn_radps) for t in arena.types])
        self._timeout_ns = np.array([t.command_timeout_ns for t in arena.types])
        self._wanted, self._commanded_ns = 0.0 * arena.poses, np.zeros(len(arena.robots), np.int64)
        self._touched_ns = {}  # when each pair touched last
        self.poses, self.velocities = arena.poses.copy(), 0.0 * arena.poses
        self.travelled_m = np.zeros(len(arena.robots))

    def command(self, robot, velocity, now_ns):
        self._wanted[robot] = np.clip(velocity, -self._most[robot], self._most[robot])
        self._commanded_ns[robot] = now_ns

    def surround(self, walls, tops_m, discs): ...  # doors and moving obstacles are not there

    def advance(self, now_ns, dt_s):
        self._wanted[now_ns - self._commanded_ns > self._timeout_ns] = 0.0
        self._model.opt.timestep = dt_s / STEPS
        for _ in range(STEPS):
            self._data.ctrl[:] = _turned(self._wanted, self._data.qpos[2::3]).ravel()
            mujoco.mj_step(self._model, self._data)
        before, self.poses = self.poses, self._data.qpos.reshape(-1, 3).copy()
        self.poses[:, 2] = np.remainder(self.poses[:, 2] + math.pi, math.tau) - math.pi
        self.velocities = _turned(self._data.qvel.reshape(-1, 3), -self.poses[:, 2])
        self.travelled_m += np.hypot(*(self.poses - before)[:, :2].T)
        owner = self._model.geom_bodyid - 1  # robots; -1 is a wall
        pairs = {tuple(sorted(owner[pair].tolist(), key=lambda k: (k < 0, k)))
                 for pair in self._data.contact.geom}
        began = [pair for pair in sorted(pairs)
                 if now_ns - self._touched_ns.get(pair, -EPISODE_NS) >= EPISODE_NS]
        self._touched_ns.update(dict.fromkeys(pairs, now_ns))
        return began

    def ahead(self, after_ns):
        return self.poses + self._data.qvel.reshape(-1, 3) * (after_ns / 1e9)


def _turned(velocities, yaw):
    """Velocities [n, 3] in axes that are turned by -yaw [n]."""
    c, s, (x, y, turn) = np.cos(yaw), np.sin(yaw), velocities.T
    return np.column_stack([c * x - s * y, s * x + c * y, turn])


def _scene(arena):
    walls, bodies, motors = [], [], []
    for x0, y0, x1, y1 in arena.obstacles.segments.tolist():
        walls.append(f'<geom type="box" pos="{(x0 + x1) / 2} {(y0 + y1) / 2} 0.5" euler="0 0 '
                     f'{math.degrees(math.atan2(y1 - y0, x1 - x0))}" size="'
                     f'{math.hypot(x1 - x0, y1 - y0) / 2} 0.01 0.5"/>')
    for k, t in enumerate(arena.types):
        bodies.append('<body pos="0 0 0.2">' + "".join(
            f'<joint name="{name}{k}" type="{kind}" axis="{axis}"/>' for name, kind, axis in JOINTS)
            + f'<geom type="cylinder" size="{t.radius_m} 0.12" mass="{KG}" friction="0.3"/></body>')
        push, turn = KG * t.acceleration_mps2, KG * t.radius_m**2 / 2 * t.turn_acceleration_radps2
        motors += [f'<velocity joint="{name}{k}" kv="{kv}" forcerange="-{most} {most}"/>' for
                   name, kv, most in (("x", 400, push), ("y", 400, push), ("yaw", 10, turn))]
    return ('<mujoco><option gravity="0 0 0" integrator="implicitfast"/><worldbody>'
            f'{"".join(walls + bodies)}</worldbody><actuator>{"".join(motors)}</actuator></mujoco>')
