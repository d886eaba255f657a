//! Records the standard capture of a seeded station: `record FOLDER [SEED]`.

use std::ops::ControlFlow;
use std::path::Path;

use twin::{CaptureRequest, StationModel, StationShape, capture_folder};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let folder = arguments.next().ok_or("give a new folder")?;
    let seed = arguments.next().map_or(Ok(7), |word| word.parse())?;
    let model = StationModel::seeded(seed, &StationShape::default())?;
    capture_folder(&model, &CaptureRequest::standard(&model), Path::new(&folder), &|progress| {
        eprint!("\r{} of {} images", progress.done, progress.total);
        ControlFlow::Continue(())
    })?;
    eprintln!();
    Ok(())
}
