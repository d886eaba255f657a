//! Scratch.
use calibration::*;
use rayon::prelude::*;
use std::path::Path;
fn main() {
    let folder = std::env::args().nth(1).unwrap();
    let model = std::env::args().nth(2);
    let cap = capture::Capture::open(Path::new(&folder)).unwrap();
    let m = &cap.manifest;
    let cp = vision::CornerParams { inner_columns: m.target.inner_columns, inner_rows: m.target.inner_rows };
    let t = std::time::Instant::now();
    let lp = vision::CentrelineParams { line_direction: m.line_direction(), ..Default::default() };
    let poses: Vec<_> = m
        .poses
        .par_iter()
        .map(|p| PoseInput {
            name: p.board.display().to_string(),
            corners: vision::find_corners(&cap.image("b", &p.board).unwrap(), &cp).unwrap(),
            centrelines: p.laser.as_ref().map(|l| vision::find_centrelines(&cap.image("l", l).unwrap(), &lp)),
        })
        .collect();
    let stage_views: Vec<_> = m
        .stage_views
        .par_iter()
        .map(|p| StageViewInput {
            name: p.board.display().to_string(),
            corners: vision::find_corners(&cap.image("b", &p.board).unwrap(), &cp).unwrap(),
            position_mm: p.position_mm,
        })
        .collect();
    eprintln!("features {:?}", t.elapsed());
    let input = CalibrationInput {
        width_px: m.camera.width_px,
        height_px: m.camera.height_px,
        board: BoardGeometry {
            inner_columns: m.target.inner_columns,
            inner_rows: m.target.inner_rows,
            square_mm: m.target.square_mm,
        },
        projector: ProjectorSheet {
            wavelength_nm: m.projector.wavelength_nm,
            grating_lines_per_mm: m.projector.grating_lines_per_mm,
            orders: m.projector.orders.clone(),
            line_direction: m.line_direction(),
        },
        poses,
        stage_views,
    };
    let k = match model.as_deref() {
        Some("planes") => LightModelChoice::Fixed(optics::LightModelKind::Planes),
        Some("pencil") => LightModelChoice::Fixed(optics::LightModelKind::Pencil),
        Some("grating") => LightModelChoice::Fixed(optics::LightModelKind::Grating),
        _ => LightModelChoice::Auto,
    };
    let t = std::time::Instant::now();
    let t2 = t;
    let r = calibrate(&input, &CalibrationOptions { light_model: k, ..Default::default() }, &mut |w, f| {
        eprintln!("{f} {w} {:?}", t2.elapsed());
        Stop::Continue
    })
    .unwrap();
    eprintln!("calibrate {:?}", t.elapsed());
    let doc = CalibrationDocument::new(&r, vec![], "0");
    std::fs::write("/tmp/cal.json", doc.to_json()).unwrap();
    let c = &r.calibration.camera;
    eprintln!("{:?}", c);
    eprintln!(
        "sigma {:?} rms {} {} {}",
        r.report.camera.sigma, r.report.camera.rms_px, r.report.camera.corner_sigma_px, r.report.camera.k3_reason
    );
    eprintln!("{:?}", r.calibration.light);
    if let Some(x) = &r.report.cross_validation {
        for s in &x.scores {
            eprintln!("{:?}", s);
        }
        eprintln!("{}", x.reason);
    }
    if let Some(l) = &r.report.light {
        eprintln!("{} {:?} {:?} syst {}", l.rms_px, l.rejections, l.wavelength_over_period, l.systematic_sigma_mm);
        for o in &l.residuals {
            eprintln!(
                "{} {:+} n {} mean {:+.4} rms {:.4} z {:.3} out {}",
                o.pose, o.order, o.n_points, o.mean_px, o.rms_px, o.normalised_rms, o.n_outliers
            );
        }
    }
    if let Some(s) = &r.report.stage {
        eprintln!("{:?}", s);
    }
    eprintln!("{:?} depth {:?}", r.report.warnings, r.calibration.depth_range_mm);
    for scan in ["gauge", "sphere"] {
        let Ok(text) = std::fs::read_to_string(format!("{folder}/truth-{scan}.csv")) else { continue };
        let (mut s, mut n, mut z) = (0.0, 0.0, 0.0);
        for line in text.lines().skip(1) {
            let v: Vec<f64> = line.split(',').map(|x| x.parse().unwrap()).collect();
            let px = nalgebra::Vector2::new(v[2], v[3]);
            if px.x < 0.0 || px.x > m.camera.width_px as f64 - 1.0 {
                continue;
            }
            let Some(p) = r.calibration.triangulate(v[1] as i8, &px, None) else {
                eprintln!("miss");
                continue;
            };
            let e = p.hit_in_camera.xyz.z - v[6];
            let sg = r.calibration.systematic_sigma_mm(v[1] as i8, &p).unwrap();
            s += e * e;
            n += 1.0;
            z += e * e / sg / sg;
        }
        eprintln!("{scan}: systematic rms {:.2} um, z {:.3} n {n}", 1e3 * (s / n as f64).sqrt(), (z / n).sqrt());
    }
}
