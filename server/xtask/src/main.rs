//! Developer commands: `cargo xtask run` starts the product, `cargo xtask test` checks it.

mod checks;
mod command;
mod docker_check;
mod dockerfile;
mod linted;
mod neon;
mod page;
mod session_weight;
mod steps;
mod tools;
mod unchanged;

use std::path::Path;
use std::process::ExitCode;

const HELP: &str = "\
Developer commands:
  cargo xtask run [ARGS…]    build and run `sheaf serve ARGS…`: a simulated station by default
  cargo xtask demo [ARGS…]   the same with `sheaf demo ARGS…`: the whole chain on rendered images, with a report
  cargo xtask page           build the page into web/dist, from which it is embedded in the program
  cargo xtask browser        test the page in Chromium with the debug program
  cargo xtask test           all checks: format, lints, tests, documentation, the page in a browser, the container image;
                             test executables and checks of the page that passed are skipped until something they read
                             changes
  cargo xtask ci             the same as test
  cargo xtask campaign       long tests: labelling on random scenes against stated error rates, a thousand serial faults per
                             controller, 500 camera faults, stations of all sizes, all tools on rendered parts, flipped bits,
                             kills of the server and of recordings, fifty parts at all doors
  cargo xtask openapi        write openapi/openapi.json from the code, and the page's types from it
  cargo xtask docker-check [--binary FILE]
                             replay docker/Dockerfile in Debian 12 folders and start the result;
                             with FILE the build stage is skipped
  cargo xtask neon           run the tests of instruction sets on emulated aarch64; installs an emulator, a linker and a
                             Rust target if missing, and is therefore not part of test";

fn main() -> ExitCode {
    if let Some(exit) = linted::as_rustdoc() {
        return exit;
    }
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (command, rest) = arguments.split_first().map_or(("", &[][..]), |(first, rest)| (first.as_str(), rest));
    let outcome = match command {
        "run" => steps::run_sheaf("serve", rest),
        "demo" => steps::run_sheaf("demo", rest),
        "test" | "ci" => checks::test(),
        "campaign" => steps::campaign(),
        "page" => page::ensure_page(),
        "browser" => steps::test_in_browser(),
        "openapi" => steps::write_openapi(),
        "docker-check" => docker(rest),
        "neon" => neon::neon(),
        "help" | "--help" | "-h" => {
            println!("{HELP}");
            Ok(())
        }
        _ => {
            eprintln!("{HELP}");
            return ExitCode::from(2);
        }
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("xtask: {error}");
            ExitCode::FAILURE
        }
    }
}

fn docker(arguments: &[String]) -> command::Outcome {
    match arguments {
        [] => docker_check::docker_check(None),
        [flag, file] if flag == "--binary" => docker_check::docker_check(Some(Path::new(file))),
        _ => Err("docker-check takes only the argument --binary FILE".into()),
    }
}
