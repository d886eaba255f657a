//! Serving of the page: complete, compressed, cacheable, without external resources.

use std::path::Path;

use super::fresh;
use crate::common::server::Server;

fn get(server: &Server, path: &str, headers: &[(&str, &str)]) -> crate::common::server::Answer {
    server.try_send("GET", path, headers, b"").unwrap()
}

/// Paths of the scripts and styles of the page.
fn assets(page: &str) -> Vec<String> {
    let named = page.split('"').filter(|part| part.contains("assets/"));
    named.map(|part| format!("/{}", part.trim_start_matches(['.', '/']))).collect()
}

#[test]
fn the_page_and_its_assets_are_served_without_external_resources() {
    let built = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../web/dist/index.html");
    assert!(built.is_file(), "the page is not built: run `cargo xtask page`");
    let (_folder, server) = fresh();
    let page = get(&server, "/", &[]);
    assert_eq!(page.status, 200);
    let policy = page.header("content-security-policy").unwrap();
    assert!(policy.starts_with("default-src 'none'; script-src 'self'; style-src 'self';"), "{policy}");
    assert!(!policy.contains("unsafe"), "{policy}");
    assert_eq!(page.header("cache-control"), Some("no-cache"));
    let text = String::from_utf8(page.body.clone()).unwrap();
    assert!(!text.contains("http://") && !text.contains("https://"), "a third-party origin: {text}");
    let assets = assets(&text);
    assert!(assets.len() >= 2, "{text}");
    for asset in assets {
        let plain = get(&server, &asset, &[]);
        assert_eq!((plain.status, plain.header("content-encoding")), (200, None), "{asset}");
        assert!(plain.header("cache-control").unwrap().contains("immutable"), "{asset}");
        for encoding in ["br", "gzip"] {
            let packed = get(&server, &asset, &[("accept-encoding", encoding)]);
            assert_eq!(packed.header("content-encoding"), Some(encoding), "{asset}");
            assert!(packed.body.len() < plain.body.len(), "{asset}");
        }
    }
}

#[test]
fn an_unchanged_page_is_not_sent_again() {
    let (_folder, server) = fresh();
    let page = get(&server, "/", &[]);
    let etag = page.header("etag").unwrap();
    let again = get(&server, "/", &[("if-none-match", etag)]);
    assert_eq!((again.status, again.body.len()), (304, 0));
}

#[test]
fn unknown_paths_of_the_page_are_problems() {
    let (_folder, server) = fresh();
    for path in ["/assets/none.js", "/assets/..%2f..%2fCargo.toml", "/live"] {
        let answer = get(&server, path, &[]);
        assert_eq!(answer.status, 404, "{path}");
        assert_eq!(answer.header("content-type"), Some("application/problem+json"), "{path}");
    }
}
