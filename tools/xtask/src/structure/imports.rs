//! What each file of a crate imports from the others, by its paths, and the strings that it holds. Tests inside of files do not count.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, anyhow};
use proc_macro2::{Delimiter, TokenStream, TokenTree};

/// A source file.
pub struct Source {
    /// Below the root of the crate, with `/`.
    pub path: String,
    /// Its lines.
    pub lines: usize,
    /// Indices of the files that it imports from.
    pub imports: BTreeSet<usize>,
    /// The strings in it, outside of tests.
    pub strings: BTreeSet<String>,
}

impl Source {
    /// The folder below the root that it lies in, or its own name.
    pub fn folder(&self) -> &str {
        self.path.split('/').next().unwrap_or(&self.path)
    }
}

/// A path of a module, without `crate`.
type Module = Vec<String>;

/// Reads every file below `root`.
pub fn read(root: &Path) -> Result<Vec<Source>> {
    let mut files = Vec::new();
    list(root, &mut files)?;
    files.sort();
    let mut scans = Vec::new();
    let mut modules: BTreeMap<Module, usize> = BTreeMap::new();
    let mut sources = Vec::new();
    for (index, file) in files.iter().enumerate() {
        let text = std::fs::read_to_string(file).with_context(|| format!("cannot read {}", file.display()))?;
        let path = file.strip_prefix(root)?.to_string_lossy().replace('\\', "/");
        let module = module_of(&path);
        let tokens: TokenStream = text.parse().map_err(|error| anyhow!("{}: {error}", file.display()))?;
        let mut scan = Scan { module: module.clone(), ..Scan::default() };
        scan.scan(tokens, 0);
        modules.insert(module, index);
        sources.push(Source {
            path,
            lines: text.lines().count(),
            imports: BTreeSet::new(),
            strings: scan.strings.clone(),
        });
        scans.push(scan);
    }
    let exports: Vec<&Scan> = scans.iter().collect();
    for (scan, source) in scans.iter().zip(&mut sources) {
        source.imports = scan.uses.iter().filter_map(|path| resolve(path, &modules, &exports, 0)).collect();
    }
    for (index, source) in sources.iter_mut().enumerate() {
        source.imports.remove(&index);
    }
    Ok(sources)
}

fn list(folder: &Path, files: &mut Vec<PathBuf>) -> Result<()> {
    for entry in std::fs::read_dir(folder).with_context(|| format!("cannot read {}", folder.display()))? {
        let path = entry?.path();
        if path.is_dir() {
            list(&path, files)?;
        } else if path.extension().is_some_and(|e| e == "rs") {
            files.push(path);
        }
    }
    Ok(())
}

fn module_of(path: &str) -> Module {
    let path = path.trim_end_matches(".rs");
    let mut module: Module = path.split('/').map(str::to_owned).collect();
    if matches!(module.last().map(String::as_str), Some("mod" | "lib" | "main")) {
        module.pop();
    }
    module
}

/// The file that defines what a path names, through re-exports.
fn resolve(path: &[String], modules: &BTreeMap<Module, usize>, scans: &[&Scan], depth: usize) -> Option<usize> {
    let known = (0..=path.len()).rev().find(|&n| modules.contains_key(&path[..n]))?;
    let index = modules[&path[..known]];
    let exported = path.get(known).and_then(|item| scans[index].exports.get(item));
    match exported {
        Some(target) if depth < 8 => resolve(target, modules, scans, depth + 1).or(Some(index)),
        // The crate itself is what every file is in.
        _ if known == 0 => None,
        _ => Some(index),
    }
}

/// What the tokens of a file say.
#[derive(Default)]
struct Scan {
    module: Module,
    /// Absolute paths used.
    uses: BTreeSet<Module>,
    /// Names that the file re-exports, and what they stand for.
    exports: BTreeMap<String, Module>,
    strings: BTreeSet<String>,
}

impl Scan {
    /// Walks tokens inside `depth` inline modules.
    fn scan(&mut self, tokens: TokenStream, depth: usize) {
        let tokens: Vec<TokenTree> = tokens.into_iter().collect();
        let mut at = 0;
        while at < tokens.len() {
            match &tokens[at] {
                // `#[cfg(test)]` and what it marks.
                TokenTree::Punct(p) if p.as_char() == '#' && is_cfg_test(tokens.get(at + 1)) => {
                    at += 2;
                    while at < tokens.len() && !ends_item(&tokens[at]) {
                        at += 1;
                    }
                }
                // Documentation and other attributes.
                TokenTree::Punct(p) if p.as_char() == '#' && is_brackets(tokens.get(at + 1)) => at += 1,
                TokenTree::Ident(word) if *word == "use" => {
                    let public = at > 0 && is_public(&tokens[..at]);
                    let end = (at..tokens.len()).find(|&i| is_punct(&tokens[i], ';')).unwrap_or(tokens.len());
                    self.tree(&tokens[at + 1..end], Vec::new(), public, depth);
                    at = end;
                }
                TokenTree::Ident(word)
                    if ["crate", "super", "self"].contains(&word.to_string().as_str())
                        && is_colons(&tokens, at + 1)
                        && !(at >= 2 && is_colons(&tokens, at - 2)) =>
                {
                    let mut path = vec![word.to_string()];
                    while is_colons(&tokens, at + 1)
                        && let Some(TokenTree::Ident(next)) = tokens.get(at + 3)
                    {
                        path.push(next.to_string());
                        at += 3;
                    }
                    self.add(&path, depth);
                }
                TokenTree::Group(group) => {
                    let inline = group.delimiter() == Delimiter::Brace
                        && at >= 2
                        && matches!(&tokens[at - 2], TokenTree::Ident(word) if *word == "mod");
                    self.scan(group.stream(), depth + usize::from(inline));
                }
                TokenTree::Literal(literal) => {
                    let text = literal.to_string();
                    if let Some(text) = text.strip_prefix('"').and_then(|t| t.strip_suffix('"')) {
                        self.strings.insert(text.to_owned());
                    }
                }
                _ => {}
            }
            at += 1;
        }
    }

    /// A tree of `use`.
    fn tree(&mut self, tokens: &[TokenTree], mut path: Module, public: bool, depth: usize) {
        for (at, token) in tokens.iter().enumerate() {
            match token {
                TokenTree::Ident(word) if *word == "as" => {
                    let name = tokens.get(at + 1).map(TokenTree::to_string).unwrap_or_default();
                    return self.leaf(path, name, public, depth);
                }
                TokenTree::Ident(word) => path.push(word.to_string()),
                TokenTree::Group(group) => {
                    let inner: Vec<TokenTree> = group.stream().into_iter().collect();
                    for part in inner.split(|token| is_punct(token, ',')).filter(|part| !part.is_empty()) {
                        self.tree(part, path.clone(), public, depth);
                    }
                    return;
                }
                _ => {}
            }
        }
        let name = path.last().cloned().unwrap_or_default();
        self.leaf(path, name, public, depth);
    }

    fn leaf(&mut self, mut path: Module, name: String, public: bool, depth: usize) {
        if path.len() > 1 && path.last().is_some_and(|last| last == "self") {
            path.pop();
        }
        let Some(absolute) = self.absolute(&path, depth) else { return };
        if public {
            self.exports.insert(name, absolute);
        } else {
            self.uses.insert(absolute);
        }
    }

    fn add(&mut self, path: &[String], depth: usize) {
        self.uses.extend(self.absolute(path, depth));
    }

    /// A path from the root of the crate. One that starts with a name may be that of a module below this one; what is none resolves to this file.
    fn absolute(&self, path: &[String], depth: usize) -> Option<Module> {
        let first = path.first()?.as_str();
        let mut module = self.module.clone();
        let inline = (0..depth).map(|_| String::new());
        module.extend(inline);
        let mut rest = path;
        match first {
            "crate" => {
                module.clear();
                rest = &path[1..];
            }
            "self" => rest = &path[1..],
            "super" => {
                while rest.first().is_some_and(|word| word == "super") {
                    module.pop();
                    rest = &rest[1..];
                }
            }
            _ => {}
        }
        module.retain(|word| !word.is_empty());
        module.extend(rest.iter().cloned());
        Some(module)
    }
}

fn is_punct(token: &TokenTree, c: char) -> bool {
    matches!(token, TokenTree::Punct(p) if p.as_char() == c)
}

fn is_colons(tokens: &[TokenTree], at: usize) -> bool {
    let colon = |i: usize| tokens.get(i).is_some_and(|token| is_punct(token, ':'));
    colon(at) && colon(at + 1)
}

fn is_brackets(token: Option<&TokenTree>) -> bool {
    matches!(token, Some(TokenTree::Group(group)) if group.delimiter() == Delimiter::Bracket)
}

fn is_cfg_test(token: Option<&TokenTree>) -> bool {
    matches!(token, Some(TokenTree::Group(group)) if group.stream().to_string().replace(' ', "") == "cfg(test)")
}

fn ends_item(token: &TokenTree) -> bool {
    is_punct(token, ';') || matches!(token, TokenTree::Group(group) if group.delimiter() == Delimiter::Brace)
}

/// Whether what stands before `use` makes it visible outside of the file: `pub` or `pub(…)`.
fn is_public(before: &[TokenTree]) -> bool {
    let is_pub = |token: &TokenTree| matches!(token, TokenTree::Ident(word) if *word == "pub");
    matches!(before, [.., word, TokenTree::Group(_)] | [.., word] if is_pub(word))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scan(text: &str) -> Scan {
        let mut scan = Scan { module: vec!["fit".to_owned(), "select".to_owned()], ..Scan::default() };
        scan.scan(text.parse().unwrap(), 0);
        scan
    }

    fn uses(text: &str) -> Vec<String> {
        scan(text).uses.iter().map(|path| path.join("::")).collect()
    }

    #[test]
    fn paths_are_found_in_trees_in_code_and_in_macros() {
        let text = "use crate::{a::{self, B as C}, d::*}; fn f() { super::e::g(); matches!(x, crate::h::I) }";
        assert_eq!(uses(text), ["a", "a::B", "d", "fit::e::g", "h::I"]);
    }

    #[test]
    fn tests_and_documentation_do_not_count() {
        let text = "/// See \"wear\".\nconst A: &str = \"creep\";\n#[cfg(test)]\nmod tests { use crate::a::B; fn f() { \"wear\"; } }";
        assert_eq!(uses(text), [""; 0]);
        assert_eq!(scan(text).strings.into_iter().collect::<Vec<_>>(), ["creep"]);
    }

    #[test]
    fn a_re_export_leads_to_what_defines_it() {
        let export = scan("pub use inner::Thing;");
        assert_eq!(export.exports["Thing"].join("::"), "fit::select::inner::Thing");
        assert!(export.uses.is_empty());
    }
}
