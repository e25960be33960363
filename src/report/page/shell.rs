//! The document around a page's sections: head, style, contents, footer.
//!
//! A page is one file that asks nothing of any network: its policy (a `meta` element) forbids every
//! request, so that not even a mistake makes one. It needs no script: what scripts add is the view
//! that turns and tables that sort.

use maud::{DOCTYPE, Markup, PreEscaped, html};

/// The line that every report ends with.
pub use crate::fabric::params::NOTE;

const STYLE: &str = include_str!("style.css");
/// What a browser may load: nothing but what is in the file.
const POLICY: &str =
    "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:";

/// What is around the sections.
pub(super) struct Shell<'a> {
    /// What kind of report it is.
    pub kind: &'a str,
    /// What it is of.
    pub title: &'a str,
    /// A line below the title.
    pub subtitle: &'a str,
    /// Targets and names of the sections.
    pub contents: &'a [(&'a str, &'a str)],
    /// Scripts at the end of the page, which are trusted.
    pub scripts: &'a [&'a str],
}

impl Shell<'_> {
    /// The whole document.
    pub(super) fn around(&self, sections: &Markup) -> String {
        let page = html! {
            (DOCTYPE)
            html lang="en" {
                head {
                    meta charset="utf-8";
                    meta http-equiv="Content-Security-Policy" content=(POLICY);
                    meta name="viewport" content="width=device-width, initial-scale=1";
                    meta name="color-scheme" content="light dark";
                    meta name="generator" content=(concat!("scan2params ", env!("CARGO_PKG_VERSION")));
                    title { (self.title) " \u{2013} " (self.kind) }
                    link rel="icon" href="data:,";
                    style { (PreEscaped(STYLE)) }
                }
                body {
                    a .skip href="#main" { "Skip to the result" }
                    header {
                        p .kind { (self.kind) }
                        h1 { (self.title) }
                        p .subtitle { (self.subtitle) }
                    }
                    nav aria-label="Contents" {
                        ol { @for (target, name) in self.contents { li { a href={ "#" (target) } { (name) } } } }
                    }
                    main id="main" { (sections) }
                    footer {
                        p .note { (number_note()) }
                        p { "scan2params " (env!("CARGO_PKG_VERSION")) }
                    }
                    @for script in self.scripts { script { (PreEscaped(*script)) } }
                }
            }
        };
        page.into_string()
    }
}

/// [`NOTE`] as a sentence.
fn number_note() -> String {
    super::number::sentence(NOTE)
}
