//! From scan to rim: clouds, meshes, scenes, sizes, refusals; outlines and noise.

#[path = "../program/mod.rs"]
mod program;
#[path = "../promises/mod.rs"]
mod promises;
#[path = "../scan_support/mod.rs"]
mod scan_support;

mod boundary;
mod hints;
mod mesh;
mod refusals;
mod scenes;
mod sensor_noise;
mod silhouettes;
mod size;
mod small;
mod stages;
