"""A strip in Newton, MuJoCo and Blender, with the numbers of an exported file.

Each function takes the strip and what was read from the file, lets the strip come to rest, and
returns the positions of its vertices. Packages are imported where they are needed, so that one that
is missing is one row less.
"""

import numpy as np

from strips import GRAVITY_M_S2


def mujoco(strip, density, flex, seconds=3.0):
    """flex: the attributes of <elasticity> (young, poisson, thickness)."""
    import mujoco

    def text(numbers):
        return " ".join(f"{number:.9g}" for number in numbers)

    constants = " ".join(f'{key}="{value}"' for key, value in flex.items())
    model = mujoco.MjModel.from_xml_string(
        f"""<mujoco><option timestep="0.002" integrator="discrete" gravity="0 0 -{GRAVITY_M_S2}"/>
        <worldbody><flexcomp name="s" type="direct" dim="2" mass="{density * strip.area_m2}" radius="0.0005"
          point="{text(strip.points.ravel())}" element="{' '.join(map(str, strip.triangles()))}">
        <contact contype="0" conaffinity="0" selfcollide="none"/>
        <elasticity {constants} damping="0.01" elastic2d="both"/>
        <pin id="{' '.join(map(str, strip.clamped))}"/></flexcomp></worldbody></mujoco>"""
    )
    data = mujoco.MjData(model)
    while data.time < seconds:
        mujoco.mj_step(model, data)
        data.qvel *= 0.98
    # nodes of a flex that are pinned lie in the world
    return np.array(data.flexvert_xpos).reshape(-1, 3)


def _newton(strip, build, solver_of, contacts, seconds, step_s):
    import newton
    import warp as wp

    wp.config.quiet = True
    wp.set_device("cpu")
    builder = newton.ModelBuilder(up_axis=newton.Axis.Z, gravity=(0.0, 0.0, -GRAVITY_M_S2))
    build(builder, newton, wp)
    model = builder.finalize()
    flags = model.particle_flags.numpy()
    flags[strip.clamped] = 0
    model.particle_flags = wp.array(flags, dtype=model.particle_flags.dtype)
    still = model.particle_inv_mass.numpy()
    still[strip.clamped] = 0.0
    model.particle_inv_mass = wp.array(still, dtype=float)
    solver = solver_of(model, newton)
    one, other, control = model.state(), model.state(), model.control()
    met = newton.CollisionPipeline(model).contacts() if contacts else None
    kept = 0.02 ** (step_s / 0.3)
    for _ in range(int(seconds / step_s)):
        one.clear_forces()
        solver.step(one, other, control, met, step_s)
        one, other = other, one
        one.particle_qd = wp.array(one.particle_qd.numpy() * kept, dtype=wp.vec3)
    return one.particle_q.numpy()


def _pose(wp):
    return dict(pos=wp.vec3(0.0, 0.0, 0.0), rot=wp.quat_identity(), vel=wp.vec3(0.0, 0.0, 0.0))


def newton_style3d(strip, style3d, seconds=1.0):
    """style3d: that part of the exported JSON. The strip runs along the warp; the panel's x is the weft."""

    def build(builder, newton, wp):
        from newton.solvers import style3d as style

        newton.solvers.SolverStyle3D.register_custom_attributes(builder)
        style.add_cloth_mesh(
            builder,
            **_pose(wp),
            vertices=strip.points.tolist(),
            indices=strip.triangles(),
            panel_verts=[(y, -x) for x, y, _ in strip.points.tolist()],
            density=style3d["density"],
            tri_aniso_ke=wp.vec3(*style3d["tri_aniso_ke"]),
            edge_aniso_ke=wp.vec3(*style3d["edge_aniso_ke"]),
            particle_radius=1e-4,
        )

    def solver(model, newton):
        style = newton.solvers.SolverStyle3D
        return style(model, config=style.Config(iterations=20, linear_iterations=60))

    return _newton(strip, build, solver, True, seconds, 1 / 600)


def newton_vbd(strip, vbd, seconds=1.0, iterations=100, step_s=1 / 2000):
    """vbd: that part of the exported JSON."""

    def build(builder, newton, wp):
        builder.add_cloth_mesh(
            **_pose(wp),
            scale=1.0,
            vertices=[wp.vec3(*point) for point in strip.points],
            indices=strip.triangles(),
            density=vbd["density"],
            tri_ke=vbd["tri_ke"],
            tri_ka=vbd["tri_ka"],
            tri_kd=0.0,
            edge_ke=vbd["edge_ke"],
            edge_kd=0.0,
            particle_radius=1e-4,
        )
        builder.color(include_bending=True)

    def solver(model, newton):
        return newton.solvers.SolverVBD(
            model, iterations=iterations, particle_enable_self_contact=False
        )

    return _newton(strip, build, solver, False, seconds, step_s)


def blender(strip, preset, mass_kg, frames=250):
    """preset: the path of the exported file, run as Blender runs presets."""
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    mesh = bpy.data.meshes.new("strip")
    mesh.from_pydata(strip.points.tolist(), [], strip.quads())
    cloth = bpy.data.objects.new("strip", mesh)
    bpy.context.collection.objects.link(cloth)
    bpy.context.view_layer.objects.active = cloth
    bpy.context.scene.gravity = (0.0, 0.0, -GRAVITY_M_S2)
    group = cloth.vertex_groups.new(name="clamp")
    group.add(strip.clamped, 1.0, "REPLACE")
    modifier = cloth.modifiers.new("cloth", "CLOTH")
    with open(preset) as file:
        exec(compile(file.read(), str(preset), "exec"), {})
    settings = modifier.settings
    # a strip is a small piece: the cloth's mass over its vertices, as the preset says
    settings.mass = 1e3 * mass_kg / len(strip.points)
    settings.vertex_group_mass = "clamp"
    settings.air_damping = 1.0
    modifier.collision_settings.use_collision = False
    modifier.collision_settings.use_self_collision = False
    modifier.point_cache.frame_end = frames
    scene = bpy.context.scene
    scene.frame_end = frames
    for frame in range(1, frames + 1):
        scene.frame_set(frame)
    seen = cloth.evaluated_get(bpy.context.evaluated_depsgraph_get())
    return np.array([vertex.co[:] for vertex in seen.data.vertices])
