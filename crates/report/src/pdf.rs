//! A PDF by the typesetter Typst, in the program: pages, tables, formulas and pictures of a document.

mod math;

use std::collections::HashMap;
use std::sync::LazyLock;

use minijinja::value::{Serde, Value};
use minijinja::{AutoEscape, Environment, context};
use serde_json::{Value as Json, json};
use typst::diag::{FileError, FileResult, SourceDiagnostic};
use typst::foundations::{Bytes, Datetime, Duration, Smart};
use typst::syntax::{FileId, RootedPath, Source, VirtualPath, VirtualRoot};
use typst::text::{Font, FontBook};
use typst::utils::LazyHash;
use typst::{Library, LibraryExt, World};
use typst_layout::PagedDocument;
use typst_pdf::PdfOptions;

use crate::document::{BlockGroup, Document, DocumentBlock, parts, table_of_page};
use crate::{ReportError, visible};

const TEMPLATE: &str = include_str!("../assets/pages.typ");

/// Fonts of texts and formulas (Libertinus, New Computer Modern), and of pictures (DejaVu).
static FONTS: LazyLock<Vec<Font>> = LazyLock::new(|| {
    let own = [dejavu::sans::regular(), dejavu::sans::bold()];
    typst_assets::fonts().chain(own).flat_map(|data| Font::iter(Bytes::new(data))).collect()
});

/// Input of the typesetter: one document, its pictures and the fonts.
struct TypstInput {
    library: LazyHash<Library>,
    book: LazyHash<FontBook>,
    source: Source,
    files: HashMap<FileId, Bytes>,
}

impl World for TypstInput {
    fn library(&self) -> &LazyHash<Library> {
        &self.library
    }

    fn book(&self) -> &LazyHash<FontBook> {
        &self.book
    }

    fn main(&self) -> FileId {
        self.source.id()
    }

    fn source(&self, id: FileId) -> FileResult<Source> {
        if id == self.source.id() { Ok(self.source.clone()) } else { Err(missing(id)) }
    }

    fn file(&self, id: FileId) -> FileResult<Bytes> {
        self.files.get(&id).cloned().ok_or_else(|| missing(id))
    }

    fn font(&self, index: usize) -> Option<Font> {
        FONTS.get(index).cloned()
    }

    fn today(&self, _: Option<Duration>) -> Option<Datetime> {
        None
    }
}

fn missing(id: FileId) -> FileError {
    FileError::NotFound(id.vpath().get_without_slash().into())
}

fn file_id(name: &str) -> Result<FileId, ReportError> {
    let path = VirtualPath::new(name).map_err(|e| ReportError::Typeset(format!("{name}: {e:?}")))?;
    Ok(RootedPath::new(VirtualRoot::Project, path).intern())
}

/// PDF of the document.
pub(crate) fn pages(d: &Document) -> Result<Vec<u8>, ReportError> {
    let mut files = HashMap::new();
    for p in d.pictures() {
        files.insert(file_id(&format!("{}.svg", p.name))?, Bytes::from_string(p.svg()));
    }
    let desk = TypstInput {
        library: LazyHash::new(Library::default()),
        book: LazyHash::new(FontBook::from_fonts(FONTS.iter())),
        source: Source::new(file_id("review.typ")?, source(d)?),
        files,
    };
    let refused = |errors: &[SourceDiagnostic]| {
        let text: Vec<&str> = errors.iter().map(|e| e.message.as_str()).collect();
        ReportError::Typeset(text.join("; "))
    };
    let pages = typst::compile::<PagedDocument>(&desk).output.map_err(|e| refused(&e))?;
    let options = PdfOptions { ident: Smart::Custom(d.title.clone()), ..PdfOptions::default() };
    typst_pdf::pdf(&pages, &options).map_err(|e| refused(&e))
}

/// Text as a string of the typesetter's language, without markup.
fn quoted(text: &str) -> String {
    format!("\"{}\"", visible(text).replace('\\', "\\\\").replace('"', "\\\""))
}

fn source(d: &Document) -> Result<String, ReportError> {
    let mut environment = Environment::new();
    environment.set_auto_escape_callback(|_| AutoEscape::None);
    environment.add_filter("quoted", |text: String| quoted(&text));
    environment.add_template("pages", TEMPLATE)?;
    let parts: Vec<Json> = parts(&d.blocks).into_iter().map(part).collect();
    Ok(environment.get_template("pages")?.render(context! {
        title => d.title.clone(),
        lead => d.lead.clone(),
        parts => Value::from(Serde(&parts)),
    })?)
}

fn part(part: BlockGroup<'_>) -> Json {
    let block = match part {
        BlockGroup::Pictures(pictures) => {
            let of = |p: &&crate::document::Picture| json!({ "name": p.name, "caption": p.caption });
            let width = if pictures.iter().any(|p| p.is_wide()) { "100%" } else { "11cm" };
            let pictures: Vec<Json> = pictures.iter().map(of).collect();
            return json!({ "kind": "pictures", "pictures": pictures, "width": width });
        }
        BlockGroup::Block(block) => block,
    };
    match block {
        DocumentBlock::Section { level, title } => {
            json!({ "kind": "section", "level": level, "title": title })
        }
        DocumentBlock::Text(text) => json!({ "kind": "text", "text": text }),
        DocumentBlock::List { heading, lines } => {
            json!({ "kind": "list", "heading": heading, "lines": lines })
        }
        DocumentBlock::Table { heading, columns, rows } => table_of_page(heading, columns, rows),
        DocumentBlock::Formulas { heading, lines } => {
            let lines: Vec<String> = lines.iter().map(|l| math::typst(&l.latex)).collect();
            json!({ "kind": "formulas", "heading": heading, "lines": lines })
        }
        // pictures come in groups, a status is a table here, and folds are taken apart
        DocumentBlock::Picture(_)
        | DocumentBlock::Status(_)
        | DocumentBlock::Fold(_)
        | DocumentBlock::NewPage => Json::Null,
    }
}
