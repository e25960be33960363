//! A measured fabric as a params.json, which `simulate`, `export` and `augment` take.

use serde_json::{Value, json};

use super::Measured;
use crate::fabric::{Fabric, STIFFNESSES, TABLE_2};

/// Which values a fabric takes where a file has both.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Take {
    /// Those that the tester gives; recomputed ones where it gives none.
    Given,
    /// Those from the raw series; given ones where there are no series.
    Recomputed,
}

impl Measured {
    /// The fabric of these values. `density_kg_m2` goes before the file's.
    ///
    /// # Errors
    /// What is missing, in words.
    pub fn fabric(&self, take: Take, density_kg_m2: Option<f64>) -> Result<Fabric, String> {
        let mut si = [0.0; STIFFNESSES + 1];
        let mut missing = Vec::new();
        for (si, stiffness) in si.iter_mut().zip(&self.stiffnesses) {
            let recomputed = stiffness.recomputed.as_ref().ok().map(|found| found.value);
            let value = match take {
                Take::Given => stiffness.given.or(recomputed),
                Take::Recomputed => recomputed.or(stiffness.given),
            };
            match value {
                Some(value) => *si = value,
                None => missing.push(stiffness.key),
            }
        }
        if !missing.is_empty() {
            return Err(format!(
                "it has no {} and no series to take it from; give all seven values to `simulate` \
                 as flags",
                missing.join(", ")
            ));
        }
        let density = density_kg_m2.or(self.density_kg_m2);
        si[STIFFNESSES] = density.ok_or("it has no mass; give --density")?;
        Ok(Fabric::from_si(si))
    }

    /// The text of a params.json with these values, and where they are from.
    #[must_use]
    pub fn params_json(&self, fabric: &Fabric, take: Take) -> Value {
        let paper = fabric.to_paper_units();
        let entry = |k: usize| json!({ "value": paper[k], "unit": TABLE_2[k].unit });
        let mut parameters = json!({});
        for (k, stiffness) in self.stiffnesses.iter().enumerate() {
            let is_given = match take {
                Take::Given => stiffness.given.is_some(),
                Take::Recomputed => stiffness.recomputed.is_err(),
            };
            parameters[stiffness.key] = entry(k);
            parameters[stiffness.key]["from"] =
                json!(if is_given { "given by the tester" } else { "recomputed from its series" });
        }
        let is_own = self.density_kg_m2 == Some(fabric.density_kg_m2);
        let mut density = entry(STIFFNESSES);
        density["from"] = json!(if is_own { "the file" } else { "--density" });
        json!({
            "parameters": parameters,
            "density": density,
            "measured": { "name": self.name, "tester": self.tester, "notes": self.notes() },
        })
    }
}
