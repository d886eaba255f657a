//! Developer commands: `cargo xtask run` starts the product, `cargo xtask test` checks it.

mod checks;
mod command;
mod docker_check;
mod dockerfile;
mod linted;
mod neon;
mod page;
mod steps;
mod tools;
mod unchanged;

use std::path::Path;
use std::process::ExitCode;

const HELP: &str = "\
Developer commands:
  cargo xtask run [ARGS…]    build with optimisation and run `sheaf serve ARGS…`: a simulated station by default
  cargo xtask demo [ARGS…]   the same with `sheaf demo ARGS…`: the whole chain on rendered pictures, with a report
  cargo xtask page           build the browser station into web/dist, from where the program embeds it
  cargo xtask browser        the page in Chromium against the debug program
  cargo xtask test           every check: format, lint, tests, the page in a browser, documentation, the image's program;
                             tests that passed and read nothing that changed since are not run again
  cargo xtask ci             the same as test
  cargo xtask campaign       labelling on scores of random scenes, held to stated rates of wrong labels;
                             a thousand serial faults for each controller; 500 faults of cameras
  cargo xtask openapi        write openapi/openapi.json from the code, and the page's types from it
  cargo xtask docker-check [--binary FILE]
                             replay docker/Dockerfile in Debian 12 folders and start the result;
                             with FILE the build stage is left out
  cargo xtask neon           the tests of instruction sets on aarch64, emulated; installs an emulator, a linker and a
                             Rust target where they are missing, and is therefore no part of test";

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
        _ => Err("docker-check takes no argument but --binary FILE".into()),
    }
}
