//! `sheaf centrelines`: laser lines of images, one CSV each, and pictures of what was found.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use rayon::prelude::*;
use serde_json::{Value, json};
use vision::{CentrelineParams, Centrelines};

use crate::arguments::CentrelinesArgs;
use crate::commands::Answer;
use crate::commands::corners::first_of;
use crate::output::{create_folder, file_names_after, write_file};
use pipeline::Background;
use pipeline::Reporter;
use pipeline::{Failure, FoundLines, lines_of};
use report::picture::{encode_png, overlay_by_segment};

/// Finds the lines of every image. An image without light gives an empty table and a warning.
pub fn run(args: &CentrelinesArgs, reporter: &dyn Reporter) -> Result<Answer, Failure> {
    create_folder(&args.csv)?;
    if let Some(folder) = &args.picture {
        create_folder(folder)?;
    }
    let background = args.background.as_deref().map(Background::read).transpose()?;
    let params = CentrelineParams { method: args.method.into(), line_direction: args.line_direction.into() };
    let csv_paths = paths_in(&args.csv, &args.images, "csv");
    let picture_paths = args.picture.as_ref().map(|folder| paths_in(folder, &args.images, "png"));
    let task = reporter.count("finding laser lines", "images", args.images.len());
    let found: Vec<Result<Centrelines, Failure>> = (0..args.images.len())
        .into_par_iter()
        .map(|idx| {
            let picture = picture_paths.as_ref().map(|paths| paths[idx].as_path());
            let lines = lines_of(&args.images[idx], background.as_ref(), &params)
                .and_then(|found| write(&found, &csv_paths[idx], picture));
            task.step();
            lines
        })
        .collect();
    drop(task);
    let mut text = String::new();
    let mut images: Vec<Value> = Vec::new();
    let mut failures = Vec::new();
    for ((image, csv), lines) in args.images.iter().zip(&csv_paths).zip(found) {
        match lines {
            Ok(lines) => {
                let n_points: usize = lines.segments.iter().map(|segment| segment.points.len()).sum();
                let n_segments = lines.segments.len();
                if n_points == 0 {
                    reporter.warn(&format!("{} shows no laser line", image.display()));
                }
                let _ = writeln!(
                    text,
                    "{}: {n_points} points in {n_segments} segments → {}",
                    image.display(),
                    csv.display()
                );
                images.push(json!({ "image": image, "csv": csv, "n_points": n_points, "n_segments": n_segments }));
            }
            Err(failure) => failures.push(failure),
        }
    }
    first_of(failures, args.images.len(), reporter)?;
    Ok(Answer::done(text, json!({ "images": images })))
}

fn paths_in(folder: &Path, images: &[PathBuf], extension: &str) -> Vec<PathBuf> {
    file_names_after(images, extension).into_iter().map(|name| folder.join(name)).collect()
}

fn write(found: &FoundLines, csv_path: &Path, picture_path: Option<&Path>) -> Result<Centrelines, Failure> {
    write_file(csv_path, csv(&found.lines).as_bytes())?;
    if let Some(picture_path) = picture_path {
        write_file(picture_path, &encode_png(&overlay_by_segment(&found.image, &found.lines))?)?;
    }
    Ok(found.lines.clone())
}

fn csv(lines: &Centrelines) -> String {
    let mut csv = "u_px,v_px,sigma_px,intensity,width_px\n".to_owned();
    for point in lines.segments.iter().flat_map(|segment| &segment.points) {
        let _ = writeln!(
            csv,
            "{:.5},{:.5},{:.5},{:.2},{:.3}",
            point.u_px, point.v_px, point.sigma_px, point.intensity, point.width_px
        );
    }
    csv
}
