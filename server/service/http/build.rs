//! The page is built before the program and embedded in it; a program built without it says so to browsers.

use std::path::Path;

fn main() {
    let page = Path::new("../../../web/dist");
    println!("cargo:rerun-if-changed=../../../web/dist");
    // Embedding demands that the folder exists.
    if let Err(cause) = std::fs::create_dir_all(page) {
        println!("cargo:warning=web/dist cannot be made: {cause}");
    }
}
