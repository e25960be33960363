//! Stands whose plate is seen from below: cloth, the plate's underside and what carries it lie
//! above each other.

use std::sync::OnceLock;

use crate::promises::hold;
use crate::scan_support::Drape;
use scan2params::geom::Mesh;
use scan2params::scan::Tuning;
use scan2params_lab::evaluate::scan::{Setup, find};

/// A knit of 18 mm bending length, simulated once.
fn stiff() -> &'static Drape {
    static DRAPE: OnceLock<Drape> = OnceLock::new();
    let knit = [130e3, 160e3, 75e3, 5721.0, 5721.0, 5721.0, 100.0];
    DRAPE.get_or_init(|| Drape::simulated(202, knit))
}

/// The search that took cloth, underside and post for one surface refused this scan: no plate
/// found, falling away on 6 % of its edge.
#[test]
fn a_stiff_drape_on_a_post_is_answered_with_the_plates_underside_in_sight() {
    let triangles = Drape::triangles().into_iter().map(|t| t.map(|v| v as u32)).collect();
    let mesh = Mesh { vertices: stiff().vertices.clone(), triangles };
    let setup = Setup::named("structured-light@post@below@views12").unwrap();
    let made = setup.scan(&mesh, 1).unwrap();
    let found = find(&made, &Tuning::default()).unwrap();
    hold("rim.post_below", 1e3 * found.boundary.mean_distance_m(&stiff().rim()));
}
