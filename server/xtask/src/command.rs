//! Child processes and their folders.

use std::cell::RefCell;
use std::io::{BufRead as _, BufReader, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Result of a step.
pub type Outcome<T = ()> = Result<T, Failure>;

/// Why a step failed; can be sent between threads.
pub type Failure = Box<dyn std::error::Error + Send + Sync>;

thread_local! {
    /// Captured output of this thread's steps while they run in parallel with others.
    static CAPTURED: RefCell<Option<Vec<u8>>> = const { RefCell::new(None) };
}

/// The root of the repository.
pub fn workspace() -> PathBuf {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    root.canonicalize().unwrap_or(root)
}

/// Cargo's target folder.
pub fn target_folder() -> PathBuf {
    std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| workspace().join("target"), PathBuf::from)
}

/// Cargo, in the repository's root.
pub fn cargo(arguments: &[&str]) -> Command {
    let mut command = Command::new("cargo");
    command.args(arguments).current_dir(workspace());
    without_own_package(&mut command);
    command
}

/// Removes the environment variables in which cargo describes xtask's own package. Build scripts that depend on them
/// (ring's) would otherwise run again whenever cargo is called directly, and everything that depends on ring would be
/// compiled again.
pub fn without_own_package(command: &mut Command) {
    let of_package = |name: &str| name.starts_with("CARGO_PKG_") || name.starts_with("CARGO_MANIFEST_");
    for (name, _) in std::env::vars_os().filter(|(name, _)| of_package(&name.to_string_lossy())) {
        command.env_remove(name);
    }
}

/// Runs a command with its output on this terminal; in parallel with others ([`side_by_side`]) the output is printed at
/// the end.
pub fn run(name: &str, command: &mut Command) -> Outcome {
    title(name, command);
    let status = if CAPTURED.with_borrow(Option::is_some) { printed(command, |_| {}) } else { command.status() };
    let status = status.map_err(|error| format!("{name} could not be started: {error}"))?;
    if status.success() { Ok(()) } else { Err(format!("{name} failed: {status}").into()) }
}

/// Runs a command, prints its lines and passes them to `each` (both streams, in order), until it and all processes that it
/// has started have closed them.
pub fn run_line_by_line(name: &str, mut command: Command, each: impl FnMut(&str)) -> Outcome {
    title(name, &command);
    let status = printed(&mut command, each)?;
    if status.success() { Ok(()) } else { Err(format!("{name} failed: {status}").into()) }
}

/// Prints what runs now.
pub fn title(name: &str, command: &Command) {
    let arguments: Vec<_> = command.get_args().map(|argument| argument.to_string_lossy()).collect();
    say(&format!("── {name}: {} {}", command.get_program().to_string_lossy(), arguments.join(" ")));
}

/// Prints a line to the output of this thread's steps.
pub fn say(line: &str) {
    CAPTURED.with_borrow_mut(|kept| match kept {
        Some(kept) => kept.extend_from_slice(format!("{line}\n").as_bytes()),
        None => println!("{line}"),
    });
}

/// Whether a command starts and succeeds; its output is discarded.
pub fn succeeds(command: &mut Command) -> bool {
    command.stdout(Stdio::null()).stderr(Stdio::null()).status().is_ok_and(|status| status.success())
}

/// Runs two sequences of steps in parallel if there are two processors, otherwise one after the other.
///
/// The first prints immediately, the second when both have ended, so that their lines do not mix. Both always run to
/// their end; the first failure is returned.
pub fn side_by_side(first: impl FnOnce() -> Outcome, second: impl FnOnce() -> Outcome + Send) -> Outcome {
    if std::thread::available_parallelism().map_or(1, usize::from) < 2 {
        return first().and_then(|()| second());
    }
    std::thread::scope(|scope| {
        let beside = scope.spawn(|| {
            CAPTURED.set(Some(Vec::new()));
            let outcome = second();
            (outcome, CAPTURED.take().unwrap_or_default())
        });
        let outcome = first();
        let (beside, output) = beside.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        std::io::stdout().write_all(&output)?;
        outcome.and(beside)
    })
}

/// Runs a command and passes each line, of both streams in order, to [`say`] and `each`.
fn printed(command: &mut Command, mut each: impl FnMut(&str)) -> std::io::Result<std::process::ExitStatus> {
    let (reader, writer) = std::io::pipe()?;
    let mut child = command.stdout(writer.try_clone()?).stderr(writer).spawn()?;
    // The command holds the other end of the pipe as well; otherwise reading would never end.
    command.stdout(Stdio::null()).stderr(Stdio::null());
    for line in BufReader::new(reader).split(b'\n') {
        let line = line?;
        let line = String::from_utf8_lossy(&line);
        say(&line);
        each(&line);
    }
    child.wait()
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicBool, Ordering};

    use super::*;

    #[test]
    fn both_sequences_are_finished_and_a_failure_of_either_is_returned() {
        for (first, second, expected) in
            [("false", "true", Some("first")), ("true", "false", Some("second")), ("true", "true", None)]
        {
            let finished = AtomicBool::new(false);
            let outcome = side_by_side(
                || run("first", &mut Command::new(first)),
                || {
                    let outcome = run("second", &mut Command::new(second));
                    finished.store(true, Ordering::SeqCst);
                    outcome
                },
            );
            let message = outcome.err().map(|error| error.to_string());
            assert_eq!(message.as_deref().and_then(|message| message.split(' ').next()), expected);
            assert!(
                finished.load(Ordering::SeqCst) || std::thread::available_parallelism().is_ok_and(|n| n.get() < 2)
            );
        }
    }

    #[test]
    fn output_of_parallel_steps_is_captured_with_both_streams_in_order() {
        CAPTURED.set(Some(Vec::new()));
        run("echo", Command::new("sh").args(["-c", "echo one; echo two >&2; echo three"])).unwrap();
        let kept = String::from_utf8(CAPTURED.take().unwrap()).unwrap();
        assert!(kept.starts_with("── echo: sh") && kept.ends_with("one\ntwo\nthree\n"), "{kept}");
    }
}
