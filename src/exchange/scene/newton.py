import pathlib

import newton
import numpy as np
import warp as wp
from newton.solvers import style3d

POINTS_M = @POINTS@
TRIANGLES = @TRIANGLES@


class Drape:
    """The cloth above the plate in Newton, on the CPU."""

    def __init__(self):
        wp.set_device("cpu")
        gravity = (0.0, 0.0, -SCENE["gravity_m_s2"])
        builder = newton.ModelBuilder(up_axis=newton.Axis.Z, gravity=gravity)
        newton.solvers.SolverStyle3D.register_custom_attributes(builder)
        style3d.add_cloth_mesh(
            builder,
            pos=wp.vec3(0.0, 0.0, 0.0),
            rot=wp.quat_identity(),
            vel=wp.vec3(0.0, 0.0, 0.0),
            vertices=[list(point) for point in POINTS_M],
            indices=[vertex for triangle in TRIANGLES for vertex in triangle],
            # a panel's x is the weft
            panel_verts=[(y, -x) for x, y, _ in POINTS_M],
            density=SCENE["density"],
            tri_aniso_ke=wp.vec3(*SCENE["tri_aniso_ke"]),
            edge_aniso_ke=wp.vec3(*SCENE["edge_aniso_ke"]),
            particle_radius=SCENE["particle_radius_m"],
        )
        half_m, radius_m = SCENE["cylinder_half_height_m"], SCENE["cylinder_radius_m"]
        middle = wp.transform(wp.vec3(0.0, 0.0, SCENE["cylinder_top_m"] - half_m), wp.quat_identity())
        builder.add_shape_cylinder(body=-1, xform=middle, radius=radius_m, half_height=half_m)
        self.model = builder.finalize()
        self.model.set_gravity(gravity)
        self.model.soft_contact_ke = SCENE["soft_contact_ke"]
        self.model.soft_contact_kd = SCENE["soft_contact_kd"]
        self.model.soft_contact_mu = SCENE["friction"]
        solver = newton.solvers.SolverStyle3D
        config = solver.Config(
            iterations=SCENE["iterations"], linear_iterations=SCENE["linear_iterations"]
        )
        self.solver = solver(self.model, config=config)
        self.solver.collision.radius = SCENE["self_contact_radius_m"]
        self.now, self.next = self.model.state(), self.model.state()
        self.control = self.model.control()
        self.pipeline = newton.CollisionPipeline(self.model)
        self.contacts = self.pipeline.contacts()

    def advance(self, seconds):
        step_s = SCENE["step_s"]
        kept = 1.0 - SCENE["drag_per_s"] * step_s
        for _ in range(round(seconds / step_s)):
            self.pipeline.collide(self.now, self.contacts)
            self.now.clear_forces()
            self.solver.step(self.now, self.next, self.control, self.contacts, step_s)
            self.now, self.next = self.next, self.now
            # the air brakes the cloth
            self.now.particle_qd.assign(self.now.particle_qd.numpy() * np.float32(kept))

    def positions_m(self):
        return self.now.particle_q.numpy().astype(float)


def main():
    drape = Drape()
    time_s, rests = settle(drape)
    out = pathlib.Path(__file__).with_suffix(".obj")
    lines = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in drape.positions_m()]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in TRIANGLES]
    out.write_text("\n".join(lines) + "\n")
    print(f"{'at rest' if rests else 'NOT at rest'} after {time_s:.1f} s; wrote {out}")
