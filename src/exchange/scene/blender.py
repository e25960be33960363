import bpy
import numpy as np

POINTS_M = @POINTS@
FACES = @FACES@
PLATE_M = @PLATE_POINTS@
PLATE_FACES = @PLATE_FACES@


class Drape:
    """The cloth above the plate in Blender's current scene."""

    def __init__(self):
        self.scene = bpy.context.scene
        for thing in list(bpy.data.objects):
            bpy.data.objects.remove(thing)
        self.scene.gravity = (0.0, 0.0, -SCENE["gravity_m_s2"])
        self.scene.render.fps = SCENE["frames_per_s"]
        plate = self.add("plate", PLATE_M, PLATE_FACES)
        plate.modifiers.new("Collision", "COLLISION")
        plate.collision.thickness_outer = SCENE["plate_distance_m"]
        plate.collision.cloth_friction = 100.0 * SCENE["friction"]
        self.cloth = self.add("cloth", POINTS_M, FACES)
        modifier = self.cloth.modifiers.new("Cloth", "CLOTH")
        for key, value in SCENE["settings"].items():
            setattr(modifier.settings, key, value)
        for key, value in SCENE["collision_settings"].items():
            setattr(modifier.collision_settings, key, value)
        self.last = round(SCENE["at_rest"]["most_s"] * SCENE["frames_per_s"]) + 1
        modifier.point_cache.frame_start, modifier.point_cache.frame_end = 1, self.last
        self.scene.frame_start, self.scene.frame_end = 1, self.last
        self.scene.frame_set(1)

    def add(self, name, points, faces):
        mesh = bpy.data.meshes.new(name)
        mesh.from_pydata(points, [], faces)
        added = bpy.data.objects.new(name, mesh)
        self.scene.collection.objects.link(added)
        return added

    def advance(self, seconds):
        for _ in range(round(seconds * SCENE["frames_per_s"])):
            self.scene.frame_set(self.scene.frame_current + 1)

    def positions_m(self):
        seen = self.cloth.evaluated_get(bpy.context.evaluated_depsgraph_get())
        flat = np.empty(3 * len(POINTS_M), dtype=np.float32)
        seen.data.vertices.foreach_get("co", flat)
        return flat.reshape(-1, 3).astype(float)


def main():
    drape = Drape()
    time_s, rests = settle(drape)
    # the frames lie in the cloth's cache: play them back
    drape.scene.frame_end = drape.scene.frame_current
    print(f"{'at rest' if rests else 'NOT at rest'} after {time_s:.1f} s, frame {drape.scene.frame_end}")
    if bpy.app.background:
        out = __file__.removesuffix(".py") + ".blend"
        bpy.ops.wm.save_as_mainfile(filepath=out)
        print("wrote", out)
