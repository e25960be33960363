//! ARCSim: material JSON with `density`, `stretching` and `bending`.
//!
//! Source: ARCSim 0.2.1, `dde.cpp`, `physics.cpp`, `conf.cpp`; Wang, O'Brien and Ramamoorthi 2011.
//! Its energy is (k0 e00^2 + k2 e11^2) / 2 + k1 e00 e11 + k3 e01^2 of Green's strain, with e01 half
//! the shear, and `evaluate_stretching_sample` doubles what is read: c11 and c22 are half of the
//! stretch stiffnesses, c12 is 0, and c33 is the shear stiffness. All six rows are alike: the
//! fabric is linear. `bending_energy` bends with a fourth of what is entered ([`super::hinge`]) and
//! reads it as it is: four times the stiffness. Its rows belong to edges at 0, 45 and 90 degrees
//! from the u axis of the cloth's texture; with u along the weft, cloth bent about the first is
//! curved along the warp. Rows have five columns, of growing curvature, here alike.
//!
//! Not tried in ARCSim itself, which no package registry has; the hinge's weight is tested.

use serde_json::json;

use super::exported::{Exported, Options};
use super::going_along;
use super::hinge::{self, ARCSIM, Mesh};
use crate::fabric::params::Params;

pub(super) fn write(params: &Params, options: &Options) -> Exported {
    let fabric = &params.fabric;
    let bending = [fabric.bending_weft_nm, fabric.bending_warp_nm, fabric.bending_bias_nm];
    let [weft, warp, bias] = hinge::weft_warp_bias(bending, ARCSIM, options.mesh);
    let row = [0.5 * fabric.stretch_weft_n_m, 0.0, 0.5 * fabric.stretch_warp_n_m, fabric.shear_n_m];
    let mut notes = vec![
        "u of the texture is the weft, v the warp".to_owned(),
        "stretching: halves, since ARCSim doubles them as it reads; bending: four times the stiffness, \
         since its hinge bends with a fourth of it"
            .to_owned(),
    ];
    if options.mesh == Mesh::Grid {
        notes.push("for cells along the yarns with all diagonals one way".to_owned());
    }
    let stretching = [row; 6];
    let bending = [warp, bias, weft].map(|stiffness| [stiffness; 5]);
    let file = json!({
        "name": options.name,
        "density": fabric.density_kg_m2,
        "stretching": stretching,
        "bending": bending,
        "scan2params": going_along::json(params, &[], &notes),
    });
    Exported { text: going_along::text(&file), companion: None, lost: Vec::new(), notes }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fabric::Fabric;

    #[test]
    fn six_rows_of_four_and_three_of_five() {
        let fabric = Fabric::from_paper_units([1e5, 2e5, 6e4, 900.0, 2100.0, 1500.0, 200.0]);
        let text = write(&Params::of(fabric), &Options::named("a")).text;
        let file: serde_json::Value = serde_json::from_str(&text).unwrap();
        let rows = |key: &str| file[key].as_array().unwrap().clone();
        assert_eq!((rows("stretching").len(), rows("bending").len()), (6, 3));
        for row in rows("stretching") {
            assert_eq!(row, json!([50.0, 0.0, 100.0, 60.0]));
        }
        for (row, expected) in rows("bending").iter().zip([8.4e-6, 6e-6, 3.6e-6]) {
            let row = row.as_array().unwrap();
            assert_eq!(row.len(), 5);
            assert!(row.iter().all(|b| (b.as_f64().unwrap() / expected - 1.0).abs() < 1e-9));
        }
        assert!((file["density"].as_f64().unwrap() - 0.2).abs() < 1e-12);
    }
}
