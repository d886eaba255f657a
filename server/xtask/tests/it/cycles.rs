//! Imports within a crate are acyclic as well: no cycle between its top modules, which are the files and folders of
//! `src`.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Folders of the workspace's crates.
const WINGS: [&str; 3] = ["server/core", "server/hardware", "server/service"];

/// Crates outside these folders.
const BESIDE: [&str; 4] = ["server/cli", "server/drawn", "server/reference", "server/xtask"];

/// Top module → the top modules that it imports.
type Imports = BTreeMap<String, BTreeSet<String>>;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn crates() -> Vec<PathBuf> {
    let inside = |folder: &Path| -> Vec<PathBuf> {
        std::fs::read_dir(folder).unwrap().map(|folder| folder.unwrap().path()).collect()
    };
    let mut crates: Vec<PathBuf> = WINGS.into_iter().flat_map(|wing| inside(&root().join(wing))).collect();
    // A folder of crates, such as that of the doors.
    while let Some(at) = crates.iter().position(|folder| !folder.join("Cargo.toml").is_file()) {
        let folder = crates.swap_remove(at);
        crates.extend(inside(&folder));
    }
    crates.extend(BESIDE.map(|folder| root().join(folder)));
    crates
}

/// Every source file below `folder` that is part of the program.
fn sources(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_stem().unwrap().to_string_lossy().into_owned();
        match path.is_dir() {
            _ if name == "tests" || name.ends_with("_tests") => {}
            true => found.extend(sources(&path)),
            false if path.extension().is_some_and(|extension| extension == "rs") => found.push(path),
            false => {}
        }
    }
    found
}

/// The identifiers after every `crate::`, including lists in braces.
fn imported(text: &str) -> Vec<&str> {
    let word =
        |text: &'_ str| text.len() - text.trim_start_matches(|c: char| c.is_alphanumeric() || c == '_').len();
    let mut names = Vec::new();
    for (at, _) in text.match_indices("crate::") {
        let rest = &text[at + "crate::".len()..];
        match rest.strip_prefix('{') {
            Some(list) => {
                let list = &list[..list.find(';').unwrap_or(list.len())];
                let mut depth = 0;
                let mut begins = true;
                for (idx, letter) in list.char_indices() {
                    match letter {
                        '{' => depth += 1,
                        '}' => depth -= 1,
                        ',' if depth == 0 => begins = true,
                        letter if begins && !letter.is_whitespace() => {
                            names.push(&list[idx..idx + word(&list[idx..])]);
                            begins = false;
                        }
                        _ => {}
                    }
                }
            }
            None => names.push(&rest[..word(rest)]),
        }
    }
    names
}

/// The text without comments and without the items that only tests have.
fn without_tests(text: &str) -> String {
    let code = |line: &&str| !line.trim_start().starts_with("//");
    let text = text.lines().filter(code).collect::<Vec<_>>().join("\n");
    let mut parts = text.split("#[cfg(test)]");
    let mut kept = parts.next().unwrap_or_default().to_owned();
    kept.extend(parts.map(|part| &part[end_of_item(part)..]));
    kept
}

/// Where the first item of a text ends: at its semicolon, or at the brace that closes its first one.
fn end_of_item(text: &str) -> usize {
    let mut depth = 0_usize;
    for (at, letter) in text.char_indices() {
        match letter {
            '{' => depth += 1,
            '}' if depth == 1 => return at + 1,
            '}' => depth = depth.saturating_sub(1),
            ';' if depth == 0 => return at + 1,
            _ => {}
        }
    }
    text.len()
}

/// Re-exported names of a crate's root, with the top modules that define them.
fn re_exports(root: &str) -> BTreeMap<&str, &str> {
    let mut names = BTreeMap::new();
    for (at, _) in root.match_indices("pub use ") {
        let list = root[at + "pub use ".len()..].split(';').next().unwrap_or_default();
        let Some((module, list)) = list.split_once("::") else { continue };
        let words = list.split(|letter: char| !letter.is_alphanumeric() && letter != '_');
        names.extend(words.filter(|word| word.starts_with(char::is_uppercase)).map(|word| (word, module)));
    }
    names
}

fn imports(folder: &Path) -> Imports {
    let source = folder.join("src");
    let top = |path: &Path| {
        let first = path.strip_prefix(&source).unwrap().components().next().unwrap();
        first.as_os_str().to_string_lossy().trim_end_matches(".rs").to_owned()
    };
    let files = sources(&source);
    let modules: BTreeSet<String> = files.iter().map(|path| top(path)).collect();
    let crate_root = std::fs::read_to_string(source.join("lib.rs")).unwrap_or_default();
    let re_exports = re_exports(&crate_root);
    let mut imports = Imports::new();
    for path in &files {
        let from = top(path);
        let text = std::fs::read_to_string(path).unwrap();
        // Tests may import everything.
        let text = without_tests(&text);
        let names = imported(&text).into_iter().map(|name| re_exports.get(name).copied().unwrap_or(name));
        let names = names.filter(|name| modules.contains(*name) && **name != from);
        imports.entry(from.clone()).or_default().extend(names.map(str::to_owned));
    }
    for at_the_root in ["lib", "main"] {
        imports.remove(at_the_root);
    }
    imports
}

/// The modules that remain after repeatedly removing modules without imports: the cycles and their importers.
fn cycles(mut imports: Imports) -> BTreeSet<String> {
    loop {
        let free: Vec<String> =
            imports.iter().filter(|(_, to)| to.is_empty()).map(|(name, _)| name.clone()).collect();
        if free.is_empty() {
            return imports.into_keys().collect();
        }
        imports.retain(|name, _| !free.contains(name));
        let left: BTreeSet<String> = imports.keys().cloned().collect();
        imports.values_mut().for_each(|to| to.retain(|name| left.contains(name)));
    }
}

#[test]
fn imports_between_the_top_modules_of_a_crate_run_one_way() {
    let crates = crates();
    assert!(crates.len() > 15, "{crates:?}");
    for folder in crates {
        let name = folder.file_name().unwrap().to_string_lossy().into_owned();
        assert_eq!(cycles(imports(&folder)), BTreeSet::new(), "cycles in {name}");
    }
}

#[test]
fn a_circle_is_found_and_lists_in_braces_are_read() {
    assert_eq!(imported("use crate::{a::{B, c}, d};\nfn f() { crate::e::g() }"), ["a", "d", "e"]);
    assert_eq!(
        re_exports("pub use a::{B, c::D as E};\npub use f::G;").into_iter().collect::<Vec<_>>(),
        [("B", "a"), ("D", "a"), ("E", "a"), ("G", "f")]
    );
    let text = "#[cfg(test)]\nmod tests;\nuse crate::a::B;\n#[cfg(test)]\nmod others {\n fn f() { crate::c::g() }\n}\nuse crate::d::E;";
    assert_eq!(imported(&without_tests(text)), ["a", "d"]);
    let arrows = |list: &[(&str, &[&str])]| -> Imports {
        let to = |to: &[&str]| to.iter().map(|name| (*name).to_owned()).collect();
        list.iter().map(|(from, names)| ((*from).to_owned(), to(names))).collect()
    };
    assert!(cycles(arrows(&[("a", &["b"]), ("b", &["c"]), ("c", &[])])).is_empty());
    assert_eq!(cycles(arrows(&[("a", &["b"]), ("b", &["a"]), ("c", &[])])).len(), 2);
}
