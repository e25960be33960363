//! Blender: a preset of its cloth, in Python, for a mesh of square cells of a given edge.
//!
//! Blender's stiffnesses have no unit; they follow from its source (`cloth.cc`,
//! `implicit_blender.cc`, bending model angular). Gravity is scaled by 0.001, so that a vertex with
//! 1000 times its mass weighs what it should and forces are in N. A hinge between two quads of edge
//! h turns by q h at the curvature q, and its spring of 0.1 k h per radian spreads the force F over
//! four corners of each quad: two of them at the distance h, which makes the moment F h / 2. Per
//! width that is 0.05 k h^2 q, so k = 20 B / h^2: it depends on the mesh, and on triangles it is
//! another. A spring's stiffness is the setting over the mean length of edges. The two diagonals of
//! a quad resist shear with it, and stretch as well: shear = H h, tension = compression = (S - H)
//! h.
//!
//! With fewer than some 40 steps a frame (`quality`) such soft springs end elsewhere, and with its
//! own damping of bending, which is made for stiffer ones, cloth creeps for hundreds of frames: the
//! preset sets both.
//!
//! Vertices have one mass each, also those of the rim, which carry less cloth: it is the cloth's
//! mass over the number of vertices that should be entered for a small piece.

use std::fmt::Write as _;

use super::exported::{ExchangeError, Exported, Options};
use super::going_along::{self, number};
use super::isotropic::Isotropic;
use crate::base::units::M_PER_MM;
use crate::fabric::params::Params;

/// Mass over real mass, since gravity is scaled by the inverse.
pub(super) const MASS: f64 = 1e3;
/// Setting over B / h^2.
const BENDING: f64 = 20.0;
/// Steps in a frame.
pub(super) const QUALITY: usize = 40;
/// Least part of the stretch stiffness that the edges keep beside the diagonals.
const LEAST_TENSION: f64 = 0.1;

pub(super) fn write(params: &Params, options: &Options) -> Result<Exported, ExchangeError> {
    let edge_m = options.edge_m.ok_or(ExchangeError::Needs {
        target: "blender",
        what: "the edge of the mesh's cells, on which its stiffnesses depend",
        flag: "--edge-mm",
    })?;
    let fabric = &params.fabric;
    let isotropic = Isotropic::of(fabric);
    let mut lost = Isotropic::lost(fabric);
    lost.push("90 % intervals and verdict: they stand in the comment alone".to_owned());
    let mut notes = vec![
        format!(
            "holds for quads with edges of {} mm and the bending model Angular; export again for \
             another mesh, since bending goes with the inverse square of the edge",
            edge_m / M_PER_MM
        ),
        "Blender's mass is 1000 times that of a vertex, since it scales gravity by 0.001"
            .to_owned(),
        "on a mesh of few cells set the mass to 1000 times the cloth's over the number of vertices"
            .to_owned(),
    ];
    if isotropic.shear_n_m > (1.0 - LEAST_TENSION) * isotropic.stretch_n_m {
        notes.push(
            "shear is as stiff as stretch: the diagonals make the cloth stiffer to pull".into(),
        );
    }
    let mass = ("mass", MASS * fabric.density_kg_m2 * edge_m * edge_m);
    let mut text = String::new();
    for line in going_along::lines(params, &lost, &notes) {
        // writing to a string cannot fail
        let _ = writeln!(text, "# {line}");
    }
    text += HEAD;
    let _ = writeln!(text, "cloth.settings.quality = {QUALITY}");
    for (name, value) in [mass].into_iter().chain(stiffnesses(&isotropic, edge_m)) {
        let _ = writeln!(text, "cloth.settings.{name} = {}", number(value));
    }
    if let Some(friction) = options.friction {
        let _ = writeln!(text, "cloth.collision_settings.friction = {}", number(friction));
    }
    Ok(Exported { text, companion: None, lost, notes })
}

/// The stiffnesses on quads of this edge.
fn stiffnesses(isotropic: &Isotropic, edge_m: f64) -> [(&'static str, f64); 4] {
    let Isotropic { stretch_n_m, shear_n_m, bending_nm } = *isotropic;
    let tension = (stretch_n_m - shear_n_m).max(LEAST_TENSION * stretch_n_m) * edge_m;
    [
        ("tension_stiffness", tension),
        ("compression_stiffness", tension),
        ("shear_stiffness", shear_n_m * edge_m),
        ("bending_stiffness", BENDING * bending_nm / (edge_m * edge_m)),
    ]
}

/// How the script finds the cloth: Blender gives a preset its `cloth`; run by itself it takes the
/// selected object.
const HEAD: &str = "\
import bpy

# as a preset, or run by itself: the selected object then gets a cloth modifier where it has none
cloth = getattr(bpy.context, 'cloth', None)
if cloth is None:
    selected = bpy.context.object
    if selected is None or selected.type != 'MESH':
        raise RuntimeError('select the mesh of the cloth, then run this again')
    found = [modifier for modifier in selected.modifiers if modifier.type == 'CLOTH']
    cloth = found[0] if found else selected.modifiers.new('Cloth', 'CLOTH')
cloth.settings.bending_model = 'ANGULAR'
cloth.settings.bending_damping = 0
";

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fabric::Fabric;

    fn setting(text: &str, name: &str) -> f64 {
        let start = format!("cloth.settings.{name} = ");
        text.lines().find_map(|line| line.strip_prefix(&start)).unwrap().parse().unwrap()
    }

    fn text(edge_mm: f64) -> String {
        let fabric = Fabric::from_paper_units([1e5, 2e5, 6e4, 900.0, 2100.0, 1500.0, 200.0]);
        let options = Options { edge_m: Some(edge_mm * 1e-3), ..Options::named("a") };
        write(&Params::of(fabric), &options).unwrap().text
    }

    #[test]
    fn known_numbers_and_what_they_do_with_the_mesh() {
        let (fine, coarse) = (text(5.0), text(10.0));
        for (name, expected) in [
            ("mass", 5e-3),
            ("tension_stiffness", 0.45),
            ("shear_stiffness", 0.3),
            ("bending_stiffness", 1.2),
        ] {
            let found = setting(&fine, name);
            assert!((found / expected - 1.0).abs() < 1e-9, "{name}: {found}");
        }
        let ratio = |name| setting(&coarse, name) / setting(&fine, name);
        assert!((ratio("bending_stiffness") - 0.25).abs() < 1e-9);
        assert!((ratio("mass") - 4.0).abs() < 1e-9);
    }

    #[test]
    fn without_the_mesh_it_is_refused_and_remarks_stay_remarks() {
        let mut params = Params::of(Fabric::mean_knit());
        let error = write(&params, &Options::named("a")).unwrap_err().to_string();
        assert!(error.contains("give --edge-mm"), "{error}");
        params.input = Some("a\nimport os\r.ply".to_owned());
        let options = Options { edge_m: Some(5e-3), ..Options::named("a") };
        let text = write(&params, &options).unwrap().text;
        let code = text.lines().filter(|line| !line.starts_with('#') && line.contains("import"));
        assert_eq!(code.collect::<Vec<_>>(), ["import bpy"]);
    }
}
