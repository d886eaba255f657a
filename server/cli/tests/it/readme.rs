//! Runs the blocks of the README that are marked as tested, unchanged, with the real program.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use crate::common::server::Server;

/// The comment above every tested block.
const MARK: &str = "<!-- tested:";

#[test]
fn the_commands_of_the_readme_work() {
    let blocks = tested_blocks(&std::fs::read_to_string(root().join("README.md")).unwrap());
    let languages: Vec<&str> = blocks.iter().map(|(language, _)| language.as_str()).collect();
    assert_eq!(languages, ["sh", "python"], "README.md must have these blocks under `{MARK}`");
    let folder = tempfile::tempdir().unwrap();
    let server = Server::start(&folder.path().join("data"), &[]);

    let shell =
        run(Command::new("bash").args(["-eu", "-o", "pipefail", "-c", &blocks[0].1]), &server, folder.path());
    let cloud = scanning::files::read_cloud(&folder.path().join("sphere.ply")).unwrap();
    assert!(cloud.points.len() > 100_000, "{} points", cloud.points.len());
    let printed: Vec<serde_json::Value> =
        serde_json::Deserializer::from_str(&shell).into_iter().collect::<Result<_, _>>().unwrap();
    let measured =
        printed.iter().find(|value| value["result"]["value"].is_number()).expect("a measurement is printed");
    let (radius_mm, expanded) = (&measured["result"]["value"], &measured["result"]["expanded_uncertainty"]);
    assert!((radius_mm.as_f64().unwrap() - 18.9).abs() < 0.1, "{measured}");
    assert!((1e-4..0.1).contains(&expanded.as_f64().unwrap()), "{measured}");

    if let Some(python) = reference::python() {
        let printed = run(Command::new(python).args(["-c", &blocks[1].1]), &server, folder.path());
        assert!(printed.lines().filter(|line| line.contains("points")).count() >= 3, "{printed}");
    }
}

#[track_caller]
fn run(command: &mut Command, server: &Server, folder: &Path) -> String {
    let Output { status, stdout, stderr } =
        command.current_dir(folder).env("SHEAF", &server.url).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    assert!(status.success(), "{}{}", text(&stdout), text(&stderr));
    text(&stdout)
}

/// Language and text of the fenced blocks that follow the mark.
pub fn tested_blocks(markdown: &str) -> Vec<(String, String)> {
    let mut lines = markdown.lines();
    let mut blocks = Vec::new();
    while let Some(line) = lines.next() {
        if line.starts_with(MARK) {
            let fence = lines.next().unwrap_or_default();
            let language = fence.strip_prefix("```").unwrap_or_else(|| panic!("no block after `{line}`"));
            let text: Vec<&str> = lines.by_ref().take_while(|line| *line != "```").collect();
            blocks.push((language.to_owned(), text.join("\n")));
        }
    }
    blocks
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}
