//! NVIDIA Newton: JSON with the arguments of its cloth builders, for two solvers. Newton has no
//! own material file; `json.load` and a line hand them over (docs/export.md).
//!
//! `SolverStyle3D`: `tri_aniso_ke` (weft, warp, shear) \[N/m\], of the energy of Baraff and Witkin
//! that this simulator has too, so that stiffnesses go as they are. `edge_aniso_ke`: the second
//! belongs to edges along the panel's x, bent about which the cloth is curved along y; with x along
//! the weft that is (weft, warp, bias). Its Crouzeix-Raviart hinge is 3 times as stiff as what is
//! entered ([`super::hinge`]).
//!
//! `SolverVBD`, where the length of the mesh's edges is given: `edge_ke` is a stiffness over a
//! length, and its membrane (Saint Venant-Kirchhoff, mu = `tri_ke`, lambda = `tri_ka`) has no
//! directions: mu + the lambda that give stretch and shear in the mean, where a plane isotropic
//! material has both.

use serde_json::{Value, json};

use super::exported::{Exported, Options};
use super::going_along;
use super::hinge::{self, Mesh};
use super::isotropic::Isotropic;
use crate::base::units::M_PER_MM;
use crate::fabric::params::Params;

/// Largest Poisson's ratio of VBD's membrane: beyond it cloth locks.
const MOST_POISSON: f64 = 0.45;

pub(super) fn write(params: &Params, options: &Options) -> Exported {
    let fabric = &params.fabric;
    let bending = [fabric.bending_weft_nm, fabric.bending_warp_nm, fabric.bending_bias_nm];
    let mesh = match options.mesh {
        Mesh::Irregular => "irregular",
        Mesh::Grid => "grid",
    };
    let style3d = json!({
        "mesh": mesh,
        "density": fabric.density_kg_m2,
        "tri_aniso_ke": [fabric.stretch_weft_n_m, fabric.stretch_warp_n_m, fabric.shear_n_m],
        "edge_aniso_ke": hinge::style3d(bending, options.mesh),
        "panel_axes": { "x": "weft", "y": "warp" },
    });
    let mut notes = vec![
        "edge_aniso_ke is a third of the bending stiffness (weft, warp): Newton's hinge bends three times \
         as stiffly as what is entered, on any mesh"
            .to_owned(),
    ];
    notes.push(match options.mesh {
        Mesh::Irregular => {
            "for meshes of irregular triangles; for add_cloth_grid export with --mesh grid".to_owned()
        }
        Mesh::Grid => "for add_cloth_grid with cells along the yarns, whose diagonals all run one way: \
                       bent about one diagonal such cloth is softer than about the other, and the bias \
                       stiffness is met in the geometric mean of both only; it twists as it bends"
            .to_owned(),
    });
    let mut lost = Vec::new();
    let vbd = options.edge_m.map_or(Value::Null, |edge_m| {
        notes.push(format!(
            "vbd.edge_ke holds for edges of {} mm only: its hinge is as stiff as edge_ke times the \
             distance of two rows of triangles",
            edge_m / M_PER_MM
        ));
        lost.extend(Isotropic::lost(fabric).into_iter().map(|what| format!("for vbd: {what}")));
        vbd(&Isotropic::of(fabric), fabric.density_kg_m2, edge_m, options.mesh)
    });
    if vbd.is_null() {
        notes.push(
            "for SolverVBD give the length of the mesh's edges as well (--edge-mm): its bending \
                    depends on the mesh"
                .to_owned(),
        );
    }
    let along = going_along::json(params, &lost, &notes);
    let file =
        json!({ "name": options.name, "style3d": style3d, "vbd": vbd, "scan2params": along });
    Exported { text: going_along::text(&file), companion: None, lost, notes }
}

fn vbd(isotropic: &Isotropic, density_kg_m2: f64, edge_m: f64, mesh: Mesh) -> Value {
    let nu = isotropic.poisson(MOST_POISSON);
    // plane: S = 4 mu (lambda + mu) / (lambda + 2 mu), nu = lambda / (lambda + 2 mu)
    let mu = isotropic.stretch_n_m / (2.0 * (1.0 + nu));
    let lambda = 2.0 * mu * nu / (1.0 - nu);
    json!({
        "edge_mm": edge_m / M_PER_MM,
        "density": density_kg_m2,
        "tri_ke": mu,
        "tri_ka": lambda,
        "edge_ke": hinge::per_length(isotropic.bending_nm, edge_m, mesh),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fabric::Fabric;

    #[test]
    fn si_a_third_of_bending_and_a_membrane_with_the_given_stretch_and_shear() {
        let fabric = Fabric::from_paper_units([1e5, 2e5, 6e4, 900.0, 2100.0, 1500.0, 200.0]);
        let options = Options { edge_m: Some(5e-3), ..Options::named("a") };
        let exported = write(&Params::of(fabric), &options);
        let file: Value = serde_json::from_str(&exported.text).unwrap();
        let of = |pointer: &str| file.pointer(pointer).unwrap().as_f64().unwrap();
        for (pointer, expected) in [
            ("/style3d/tri_aniso_ke/0", 100.0),
            ("/style3d/tri_aniso_ke/1", 200.0),
            ("/style3d/tri_aniso_ke/2", 60.0),
            ("/style3d/edge_aniso_ke/0", 0.3e-6),
            ("/style3d/edge_aniso_ke/1", 0.7e-6),
            ("/style3d/edge_aniso_ke/2", 0.5e-6),
            ("/style3d/density", 0.2),
            ("/vbd/tri_ke", 60.0),
            // 1.5e-6 N m over rows of 4.33 mm
            ("/vbd/edge_ke", 3.464_101_615e-4),
        ] {
            assert!((of(pointer) / expected - 1.0).abs() < 1e-9, "{pointer}: {}", of(pointer));
        }
        let (mu, lambda) = (of("/vbd/tri_ke"), of("/vbd/tri_ka"));
        let stretch = 4.0 * mu * (lambda + mu) / (lambda + 2.0 * mu);
        assert!((stretch - 150.0).abs() < 1e-9, "{stretch}");
        assert_eq!(exported.lost.len(), 2);
        assert!(write(&Params::of(fabric), &Options::named("a")).lost.is_empty());
    }
}
