//! Parser of the Dockerfile instructions used by our image; anything else is an error, so that the check never passes
//! by overlooking a line.

/// One instruction.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Instruction {
    /// A build command, run by `/bin/sh -c`.
    Run(String),
    /// Working directory of the following instructions.
    Workdir(String),
    /// Files from the build context or, with `from`, from another stage.
    Copy {
        /// The stage.
        from: Option<String>,
        /// Source path.
        source: String,
        /// Target path.
        target: String,
    },
    /// User of the following instructions.
    User(String),
    /// The program.
    Entrypoint(Vec<String>),
    /// Its arguments.
    Cmd(Vec<String>),
    /// The command that checks the container's health.
    HealthCheck(String),
    /// An instruction without effect on the files: `VOLUME`, `EXPOSE`, `STOPSIGNAL`.
    Note,
}

/// A stage of the build.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Stage {
    /// Base image.
    pub base: String,
    /// Name.
    pub name: String,
    /// Instructions, in order.
    pub instructions: Vec<Instruction>,
}

/// Parses the stages of a Dockerfile.
pub fn parse(text: &str) -> Result<Vec<Stage>, String> {
    let mut stages: Vec<Stage> = Vec::new();
    for line in joined_lines(text) {
        let (word, rest) =
            line.split_once(char::is_whitespace).ok_or_else(|| format!("`{line}` has no arguments"))?;
        let rest = rest.trim();
        if word == "FROM" {
            let (base, name) =
                rest.split_once(" AS ").ok_or_else(|| format!("`{line}` does not name the stage"))?;
            stages.push(Stage { base: base.to_owned(), name: name.to_owned(), instructions: Vec::new() });
            continue;
        }
        let stage = stages.last_mut().ok_or_else(|| format!("`{line}` is before the first FROM"))?;
        stage.instructions.push(instruction(word, rest)?);
    }
    Ok(stages)
}

/// Lines without comments, continuations joined.
fn joined_lines(text: &str) -> Vec<String> {
    let kept = text.lines().filter(|line| !line.trim_start().starts_with('#')).collect::<Vec<_>>().join("\n");
    kept.replace("\\\n", " ").lines().map(str::trim).filter(|line| !line.is_empty()).map(String::from).collect()
}

fn instruction(word: &str, rest: &str) -> Result<Instruction, String> {
    Ok(match word {
        "RUN" => Instruction::Run(rest.to_owned()),
        "WORKDIR" => Instruction::Workdir(rest.to_owned()),
        "USER" => Instruction::User(rest.to_owned()),
        "COPY" => copy(rest)?,
        "ENTRYPOINT" => Instruction::Entrypoint(words(rest)?),
        "CMD" => Instruction::Cmd(words(rest)?),
        "HEALTHCHECK" => match rest.split_once("CMD ") {
            Some((_, command)) => Instruction::HealthCheck(command.to_owned()),
            None => return Err(format!("HEALTHCHECK {rest} has no CMD")),
        },
        "VOLUME" | "EXPOSE" | "STOPSIGNAL" => Instruction::Note,
        _ => {
            return Err(format!(
                "the check does not support the instruction {word}; add it in xtask/src/dockerfile.rs"
            ));
        }
    })
}

fn copy(rest: &str) -> Result<Instruction, String> {
    let mut words: Vec<&str> = rest.split_whitespace().collect();
    let from = words.first().and_then(|word| word.strip_prefix("--from=")).map(String::from);
    if from.is_some() {
        words.remove(0);
    }
    match words[..] {
        [source, target] => Ok(Instruction::Copy { from, source: source.to_owned(), target: target.to_owned() }),
        _ => Err(format!("COPY {rest} must name one source and one target")),
    }
}

/// The exec form: `["a", "b"]`, without escapes.
fn words(list: &str) -> Result<Vec<String>, String> {
    let inner = list.strip_prefix('[').and_then(|list| list.strip_suffix(']'));
    let inner = inner.ok_or_else(|| format!("`{list}` is not in the exec form [\"…\"]"))?;
    // Only commas outside of the quotes, anything but quotes inside.
    let parts: Vec<&str> = inner.split('"').collect();
    let between = parts.iter().step_by(2).all(|part| matches!(part.trim(), "" | ","));
    if parts.len().is_multiple_of(2) || !between {
        return Err(format!("`{list}` is not in the exec form [\"…\"]"));
    }
    Ok(parts.into_iter().skip(1).step_by(2).map(String::from).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stages_and_instructions_are_read_in_order() {
        let text = "# c\nFROM a:1 AS build\nRUN one \\\n    two\nFROM b AS station\n\
                    COPY --from=build /x /y\nHEALTHCHECK --interval=1s CMD test x\nCMD [\"serve\", \"a=b,c\"]\n";
        let stages = parse(text).unwrap();
        assert_eq!(stages[0].instructions, [Instruction::Run("one      two".into())]);
        assert_eq!((stages[1].base.as_str(), stages[1].name.as_str()), ("b", "station"));
        assert_eq!(
            stages[1].instructions,
            [
                Instruction::Copy { from: Some("build".into()), source: "/x".into(), target: "/y".into() },
                Instruction::HealthCheck("test x".into()),
                Instruction::Cmd(vec!["serve".into(), "a=b,c".into()]),
            ]
        );
    }

    #[test]
    fn an_unsupported_instruction_is_an_error() {
        assert!(parse("FROM a AS b\nADD x y").unwrap_err().contains("ADD"));
        assert!(parse("RUN x").unwrap_err().contains("before the first FROM"));
        assert!(parse("FROM a AS b\nCMD serve").unwrap_err().contains("exec form"));
    }
}
