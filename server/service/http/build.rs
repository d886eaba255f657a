//! The page is built before the program and embedded in it; a program built without it answers browsers with a problem.

use std::path::Path;

fn main() {
    let page = Path::new("../../../web/dist");
    println!("cargo:rerun-if-changed=../../../web/dist");
    // The embedding macro requires the folder to exist.
    if let Err(cause) = std::fs::create_dir_all(page) {
        println!("cargo:warning=web/dist cannot be created: {cause}");
    }
}
