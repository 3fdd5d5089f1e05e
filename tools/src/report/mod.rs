//! What people look at: figures, and self-contained pages of figures and tables.
//!
//! | file | what |
//! |---|---|
//! | [`page`] | a page: verdict, sections, provenance |
//! | [`fit`], [`health`], [`diagnosis`], [`adapt`] | the reports of a fit, of a series of states, of a diagnosis, of a replay through the adaptation |
//! | [`figures`] | which curves in which units |
//! | [`pictures`] | recordings and models as they are |
//! | [`plot`] | curves, bars and heat maps as SVG |

pub mod adapt;
mod bins;
pub mod diagnosis;
mod diagnosis_words;
pub mod figures;
pub mod fit;
pub mod fit_words;
pub mod health;
pub mod health_words;
pub mod note_words;
pub mod page;
pub mod pictures;
pub mod plot;

/// A file's name without folder and ending.
fn stem(name: &str) -> String {
    std::path::Path::new(name).file_stem().map_or_else(|| name.to_owned(), |stem| stem.to_string_lossy().into_owned())
}

/// A text with a capital at its beginning; names of parameters stay as they are.
fn capitalised(words: &str) -> String {
    if words.split(' ').next().is_some_and(|first| first.contains('_')) {
        return words.to_owned();
    }
    let mut letters = words.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}
