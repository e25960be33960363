//! The schemas of docs/schemas, and whether a document fits one.
//!
//! The validator is one of its own: those on the registry ask other features of hashbrown, ahash,
//! num-bigint or syn than the program does, so that parquet, the network's runtime and this library
//! would be compiled twice in every check. It knows the keywords that the schemas use and no other:
//! an unknown one panics, so that none is passed over. That it reads them as the standard means
//! them is held by `verdicts.txt`, which the reference implementation writes
//! (`scripts/check_schemas.py`).

#![allow(dead_code, reason = "shared by several test programs, each of which uses a part")]

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use serde_json::{Map, Value};

/// The folder of the schemas.
pub fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/schemas")
}

pub fn json(path: &Path) -> Value {
    let text = std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    serde_json::from_str(&text).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// A schema by its name: `params` for params.schema.json. Each is read once.
pub fn schema(name: &str) -> &'static Value {
    static READ: Mutex<BTreeMap<String, &'static Value>> = Mutex::new(BTreeMap::new());
    let mut read = READ.lock().unwrap_or_else(PoisonError::into_inner);
    read.entry(name.to_owned())
        .or_insert_with(|| Box::leak(Box::new(json(&folder().join(format!("{name}.schema.json"))))))
}

/// All names of schemas.
pub fn names() -> Vec<String> {
    let entries = std::fs::read_dir(folder()).unwrap().map(|entry| entry.unwrap().file_name());
    let name = |file: String| Some(file.strip_suffix(".schema.json")?.to_owned());
    let mut names: Vec<String> =
        entries.filter_map(|file| name(file.into_string().unwrap())).collect();
    names.sort();
    names
}

/// Panics unless a document fits a schema.
pub fn must_fit(name: &str, document: &Value) {
    let faults = faults(name, document);
    assert!(faults.is_empty(), "not as docs/schemas/{name}.schema.json says: {faults:#?}");
}

/// What is wrong with a document, each with its place.
pub fn faults(name: &str, document: &Value) -> Vec<String> {
    let mut faults = Vec::new();
    let root = schema(name);
    Schema { root, part: root }.check(document, "", &mut faults);
    faults
}

/// A part of a schema, with the document that it is of.
#[derive(Clone, Copy)]
struct Schema<'a> {
    root: &'a Value,
    part: &'a Value,
}

impl<'a> Schema<'a> {
    fn of(self, part: &'a Value) -> Self {
        Self { part, ..self }
    }

    fn fits(self, value: &Value) -> bool {
        let mut faults = Vec::new();
        self.check(value, "", &mut faults);
        faults.is_empty()
    }

    fn check(self, value: &Value, place: &str, faults: &mut Vec<String>) {
        let keywords = self.part.as_object().expect("a schema is an object");
        let mut fault = |what: String| faults.push(format!("{place}: {what}"));
        for (keyword, said) in keywords {
            let number = || said.as_f64().expect("a number");
            let holds = match keyword.as_str() {
                "$schema" | "title" | "description" | "$defs" => true,
                // Those below look into the value.
                "$ref" | "properties" | "additionalProperties" | "items" | "dependentRequired" => {
                    true
                }
                "type" => match said {
                    Value::Array(kinds) => kinds.iter().any(|kind| is_of(value, kind)),
                    kind => is_of(value, kind),
                },
                "enum" => said.as_array().unwrap().iter().any(|other| same(value, other)),
                "const" => same(value, said),
                "pattern" => value.as_str().is_none_or(|text| matches(text, said)),
                "minimum" => value.as_f64().is_none_or(|v| v >= number()),
                "maximum" => value.as_f64().is_none_or(|v| v <= number()),
                "exclusiveMinimum" => value.as_f64().is_none_or(|v| v > number()),
                "minItems" => value.as_array().is_none_or(|v| v.len() as f64 >= number()),
                "maxItems" => value.as_array().is_none_or(|v| v.len() as f64 <= number()),
                "oneOf" => {
                    let fits = said.as_array().unwrap().iter();
                    fits.filter(|part| self.of(part).fits(value)).count() == 1
                }
                "anyOf" => said.as_array().unwrap().iter().any(|part| self.of(part).fits(value)),
                "required" => {
                    let keys = said.as_array().unwrap().iter().map(|key| key.as_str().unwrap());
                    let missing: Vec<&str> = value.as_object().map_or_else(Vec::new, |object| {
                        keys.filter(|key| !object.contains_key(*key)).collect()
                    });
                    missing.iter().for_each(|key| fault(format!("`{key}` is missing")));
                    true
                }
                unknown => panic!("{place}: this validator does not know `{unknown}`"),
            };
            if !holds {
                fault(format!("{value} is against {keyword}: {said}"));
            }
        }
        if let Some(target) = keywords.get("$ref") {
            self.follow(target.as_str().unwrap(), value, place, faults);
        }
        if let (Some(items), Some(entries)) = (keywords.get("items"), value.as_array()) {
            for (k, entry) in entries.iter().enumerate() {
                self.of(items).check(entry, &format!("{place}/{k}"), faults);
            }
        }
        if let Some(object) = value.as_object() {
            self.check_object(keywords, object, place, faults);
        }
    }

    fn check_object(
        self,
        keywords: &'a Map<String, Value>,
        object: &Map<String, Value>,
        place: &str,
        faults: &mut Vec<String>,
    ) {
        let properties = keywords.get("properties").and_then(Value::as_object);
        for (key, value) in object {
            let place = format!("{place}/{key}");
            match (properties.and_then(|of| of.get(key)), keywords.get("additionalProperties")) {
                (Some(part), _) => self.of(part).check(value, &place, faults),
                (None, Some(Value::Bool(false))) => {
                    faults.push(format!("{place}: no key of this object"));
                }
                (None, Some(part)) => self.of(part).check(value, &place, faults),
                (None, None) => {}
            }
        }
        let dependent = keywords.get("dependentRequired").and_then(Value::as_object);
        for (_, asks) in
            dependent.into_iter().flatten().filter(|(key, _)| object.contains_key(*key))
        {
            for key in asks.as_array().unwrap().iter().map(|key| key.as_str().unwrap()) {
                if !object.contains_key(key) {
                    faults.push(format!("{place}: `{key}` is missing beside others"));
                }
            }
        }
    }

    /// Another part of this schema (`#/$defs/NAME`), another schema, or a part of that.
    fn follow(self, target: &str, value: &Value, place: &str, faults: &mut Vec<String>) {
        let (file, pointer) = target.split_once('#').unwrap_or((target, ""));
        let root = match file.strip_suffix(".schema.json") {
            Some(name) => schema(name),
            None => self.root,
        };
        let part = root.pointer(pointer).unwrap_or_else(|| panic!("{target}: no such part"));
        Schema { root, part }.check(value, place, faults);
    }
}

fn is_of(value: &Value, kind: &Value) -> bool {
    match kind.as_str().unwrap() {
        "null" => value.is_null(),
        "boolean" => value.is_boolean(),
        "string" => value.is_string(),
        "array" => value.is_array(),
        "object" => value.is_object(),
        "number" => value.is_number(),
        "integer" => value.as_f64().is_some_and(|v| v.fract() == 0.0),
        other => panic!("no type: {other}"),
    }
}

/// Equal, numbers by their value.
fn same(a: &Value, b: &Value) -> bool {
    match (a.as_f64(), b.as_f64()) {
        (Some(a), Some(b)) => a == b,
        _ => a == b,
    }
}

/// The patterns of the schemas: there is no other.
fn matches(text: &str, pattern: &Value) -> bool {
    let is_number = |part: &str| !part.is_empty() && part.bytes().all(|b| b.is_ascii_digit());
    match pattern.as_str().unwrap() {
        "^[0-9a-f]{64}$" => {
            let is_hex = |b: u8| b.is_ascii_digit() || (b'a'..=b'f').contains(&b);
            text.len() == 64 && text.bytes().all(is_hex)
        }
        "^[0-9]+\\.[0-9]+\\.[0-9]+" => {
            let parts: Vec<&str> = text.splitn(3, '.').collect();
            parts.len() == 3
                && is_number(parts[0])
                && is_number(parts[1])
                && parts[2].starts_with(|c: char| c.is_ascii_digit())
        }
        other => panic!("this validator does not know the pattern {other}"),
    }
}
