//! A small simulated station with a store, and jobs run on the calling thread.

use parking_lot::Mutex;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use calibration::{CalibrationDocument, CalibrationText};
use live::LiveBus;
use nalgebra::DMatrix;
use optics::stage::AngleError;
use optics::{Calibration, DepthRangeMm, LightSurfaces, RotaryAxis, Stage};
use serde_json::json;
use station::cancel::CancelFlag;
use station::{StationDevices, StationHandle};
use store::{CalibrationRecord, Change, ScanRecord, Store};
use tempfile::TempDir;
use tokio::runtime::Runtime;
use twin::{StationModel, StationShape, TwinControl, TwinOptions, TwinStation};

use crate::access::lease::Authority;
use crate::config::AppConfig;
use crate::evented_catalogue::EventedCatalogue;
use crate::jobs::scan::clear_work;
use crate::jobs::tests::as_if_elsewhere;
use crate::jobs::{ComputeContext, Done, JobEnd, JobInput, ScanInput, ScanSource, StationContext, VerifyInput};
use crate::recordings::{RecordingParts, Recordings};
use crate::resources::captures::Captures;
use crate::resources::measurements::ScanPurpose;
use crate::resources::scan_run::ScanSettings;

/// The progress a job has reported so far.
pub type Kept<T> = Arc<Mutex<Vec<T>>>;

/// Everything a job works with. Dropping it shuts the station down.
pub struct Bench {
    pub catalogue: EventedCatalogue,
    pub store: Store,
    pub station: StationHandle,
    pub operator: TwinControl,
    pub live: LiveBus,
    pub recordings: Recordings,
    /// Simulated free disk space.
    pub free_bytes: Arc<AtomicU64>,
    pub captures: Captures,
    pub config: Arc<AppConfig>,
    pub document: CalibrationDocument,
    pub runtime: Runtime,
    pub folder: TempDir,
}

/// A job's context and its reports.
pub struct Job {
    pub ctx: StationContext,
    pub said: Arc<Mutex<Vec<String>>>,
}

/// The station of these tests: a quarter of the default one's pixels, so that a row takes a few milliseconds.
pub fn shape() -> StationShape {
    StationShape { width_px: 640, height_px: 512, ..StationShape::default() }
}

impl Bench {
    /// A station with a sphere on its stage; its true parameters are the active calibration.
    pub fn new() -> Self {
        Self::of(&shape())
    }

    /// The same with another station configuration.
    pub fn of(shape: &StationShape) -> Self {
        Self::with(shape, StationDevices::over)
    }

    /// The same with other devices around its simulated world.
    pub fn with(shape: &StationShape, devices: impl FnOnce(TwinStation) -> StationDevices) -> Self {
        let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(2).enable_all().build().unwrap();
        let folder = tempfile::tempdir().unwrap();
        let model = StationModel::seeded(7, shape).unwrap();
        let twin = TwinStation::new(model.clone(), TwinOptions::of(shape.stage));
        let operator = twin.control();
        let station = StationHandle::start(&devices(twin), false);
        let store = runtime.block_on(Store::open(&folder.path().join("data"))).unwrap();
        let catalogue = runtime.block_on(EventedCatalogue::open(store.catalogue.clone())).unwrap();
        let document = true_document(&model, "true0000");
        let captures = {
            let _inside = runtime.enter();
            Captures::new(catalogue.clone(), store.artifacts.clone(), &folder.path().join("cache")).unwrap()
        };
        let config = Arc::new(AppConfig::simulated(folder.path().join("data")));
        let live = LiveBus::default();
        let free_bytes = Arc::new(AtomicU64::new(u64::MAX));
        let free = free_bytes.clone();
        let recordings = Recordings::new(RecordingParts {
            config: config.clone(),
            catalogue: catalogue.clone(),
            artifacts: store.artifacts.clone(),
            station: station.clone(),
            live: live.clone(),
            free_bytes: Arc::new(move || free.load(Ordering::Relaxed)),
        });
        let bench = Self {
            catalogue,
            store,
            station,
            operator,
            live,
            recordings,
            free_bytes,
            captures,
            config,
            document,
            runtime,
            folder,
        };
        bench.add_calibration(&bench.document, true);
        bench
    }

    /// Stores a calibration.
    pub fn add_calibration(&self, document: &CalibrationDocument, active: bool) {
        let id = document.calibration.id.clone();
        let bytes = document.to_json();
        let put = self.runtime.block_on(self.store.artifacts.put(bytes.as_bytes())).unwrap();
        let record = CalibrationRecord {
            id: id.clone(),
            document: put,
            report: None,
            capture_id: None,
            job_id: None,
            summary: json!({}),
            created_at_ms: 0,
        };
        let mut changes = vec![Change::InsertCalibration(record)];
        if active {
            changes.push(Change::Activate {
                calibration_id: Some(id),
                expected_previous: store::ExpectedActive::Any,
                act: "activate".into(),
                actor: "test".into(),
                at_ms: 0,
            });
        }
        self.runtime.block_on(self.catalogue.commit(changes)).unwrap();
    }

    /// A job that is cancelled as soon as a report matches `cancel_at`.
    pub fn job_cancelled_at(&self, cancel_at: impl Fn(&str) -> bool + Send + Sync + 'static) -> Job {
        let cancel = CancelFlag::default();
        let said = Arc::new(Mutex::new(Vec::new()));
        let (steps, wish) = (said.clone(), cancel.clone());
        let compute = ComputeContext {
            id: crate::resources::stored_scan::new_id(),
            cancel,
            config: self.config.clone(),
            catalogue: self.catalogue.clone(),
            artifacts: self.store.artifacts.clone(),
            captures: self.captures.clone(),
            runtime: self.runtime.handle().clone(),
            progress: Arc::new(move |_, _, words| {
                steps.lock().push(words.to_owned());
                if cancel_at(words) {
                    wish.cancel();
                }
            }),
            warnings: crate::jobs::progress::Warnings::default(),
        };
        let ctx = StationContext {
            compute,
            station: self.station.clone(),
            authority: Authority { holder: None, epoch: self.station.stop_epoch() },
            live: self.live.clone(),
            recordings: self.recordings.clone(),
        };
        Job { ctx, said }
    }

    /// A job that runs to its end.
    pub fn job(&self) -> Job {
        self.job_cancelled_at(|_| false)
    }

    /// The further reports and fractions of a job. Evaluation threads report concurrently: a fraction may be slightly
    /// below the previous one; the job's progress keeps the largest.
    pub fn following(&self, job: &mut Job) -> (Kept<String>, Kept<f64>) {
        let (said, fractions) = (job.said.clone(), Arc::new(Mutex::new(Vec::new())));
        let (steps, seen) = (said.clone(), fractions.clone());
        job.ctx.compute.progress = Arc::new(move |fraction, _, words| {
            steps.lock().push(words.to_owned());
            seen.lock().push(fraction);
        });
        (said, fractions)
    }

    /// Runs a job and stores its result, as the runner does; returns the id of its result.
    pub fn finish(&self, end: Result<Done, JobEnd>) -> String {
        self.keep(end.unwrap_or_else(|end| panic!("{end:?}")))
    }

    /// Stores the result of a job that was cancelled afterwards; returns its id.
    pub fn cut_short(&self, end: Result<Done, JobEnd>) -> String {
        match end {
            Err(JobEnd::CancelledAfter(kept)) => self.keep(*kept),
            other => panic!("not cut short: {other:?}"),
        }
    }

    fn keep(&self, done: Done) -> String {
        self.runtime.block_on(self.catalogue.commit(done.changes)).unwrap();
        if let Some(scan_id) = &done.finished_work {
            clear_work(&*self.store.artifacts, scan_id);
        }
        done.result.id
    }

    /// Scans, and returns the record.
    pub fn scan(&self, input: ScanInput) -> ScanRecord {
        let id = self.finish(run(input, &self.job().ctx));
        self.record(&id)
    }

    pub fn record(&self, id: &str) -> ScanRecord {
        self.runtime.block_on(self.catalogue.read().scan(id)).unwrap()
    }

    pub fn scans(&self) -> Vec<ScanRecord> {
        let page = store::Page { before: None, limit: 100 };
        self.runtime.block_on(self.catalogue.read().scans(&store::ScanFilter::default(), &page)).unwrap().records
    }

    pub fn bytes(&self, id: &store::ArtifactId) -> Vec<u8> {
        self.runtime.block_on(self.store.artifacts.read(id)).unwrap()
    }

    /// The file of an artifact.
    pub fn file_of(&self, id: &store::ArtifactId) -> PathBuf {
        let id = id.as_str();
        self.folder.path().join("data/artifacts").join(&id[..2]).join(&id[2..4]).join(id)
    }

    pub fn cloud(&self, record: &ScanRecord) -> Vec<u8> {
        self.bytes(record.cloud.as_ref().expect("a cloud"))
    }
}

impl Drop for Bench {
    fn drop(&mut self) {
        self.station.shut_down();
    }
}

/// Scans as the queue does, with input and outcome passed through their serialised form.
pub fn run(input: ScanInput, ctx: &StationContext) -> Result<Done, JobEnd> {
    as_if_elsewhere(JobInput::Scan(input), ctx)
}

/// The same for a reference part.
pub fn verify(input: VerifyInput, ctx: &StationContext) -> Result<Done, JobEnd> {
    as_if_elsewhere(JobInput::Verification(input), ctx)
}

/// A scan from the station, stop-and-go.
pub fn from_station(from_mm: f64, to_mm: f64, step_mm: f64) -> ScanInput {
    ScanInput {
        source: ScanSource::Station,
        name: None,
        settings: ScanSettings {
            from_mm: Some(from_mm),
            to_mm: Some(to_mm),
            step_mm: Some(step_mm),
            ..ScanSettings::default()
        },
        calibration_id: None,
        resume_scan_id: None,
        measure: Vec::new(),
        purpose: ScanPurpose::Production,
    }
}

/// The rest of a stopped scan.
pub fn resumed(id: &str) -> ScanInput {
    ScanInput {
        settings: ScanSettings::default(),
        resume_scan_id: Some(id.to_owned()),
        ..from_station(0.0, 0.0, 1.0)
    }
}

/// A calibration document with the true parameters of the station.
pub fn true_document(model: &StationModel, id: &str) -> CalibrationDocument {
    let light = LightSurfaces::Grating(model.grating);
    // The angles of the table are exact to the last digit of its controller.
    let stage = match model.stage {
        Stage::Rotary(axis) => RotaryAxis { angle_error: AngleError::new(1e-6), ..axis }.into(),
        linear => linear,
    };
    let n = 9 + light.parameters() + stage.parameters();
    let standoff = model.shape.standoff_mm;
    let value = Calibration {
        id: id.into(),
        camera: model.camera,
        orders: model.orders.clone(),
        light,
        stage: Some(stage),
        depth_range_mm: DepthRangeMm { near_mm: 0.9 * standoff, far_mm: 1.06 * standoff },
        covariance: DMatrix::zeros(n, n),
    };
    let mut text = serde_json::to_value(CalibrationText::of(&value)).unwrap();
    text["software"] = json!({ "name": "sheaf", "version": "0" });
    text["inputs"] = json!([]);
    text["parameters"] = json!({});
    let camera = json!({ "rms_px": 0, "corner_sigma_px": 0, "k3": "off", "sigma": [0, 0, 0, 0, 0, 0, 0, 0, 0], "views": [] });
    text["report"] =
        json!({ "camera": camera, "light": null, "cross_validation": null, "stage": null, "warnings": [] });
    serde_json::from_value(text).unwrap()
}
