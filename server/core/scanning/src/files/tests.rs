//! Files are read back as written; wrong counts and damage are reported. Compatibility with other programs is
//! checked only for GLB (by the `gltf` crate); PLY is checked against a golden header.

use std::io::Cursor;

use super::*;

fn cloud() -> Cloud {
    let points = (0..50u32)
        .map(|idx| CloudPoint {
            x_mm: f64::from(idx) * 0.1 - 7.0 / 3.0,
            y_mm: -1.0 / 7.0,
            z_mm: 400.0 + f64::from(idx) * 1e-7,
            order: (idx % 9) as i8 - 4,
            frame: u32::MAX - idx,
            u_px: 0.1 + idx as f32,
            v_px: 1023.9,
            intensity: 180.5,
            sigma_mm: 0.031,
        })
        .collect();
    let calibration = format!("calibration {{\"numbers\": [{}0]}}", "1.25,".repeat(5000));
    Cloud { points, comments: vec!["units mm".into(), "calibration_id abc, def".into(), calibration] }
}

fn mesh() -> Mesh {
    Mesh {
        vertices_mm: vec![[0.0, 0.0, 400.0], [10.0, 0.0, 400.0], [0.0, 10.0, 401.0], [10.0, 10.0, 401.5]],
        triangles: vec![[0, 2, 1], [1, 2, 3]],
        comments: vec!["units mm".into()],
    }
}

fn bytes_of(format: CloudFormat, cloud: &Cloud) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    write_cloud_to(&mut bytes, format, cloud).unwrap();
    bytes.into_inner()
}

fn problem_of(format: CloudFormat, bytes: &[u8]) -> String {
    remedy::with_remedy(&read_cloud_from(&mut Cursor::new(bytes), format).unwrap_err())
}

#[test]
fn every_cloud_format_is_read_back_as_written() {
    let folder = tempfile::tempdir().unwrap();
    for format in CloudFormat::ALL {
        for cloud in [cloud(), Cloud::default()] {
            let path = folder.path().join(format!("cloud.{}", format.extension()));
            write_cloud(&path, format, &cloud).unwrap();
            let mut back = read_cloud(&path).unwrap();
            if format == CloudFormat::E57 {
                // The conversion to metres and back costs at most one unit in the last place of 400 mm.
                for (back, point) in back.points.iter_mut().zip(&cloud.points) {
                    assert!((back.z_mm - point.z_mm).abs() < 1.2e-13, "{format:?}");
                    assert!((back.x_mm - point.x_mm).abs() < 1.2e-13, "{format:?}");
                    (back.x_mm, back.y_mm, back.z_mm) = (point.x_mm, point.y_mm, point.z_mm);
                }
            }
            assert_eq!(back, cloud, "{format:?}");
        }
    }
    assert_eq!(
        std::fs::read_dir(folder.path()).unwrap().count(),
        CloudFormat::ALL.len(),
        "no partial file is left"
    );
}

#[test]
fn the_ply_header_matches_the_capture_format() {
    let mut cloud = cloud();
    cloud.comments.truncate(2);
    let bytes = bytes_of(CloudFormat::Ply, &cloud);
    let golden = "ply\nformat binary_little_endian 1.0\ncomment units mm\ncomment calibration_id abc, def\n\
        element vertex 50\nproperty double x\nproperty double y\nproperty double z\nproperty char order\n\
        property uint frame\nproperty float u\nproperty float v\nproperty float intensity\n\
        property float sigma_mm\nend_header\n";
    assert!(bytes.starts_with(golden.as_bytes()));
    assert_eq!(bytes.len(), golden.len() + 50 * 45);
    let first = &bytes[golden.len()..golden.len() + 8];
    assert_eq!(f64::from_le_bytes(first.try_into().unwrap()), cloud.points[0].x_mm);
    assert_eq!(bytes[golden.len() + 24] as i8, cloud.points[0].order);
}

#[test]
fn ply_files_of_other_programs_are_read() {
    let ascii = "ply\r\nformat ascii 1.0\r\ncomment made elsewhere\r\nobj_info x\r\nelement camera 1\r\nproperty \
        list uchar float view\r\nproperty float f\r\nelement vertex 2\r\nproperty float x\r\nproperty float y\r\n\
        property float z\r\nproperty uchar red\r\nproperty float scalar_intensity\r\nend_header\r\n\
        2 1.5 2.5 9\r\n1 2 3 255 7\r\n4 5 6 0 8.5\r\n";
    let read = read_cloud_from(&mut Cursor::new(ascii), CloudFormat::Ply).unwrap();
    assert_eq!(read.comments, ["made elsewhere"]);
    assert_eq!((read.points[1].x_mm, read.points[1].z_mm, read.points[1].intensity), (4.0, 6.0, 8.5));
    assert_eq!((read.points[1].order, read.points[1].sigma_mm), (0, 0.0));

    let mut big = b"ply\nformat binary_big_endian 1.0\nelement vertex 1\nproperty float x\nproperty float y\n\
        property double z\nend_header\n"
        .to_vec();
    big.extend(1.5f32.to_be_bytes());
    big.extend(2.5f32.to_be_bytes());
    big.extend(400.25f64.to_be_bytes());
    let read = read_cloud_from(&mut Cursor::new(big), CloudFormat::Ply).unwrap();
    assert_eq!((read.points[0].x_mm, read.points[0].y_mm, read.points[0].z_mm), (1.5, 2.5, 400.25));
}

#[test]
fn a_header_that_states_a_trillion_points_is_refused_at_the_first_missing_point() {
    let ply = String::from_utf8_lossy(&bytes_of(CloudFormat::Ply, &Cloud::default()))
        .replace("element vertex 0", "element vertex 1000000000000");
    let problem = problem_of(CloudFormat::Ply, ply.as_bytes());
    assert!(problem.starts_with("vertex 0 of 1000000000000: the file ends before"), "{problem}");
    let pcd = String::from_utf8_lossy(&bytes_of(CloudFormat::Pcd, &Cloud::default()))
        .replace("POINTS 0", "POINTS 99999999999");
    let problem = problem_of(CloudFormat::Pcd, pcd.as_bytes());
    assert!(problem.starts_with("point 0 of 99999999999: the file ends before"), "{problem}");
}

#[test]
fn a_truncated_file_is_an_error_and_not_a_shorter_cloud() {
    for format in [CloudFormat::Ply, CloudFormat::Pcd, CloudFormat::E57] {
        let bytes = bytes_of(format, &cloud());
        for keep in (0..bytes.len()).step_by(bytes.len() / 40) {
            assert!(
                read_cloud_from(&mut Cursor::new(&bytes[..keep]), format).is_err(),
                "{format:?} cut at {keep}"
            );
        }
    }
}

#[test]
fn damaged_e57_bytes_are_an_error_and_not_a_panic() {
    let bytes = bytes_of(CloudFormat::E57, &cloud());
    for at in (0..bytes.len()).step_by(bytes.len() / 60) {
        let mut damaged = bytes.clone();
        damaged[at] ^= 0x55;
        // The page checksum detects the flipped byte; only a byte outside every page could pass.
        if let Ok(read) = read_cloud_from(&mut Cursor::new(damaged), CloudFormat::E57) {
            assert_eq!(read.points.len(), 50);
        }
    }
}

#[test]
fn errors_in_the_content_state_their_place() {
    let cases: [(CloudFormat, &str, &str); 9] = [
        (CloudFormat::Ply, "plx\n", "line 1: the file does not begin with `ply`"),
        (CloudFormat::Ply, "ply\nformat ascii 1.0\nelement vertex x\n", "line 3: `x` is not a count"),
        (CloudFormat::Ply, "ply\nformat ascii 1.0\nproperty float x\n", "line 3: a property precedes"),
        (
            CloudFormat::Ply,
            "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nend_header\n1 2\n",
            "header: vertices have no property `z`",
        ),
        (
            CloudFormat::Ply,
            "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n\
             end_header\n1 2 nan\n",
            "vertex 0: a value is not a finite number",
        ),
        (CloudFormat::Csv, "# nothing\n", "line 2: the line of column names is missing"),
        (
            CloudFormat::Csv,
            "x_mm,y_mm,z_mm\n1,2,3\n1,2,three\n",
            "line 3: `three` in column `z_mm` is not a number",
        ),
        (CloudFormat::Csv, "x_mm,y_mm,z_mm,order\n1,2,3,1.5\n", "line 2: order 1.5 is not an integer"),
        (
            CloudFormat::Pcd,
            "VERSION 0.7\nFIELDS x y z\nSIZE 4 4\nTYPE F F F\nDATA ascii\n",
            "header: FIELDS, SIZE",
        ),
    ];
    for (format, text, expected) in cases {
        let problem = problem_of(format, text.as_bytes());
        assert!(problem.starts_with(expected), "{problem}");
        assert!(problem.contains("; "), "no remedy in: {problem}");
    }
}

#[test]
fn errors_of_files_name_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cut.ply");
    std::fs::write(&path, "ply\n").unwrap();
    assert!(read_cloud(&path).unwrap_err().to_string().contains("cut.ply: line 2: the header has no end"));
    assert!(matches!(read_cloud(&folder.path().join("none.ply")), Err(FileError::Read { .. })));
    let unknown = remedy::with_remedy(&CloudFormat::from_path(Path::new("part.xyz")).unwrap_err());
    assert_eq!(unknown, "part.xyz: unknown file extension; use one of .ply, .csv, .pcd, .e57");
    assert!(matches!(
        write_cloud(&folder.path().join("no/such/folder.ply"), CloudFormat::Ply, &cloud()),
        Err(FileError::Write { .. })
    ));
}

#[test]
fn every_mesh_format_is_read_back_as_written() {
    let folder = tempfile::tempdir().unwrap();
    // float32 at 400 mm: 3e-5 mm.
    const FLOAT32_MM: f64 = 4e-5;
    for format in MeshFormat::ALL {
        for mesh in [mesh(), Mesh::default()] {
            let path = folder.path().join(format!("part.{}", format.extension()));
            write_mesh(&path, format, &mesh).unwrap();
            let back = read_mesh(&path).unwrap();
            assert_eq!(back.triangles.len(), mesh.triangles.len(), "{format:?}");
            for (back_triangle, triangle) in back.triangles.iter().zip(&mesh.triangles) {
                for (a, b) in back_triangle.iter().zip(triangle) {
                    let (a, b) = (back.vertices_mm[*a as usize], mesh.vertices_mm[*b as usize]);
                    assert!((0..3).all(|axis| (a[axis] - b[axis]).abs() < FLOAT32_MM), "{format:?}");
                }
            }
            assert_eq!(back.vertices_mm.len(), mesh.vertices_mm.len(), "{format:?}");
            if format != MeshFormat::Stl {
                assert_eq!(back.comments, mesh.comments, "{format:?}");
            }
        }
    }
}

#[test]
fn ascii_stl_is_read_and_coincident_corners_are_merged() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("part.stl");
    let facet = |corners: [&str; 3]| {
        let vertices: String = corners.iter().map(|corner| format!("vertex {corner}\n")).collect();
        format!("facet normal 0 0 1\nouter loop\n{vertices}endloop\nendfacet\n")
    };
    let two = facet(["0 0 0", "1 0 0", "1 1 0"]) + &facet(["0 0 0", "1 1 0", "0 1 0"]);
    std::fs::write(&path, format!("solid square\n{two}endsolid\n")).unwrap();
    let mesh = read_mesh(&path).unwrap();
    assert_eq!((mesh.vertices_mm.len(), mesh.triangles), (4, vec![[0, 1, 2], [0, 2, 3]]));
    std::fs::write(&path, "solid square\nfacet\nvertex 0 0\n").unwrap();
    let error = read_mesh(&path).unwrap_err();
    assert!(error.to_string().contains("line 3: expected three numbers"), "{error}");
}

#[test]
fn another_reader_accepts_the_glb_and_reads_metres_with_y_up() {
    let mut bytes = Vec::new();
    write_mesh_to(&mut bytes, MeshFormat::Glb, &mesh()).unwrap();
    // `from_slice` runs the crate's full validation.
    let file = gltf::Gltf::from_slice(&bytes).unwrap();
    let blob = file.blob.clone().unwrap();
    let node = file.nodes().next().unwrap();
    let primitive = node.mesh().unwrap().primitives().next().unwrap();
    assert_eq!(primitive.bounding_box().max, [0.01, 0.01, 0.4015]);
    let normal = &primitive.get(&gltf::Semantic::Normals).unwrap();
    assert_eq!(normal.count(), 4);
    assert_eq!(primitive.indices().unwrap().count(), 6);
    assert_eq!(blob.len(), 4 * 12 * 2 + 6 * 4);
    // Half a turn about x: (x, y, z) → (x, −y, −z).
    let turn = node.transform().matrix();
    assert_eq!([turn[0][0], turn[1][1], turn[2][2]], [1.0, -1.0, -1.0]);
    let mut empty = Vec::new();
    write_mesh_to(&mut empty, MeshFormat::Glb, &Mesh::default()).unwrap();
    gltf::Gltf::from_slice(&empty).unwrap();
}

#[test]
fn truncated_and_inconsistent_meshes_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    for format in MeshFormat::ALL {
        let path = folder.path().join(format!("part.{}", format.extension()));
        write_mesh(&path, format, &mesh()).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        std::fs::write(&path, &bytes[..bytes.len() - 3]).unwrap();
        assert!(matches!(read_mesh(&path), Err(FileError::Malformed { .. })), "{format:?}");
    }
    let inconsistent = Mesh { triangles: vec![[0, 1, 9]], ..mesh() };
    let path = folder.path().join("inconsistent.ply");
    write_mesh(&path, MeshFormat::Ply, &inconsistent).unwrap();
    assert!(read_mesh(&path).unwrap_err().to_string().contains("triangle 0: it refers to a vertex beyond the 4"));
}
