//! OpenUSD, as text (.usda): the specimen as a mesh with the fabric on it, in two vocabularies.
//!
//! CLO's, as Unreal's importer reads it: a `GeomSubset` with `CloFabricAPI` and the primvars
//! `clo:stretchWeft` ... `clo:density`, constant arrays of one, in g/s^2, g mm^2/s^2, g/mm^2 and
//! mm. Left and right bias and shear are alike. Nothing is lost there. The one proposed for
//! OpenUSD's physics, as NVIDIA Newton's importer reads it: a material with
//! `physics:surfaceStretchStiffness`, `surfaceShearStiffness` \[N/m\] and `surfaceBendStiffness`
//! \[N m\], which knows no directions, and a mass on the mesh.
//!
//! The mesh lies in the plane of x (warp) and z (weft), as the simulation frame has it, in metres;
//! its texture coordinates are (weft, warp) from 0 to 1.

use std::fmt::Write as _;

use super::exported::{Exported, Options};
use super::going_along::{self, number};
use super::isotropic::Isotropic;
use crate::base::frame::SPECIMEN_SIDE_M;
use crate::base::units::M_PER_MM;
use crate::fabric::params::Params;

/// Edges of the specimen's cells where they are not given \[m\].
const EDGE_M: f64 = 0.010;

pub(super) fn write(params: &Params, options: &Options) -> Exported {
    let lost: Vec<String> = Isotropic::lost(&params.fabric)
        .into_iter()
        .map(|what| format!("for physics: {what}"))
        .collect();
    let mut notes = vec![
        "primvars clo: are in g/s^2, g mm^2/s^2, g/mm^2, mm; physics: in SI and alike in all directions"
            .to_owned(),
    ];
    if options.thickness_m.is_none() || options.friction.is_none() {
        notes.push(
            "thickness and friction are not known from a drape and left out where they are not given \
             (--thickness-mm, --friction)"
                .to_owned(),
        );
    }
    let documentation = going_along::lines(params, &lost, &notes).join("\n");
    let text = format!(
        "#usda 1.0\n(\n    defaultPrim = \"Fabric\"\n    metersPerUnit = 1\n    kilogramsPerUnit = 1\n    \
         upAxis = \"Y\"\n    doc = {}\n)\n\ndef Xform \"Fabric\" (\n    displayName = {}\n)\n{{\n{}\n{}}}\n",
        quoted(&documentation),
        quoted(&options.name),
        material(params, options),
        mesh(params, options),
    );
    Exported { text, companion: None, lost, notes }
}

/// A string of several lines; USD's escapes are Python's.
fn quoted(text: &str) -> String {
    let text = text.replace('\\', "\\\\").replace('"', "\\\"");
    if text.contains('\n') { format!("\"\"\"{text}\"\"\"") } else { format!("\"{text}\"") }
}

fn material(params: &Params, options: &Options) -> String {
    let of = Isotropic::of(&params.fabric);
    let friction = options.friction.map_or(String::new(), |mu| {
        format!("        float physics:dynamicFriction = {}\n", number(mu))
    });
    format!(
        "    def Material \"Cloth\" (\n        prepend apiSchemas = [\"PhysicsMaterialAPI\", \
         \"PhysicsSurfaceDeformableMaterialAPI\"]\n    )\n    {{\n{friction}        float \
         physics:surfaceStretchStiffness = {}\n        float physics:surfaceShearStiffness = {}\n        \
         float physics:surfaceBendStiffness = {}\n    }}\n",
        number(of.stretch_n_m),
        number(of.shear_n_m),
        number(of.bending_nm),
    )
}

fn mesh(params: &Params, options: &Options) -> String {
    let cells = (SPECIMEN_SIDE_M / options.edge_m.unwrap_or(EDGE_M)).round().max(1.0);
    let n = cells as usize;
    let at = |i: usize| SPECIMEN_SIDE_M * (i as f64 / cells - 0.5);
    let share = |i: usize| i as f64 / cells;
    let grid = || (0..=n).flat_map(|i| (0..=n).map(move |j| (i, j)));
    let points = grid().map(|(i, j)| format!("({:.6}, 0, {:.6})", at(i), at(j)));
    let st = grid().map(|(i, j)| format!("({:.6}, {:.6})", share(j), share(i)));
    let corner = |i: usize, j: usize| i * (n + 1) + j;
    let quads = (0..n).flat_map(|i| (0..n).map(move |j| (i, j))).map(|(i, j)| {
        let [a, b] = [corner(i, j), corner(i, j + 1)];
        let [c, d] = [corner(i + 1, j + 1), corner(i + 1, j)];
        format!("{a}, {b}, {c}, {d}")
    });
    let list = |items: &mut dyn Iterator<Item = String>| items.collect::<Vec<_>>().join(", ");
    let [low, high] = [at(0), at(n)];
    let mass = params.fabric.density_kg_m2 * SPECIMEN_SIDE_M * SPECIMEN_SIDE_M;
    format!(
        "    def Mesh \"Specimen\" (\n        prepend apiSchemas = [\"MaterialBindingAPI\", \
         \"PhysicsMassAPI\", \"PhysicsSurfaceDeformableSimAPI\"]\n    )\n    {{\n        float3[] extent = [({low}, 0, {low}), ({high}, 0, \
         {high})]\n        int[] faceVertexCounts = [{}]\n        int[] faceVertexIndices = [{}]\n        \
         uniform token subdivisionScheme = \"none\"\n        rel material:binding:physics = \
         </Fabric/Cloth>\n        rel material:binding = </Fabric/Cloth>\n        float physics:mass = {}\n        \
         point3f[] points = [{}]\n        texCoord2f[] primvars:st = [{}] (\n            interpolation = \
         \"vertex\"\n        )\n\n{}    }}\n",
        list(&mut (0..n * n).map(|_| "4".to_owned())),
        list(&mut quads.into_iter()),
        number(mass),
        list(&mut points.into_iter()),
        list(&mut st.into_iter()),
        subset(params, options, n * n),
    )
}

/// The faces as CLO's fabric.
fn subset(params: &Params, options: &Options, faces: usize) -> String {
    let [su, sv, shear, bu, bv, bias, density] = params.fabric.to_paper_units();
    let mut values = vec![
        ("stretchWeft", su),
        ("stretchWarp", sv),
        ("shearLeft", shear),
        ("shearRight", shear),
        ("bendingWeft", bu),
        ("bendingWarp", bv),
        ("bendingBiasLeft", bias),
        ("bendingBiasRight", bias),
        ("density", density * 1e-6),
    ];
    values.extend(options.thickness_m.map(|m| ("thickness", m / M_PER_MM)));
    values.extend(options.friction.map(|mu| ("friction", mu)));
    let indices: Vec<String> = (0..faces).map(|face| face.to_string()).collect();
    let mut text = format!(
        "        def GeomSubset \"Pattern\" (\n            prepend apiSchemas = [\"CloFabricAPI\"]\n        \
         )\n        {{\n            uniform token elementType = \"face\"\n            uniform token \
         familyName = \"simPattern\"\n            int[] indices = [{}]\n",
        indices.join(", ")
    );
    for (name, value) in values {
        // writing to a string cannot fail
        let _ = writeln!(
            text,
            "            float[] primvars:clo:{name} = [{}] (\n                interpolation = \
             \"constant\"\n            )",
            number(value)
        );
    }
    text + "        }\n"
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fabric::Fabric;

    fn text(options: &Options) -> String {
        let fabric = Fabric::from_paper_units([1e5, 2e5, 6e4, 900.0, 2100.0, 1500.0, 200.0]);
        let mut params = Params::of(fabric);
        params.input = Some("a \"b\"\\.ply".to_owned());
        write(&params, options).text
    }

    #[test]
    fn clos_names_in_clos_units_and_physics_in_si() {
        let options = Options { friction: Some(0.3), ..Options::named("a") };
        let text = text(&options);
        for line in [
            "float[] primvars:clo:stretchWeft = [100000] (",
            "float[] primvars:clo:bendingWarp = [2100",
            "float[] primvars:clo:bendingBiasRight = [1500",
            "float[] primvars:clo:density = [",
            "float[] primvars:clo:friction = [0.3] (",
            "float physics:surfaceShearStiffness = 60",
            "float physics:surfaceBendStiffness = 1.5",
            "float physics:mass = 0.018",
        ] {
            assert!(text.lines().any(|found| found.trim().starts_with(line)), "{line}");
        }
        assert!(!text.contains("clo:thickness"));
    }

    /// Brackets close each other outside strings, and the arrays are as long as the mesh says.
    #[test]
    fn brackets_close_and_counts_agree() {
        let text = text(&Options { edge_m: Some(0.05), ..Options::named("a") });
        assert!(text.starts_with("#usda 1.0\n"));
        let mut open = Vec::new();
        // the documentation is the one string of several lines; quotes in it are escaped
        let parts: Vec<&str> = text.split("\"\"\"").collect();
        assert_eq!(parts.len(), 3);
        assert!(parts[1].contains("a \\\"b\\\"\\\\.ply"), "{}", parts[1]);
        for c in [parts[0], parts[2]].concat().chars() {
            match c {
                '(' | '[' | '{' => open.push(c),
                ')' => assert_eq!(open.pop(), Some('(')),
                ']' => assert_eq!(open.pop(), Some('[')),
                '}' => assert_eq!(open.pop(), Some('{')),
                _ => {}
            }
        }
        assert!(open.is_empty());
        let array = |name: &str| {
            let line = text.lines().find(|line| line.contains(name)).unwrap();
            line.split_once('[').unwrap().1.split_once("[").map_or("", |(_, rest)| rest).to_owned()
        };
        assert_eq!(array("point3f[] points").matches('(').count(), 49);
        assert_eq!(array("faceVertexCounts").matches('4').count(), 36);
        assert_eq!(array("faceVertexIndices").matches(',').count(), 143);
        assert_eq!(array("int[] indices").matches(',').count(), 35);
    }
}
