//! `MuJoCo` 4.0: MJCF with the specimen as a flex of dimension 2.
//!
//! A flex knows Young's modulus E, Poisson's ratio nu and a thickness t. Since 4.0 its membrane is
//! a plane isotropic one (stretch E t, shear E t / (2 (1 + nu))) and its bending that of a plate, E
//! t^3 / (12 (1 - nu^2)). So nu = S / (2 H) - 1 within 0 to 0.49, t = sqrt(12 B (1 - nu^2) / S) and
//! E = S / t: a thickness that makes both stiffnesses, not the fabric's. Before 4.0 stretching used
//! a quarter of the shear modulus and bending 3/4 (1 - nu) of the plate's; the numbers for these
//! versions follow from the changelog's rule and are in the file's comment. The often quoted t =
//! sqrt(48 B (1 + nu) / S) makes bending 4 times too stiff since 4.0.

use std::fmt::Write as _;

use super::exported::{Exported, Options};
use super::going_along::{self, number};
use super::isotropic::Isotropic;
use crate::base::frame::SPECIMEN_SIDE_M;
use crate::base::units::M_PER_MM;
use crate::fabric::Fabric;
use crate::fabric::params::Params;

/// Largest Poisson's ratio: `MuJoCo` takes less than a half.
const MOST_POISSON: f64 = 0.49;
/// Edges of the specimen's cells where they are not given \[m\].
const EDGE_M: f64 = 0.010;
/// Rayleigh damping \[s\], a choice: cloth that comes to rest within a second.
const DAMPING_S: f64 = 0.01;

/// The constants of a flex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Flex {
    young_pa: f64,
    poisson: f64,
    thickness_m: f64,
}

impl Flex {
    pub(super) fn of(isotropic: &Isotropic) -> Self {
        let poisson = isotropic.poisson(MOST_POISSON);
        let Isotropic { stretch_n_m, bending_nm, .. } = *isotropic;
        let thickness_m = (12.0 * bending_nm * (1.0 - poisson * poisson) / stretch_n_m).sqrt();
        Self { young_pa: stretch_n_m / thickness_m, poisson, thickness_m }
    }

    /// The same cloth before 4.0: nu' = 2 nu, t' = t sqrt(3 (1 - 2 nu)),
    /// E' = E t (1 + 2 nu) / (4 (1 + nu) t') of the changelog, solved for what has no dash.
    fn before_4(&self) -> Self {
        let poisson = 0.5 * self.poisson;
        let thickness_m = self.thickness_m / (3.0 * (1.0 - 2.0 * poisson)).sqrt();
        let young_pa = self.young_pa * self.thickness_m * 4.0 * (1.0 + poisson)
            / ((1.0 + 2.0 * poisson) * thickness_m);
        Self { young_pa, poisson, thickness_m }
    }

    fn attributes(&self) -> String {
        format!(
            r#"young="{}" poisson="{}" thickness="{}""#,
            number(self.young_pa),
            number(self.poisson),
            number(self.thickness_m)
        )
    }

    /// The element of MJCF.
    pub(super) fn elasticity(&self) -> String {
        let elastic = self.attributes();
        format!(r#"<elasticity {elastic} damping="{DAMPING_S}" elastic2d="both"/>"#)
    }

    /// What of the fabric a flex does not have.
    pub(super) fn lost(&self, fabric: &Fabric) -> Vec<String> {
        let mut lost = Isotropic::lost(fabric);
        let shear = 0.5 * self.young_pa * self.thickness_m / (1.0 + self.poisson);
        if (shear / fabric.shear_n_m - 1.0).abs() > 1e-9 {
            lost.push(format!(
                "shear ({:.4} N/m): an isotropic flex with this stretch has {shear:.4} N/m",
                fabric.shear_n_m
            ));
        }
        lost
    }

    /// What is to be known of its numbers, for any mesh.
    pub(super) fn notes(&self) -> Vec<String> {
        vec![
            format!(
                "thickness {:.4} mm makes both stretch and bending; it is not the fabric's",
                self.thickness_m / M_PER_MM
            ),
            format!("for MuJoCo 4.0 and later; before it: {}", self.before_4().attributes()),
        ]
    }
}

pub(super) fn write(params: &Params, options: &Options) -> Exported {
    let fabric = &params.fabric;
    let flex = Flex::of(&Isotropic::of(fabric));
    let edge_m = options.edge_m.unwrap_or(EDGE_M);
    let cells = (SPECIMEN_SIDE_M / edge_m).round().max(1.0);
    let spacing_m = SPECIMEN_SIDE_M / cells;
    let mass_kg = fabric.density_kg_m2 * SPECIMEN_SIDE_M * SPECIMEN_SIDE_M;
    let lost = flex.lost(fabric);
    let mut notes = flex.notes();
    notes.push(format!(
        "the specimen has cells of {} mm; the constants hold for any mesh of triangles that has no \
         common direction, on a grid bending about the diagonals is off by up to a factor of 3",
        spacing_m / M_PER_MM
    ));
    let comment = comment(&going_along::lines(params, &lost, &notes));
    let name = attribute(&options.name);
    let points = cells as usize + 1;
    let friction =
        options.friction.map_or(String::new(), |mu| format!(r#" friction="{}""#, number(mu)));
    let text = format!(
        r#"<!--
{comment}-->
<mujoco model="{name}">
  <option timestep="0.002" integrator="discrete" gravity="0 0 -9.80665"/>
  <worldbody>
    <flexcomp name="cloth" type="grid" dim="2" count="{points} {points} 1" spacing="{h} {h} {h}" mass="{mass}" radius="0.0005" pos="0 0 0.5">
      <contact{friction} selfcollide="auto"/>
      {elasticity}
      <pin id="0"/>
    </flexcomp>
  </worldbody>
</mujoco>
"#,
        h = number(spacing_m),
        mass = number(mass_kg),
        elasticity = flex.elasticity(),
    );
    Exported { text, companion: None, lost, notes }
}

/// Lines for an XML comment: two hyphens would end it.
pub(super) fn comment(lines: &[String]) -> String {
    lines.iter().fold(String::new(), |mut text, line| {
        // writing to a string cannot fail
        let _ = writeln!(text, "  {}", line.replace("--", "- -"));
        text
    })
}

/// Text for an XML attribute.
pub(super) fn attribute(text: &str) -> String {
    let text = text.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;");
    text.replace(char::is_control, " ")
}

#[cfg(test)]
mod tests {
    use super::*;

    const ISOTROPIC: Isotropic =
        Isotropic { stretch_n_m: 150.0, shear_n_m: 60.0, bending_nm: 1.5e-6 };

    #[test]
    fn stretch_shear_and_bending_are_those_of_a_plate() {
        let Flex { young_pa, poisson, thickness_m } = Flex::of(&ISOTROPIC);
        assert!((young_pa * thickness_m - 150.0).abs() < 1e-9);
        assert!((young_pa * thickness_m / (2.0 * (1.0 + poisson)) - 60.0).abs() < 1e-9);
        let plate = young_pa * thickness_m.powi(3) / (12.0 * (1.0 - poisson * poisson));
        assert!((plate / 1.5e-6 - 1.0).abs() < 1e-12, "{plate}");
    }

    /// Old stretch: a quarter of mu and half of the 3D lambda; old bending: 3/4 (1 - nu) of the
    /// plate's.
    #[test]
    fn before_4_the_old_formulas_give_the_same_cloth() {
        for shear_n_m in [60.0, 75.0, 100.0] {
            let isotropic = Isotropic { shear_n_m, ..ISOTROPIC };
            let (new, old) = (Flex::of(&isotropic), Flex::of(&isotropic).before_4());
            let Flex { young_pa, poisson: nu, thickness_m: t } = old;
            let mu = 0.25 * young_pa / (2.0 * (1.0 + nu)) * t;
            let new_mu = new.young_pa / (2.0 * (1.0 + new.poisson)) * new.thickness_m;
            assert!((mu / new_mu - 1.0).abs() < 1e-12, "{mu} {new_mu}");
            let plate = young_pa * t.powi(3) / (12.0 * (1.0 - nu * nu));
            let bending = 0.75 * (1.0 - nu) * plate;
            assert!((bending / 1.5e-6 - 1.0).abs() < 1e-12, "{nu}: {bending}");
        }
    }

    #[test]
    fn names_and_remarks_cannot_end_the_comment_or_the_attribute() {
        let mut params = Params::of(Fabric::mean_knit());
        params.input = Some("a--b --> <c>\n.ply".to_owned());
        let text = write(&params, &Options::named("a \"<b>\" & c")).text;
        assert_eq!(text.matches("-->").count(), 1);
        assert_eq!(text.matches("--").count(), 2, "{text}");
        assert!(text.contains(r#"model="a &quot;&lt;b>&quot; &amp; c""#), "{text}");
        assert!(text.contains(r#"count="31 31 1" spacing="0.01 0.01 0.01""#), "{text}");
    }
}
