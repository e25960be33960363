"""The stages of a scan that Open3D has, each with the processor time it takes.

In: a PLY in metres, and `all` or `above`: whether the floor's plane is only found, or
also cut away before the stages after it. Out: lines `stage,cpu_s,points`. Set
OMP_NUM_THREADS=1.
"""

import sys
import time

import open3d as o3d

before = time.process_time()


def done(stage: str, points: int) -> None:
    global before
    now = time.process_time()
    print(f"{stage},{now - before:.4f},{points}", flush=True)
    before = time.process_time()


cloud = o3d.io.read_point_cloud(sys.argv[1])
done("read", len(cloud.points))
thin = cloud.voxel_down_sample(1e-3)
done("voxel", len(thin.points))
o3d.utility.random.seed(1)
_, plane = thin.segment_plane(2e-3, 3, 300)
above = thin.select_by_index(plane, invert=True) if sys.argv[2] == "above" else thin
done("plane", len(above.points))
clean, _ = above.remove_statistical_outlier(20, 2.0)
done("outliers", len(clean.points))
clean.estimate_normals(o3d.geometry.KDTreeSearchParamKNN(30))
done("normals", len(clean.points))
tensor = o3d.t.geometry.PointCloud.from_legacy(clean)
boundary, _ = tensor.compute_boundary_points(radius=4e-3, max_nn=30, angle_threshold=90.0)
done("boundary", len(boundary.point.positions))
