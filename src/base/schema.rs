//! docs/schemas, made from the types that are written: a test beside each type holds the file to
//! it, and `UPDATE=1 cargo test --release --lib schema` writes the files anew.
//!
//! A description is the doc comment of its field. Types with named fields are closed.

use std::fmt::Write as _;
use std::path::Path;

use schemars::JsonSchema;
use schemars::generate::SchemaSettings;
use serde_json::{Map, Value};

/// Panics unless docs/schemas/NAME.schema.json is the schema of a type. Parts of the names in
/// `of_params` stand in params.schema.json.
pub(crate) fn holds<T: JsonSchema>(name: &str, title: &str, of_params: &[&str]) {
    let generator = SchemaSettings::draft2020_12().for_serialize().into_generator();
    let mut schema = generator.into_root_schema_for::<T>().to_value();
    tidy(&mut schema, "null", of_params);
    let whole = schema.as_object_mut().unwrap();
    whole.insert("title".to_owned(), title.into());
    drop_unused(whole);
    let mut now = String::new();
    write(&schema, &keyword_place, 0, &mut now);
    now.push('\n');
    let path = format!("docs/schemas/{name}.schema.json");
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(path);
    if std::env::var_os("UPDATE").is_some() {
        std::fs::write(&path, now).unwrap();
        return;
    }
    let held = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(held == now, "{name}.schema.json is not of its type: UPDATE=1 writes it anew");
}

/// Makes a schema, and all in it, one as docs/schemas/README.md says. `nothing` is the word for a
/// value that is not known.
fn tidy(schema: &mut Value, nothing: &str, of_params: &[&str]) {
    let Some(keywords) = schema.as_object_mut() else { return };
    // How the program holds a number, and what it takes where nothing is said.
    keywords.remove("format");
    keywords.remove("default");
    keywords.retain(|keyword, said| keyword != "additionalProperties" || *said != true);
    if keywords.contains_key("properties") && !keywords.contains_key("additionalProperties") {
        keywords.insert("additionalProperties".to_owned(), false.into());
    }
    let required = keywords.get("required").cloned().unwrap_or_default();
    let required: Vec<&Value> = required.as_array().into_iter().flatten().collect();
    let of_all = keywords.get("description").cloned();
    for (keyword, said) in keywords.iter_mut() {
        match (keyword.as_str(), said) {
            ("description", Value::String(text)) => *text = description(text, nothing),
            ("$ref", Value::String(target)) => {
                let part = target.strip_prefix("#/$defs/").unwrap_or_default();
                if part == "Params" {
                    "params.schema.json".clone_into(target);
                } else if of_params.contains(&part) {
                    *target = format!("params.schema.json{target}");
                }
            }
            ("properties", Value::Object(parts)) => {
                let is_variant = parts.len() == 1;
                for (name, part) in parts {
                    // The value of an enum's variant is described by the variant.
                    let described = part.as_object_mut().filter(|_| is_variant);
                    if let Some((part, text)) = described.zip(of_all.clone()) {
                        part.entry("description").or_insert(text);
                    }
                    let is_required = required.iter().any(|key| *key == name);
                    tidy(part, if is_required { "null" } else { "not there" }, of_params);
                }
            }
            ("$defs", Value::Object(parts)) => {
                parts.values_mut().for_each(|part| tidy(part, "null", of_params));
            }
            ("oneOf" | "anyOf", Value::Array(parts)) => {
                parts.iter_mut().for_each(|part| tidy(part, nothing, of_params));
            }
            ("items" | "additionalProperties", part) => tidy(part, nothing, of_params),
            _ => {}
        }
    }
}

/// A doc comment in one line, without its links and without what it escapes.
fn description(text: &str, nothing: &str) -> String {
    let (open, close) = ("\u{1}", "\u{2}");
    let text = text.replace('\n', " ").replace("\\[", open).replace("\\]", close);
    let text = text.replace("[`", "`").replace("`]", "`").replace("`None`", nothing);
    text.replace(open, "[").replace(close, "]")
}

/// Takes out the definitions that nothing refers to.
fn drop_unused(schema: &mut Map<String, Value>) {
    let Some(Value::Object(mut parts)) = schema.remove("$defs") else { return };
    loop {
        let used = |name: &str| {
            let others = parts.iter().filter(|(other, _)| *other != name).map(|(_, part)| part);
            let said = format!("\"#/$defs/{name}\"");
            others.chain(schema.values()).any(|part| part.to_string().contains(&said))
        };
        let unused: Vec<String> = parts.keys().filter(|name| !used(name)).cloned().collect();
        if unused.is_empty() {
            break;
        }
        parts.retain(|name, _| !unused.contains(name));
    }
    if !parts.is_empty() {
        schema.insert("$defs".to_owned(), parts.into());
    }
}

/// Where a keyword stands in its schema: first what it is, last what is in it.
fn keyword_place(keyword: &str) -> usize {
    const FIRST: [&str; 5] = ["$schema", "title", "description", "type", "$ref"];
    const LAST: [&str; 4] = ["properties", "required", "additionalProperties", "$defs"];
    let last = LAST.iter().position(|other| *other == keyword).map(|k| FIRST.len() + 1 + k);
    let first = FIRST.iter().position(|other| *other == keyword);
    first.or(last).unwrap_or(FIRST.len())
}

/// JSON with the keys of each object in the order that `place` says; properties stand in the order
/// in which they are required.
fn write(value: &Value, place: &dyn Fn(&str) -> usize, indent: usize, out: &mut String) {
    let line = |out: &mut String, k: usize, indent: usize| {
        out.push_str(if k == 0 { "\n" } else { ",\n" });
        out.push_str(&" ".repeat(indent));
    };
    let end = format!("\n{}", " ".repeat(indent));
    match value {
        Value::Object(entries) if entries.len() == 1 && entries.values().all(Value::is_string) => {
            let (key, said) = entries.iter().next().unwrap();
            let _ = write!(out, "{{ {}: {said} }}", Value::from(key.as_str()));
        }
        Value::Object(entries) if !entries.is_empty() => {
            let required = entries.get("required").and_then(Value::as_array);
            let property_place = |name: &str| {
                let place = required.and_then(|all| all.iter().position(|key| *key == name));
                place.unwrap_or(usize::MAX)
            };
            let mut entries: Vec<_> = entries.iter().collect();
            entries.sort_by_key(|(key, _)| place(key));
            out.push('{');
            for (k, (key, part)) in entries.into_iter().enumerate() {
                line(out, k, indent + 2);
                let _ = write!(out, "{}: ", Value::from(key.as_str()));
                match key.as_str() {
                    "properties" => write(part, &property_place, indent + 2, out),
                    _ => write(part, &keyword_place, indent + 2, out),
                }
            }
            out.push_str(&end);
            out.push('}');
        }
        Value::Array(items) if !items.is_empty() => {
            let flat: Vec<String> = items.iter().map(Value::to_string).collect();
            let flat = format!("[{}]", flat.join(", "));
            if indent + flat.len() < 100 && !items.iter().any(Value::is_object) {
                return out.push_str(&flat);
            }
            out.push('[');
            for (k, item) in items.iter().enumerate() {
                line(out, k, indent + 2);
                write(item, place, indent + 2, out);
            }
            out.push_str(&end);
            out.push(']');
        }
        other => out.push_str(&other.to_string()),
    }
}
