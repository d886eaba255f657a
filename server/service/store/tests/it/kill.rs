//! `kill -9` at random moments: nothing that was acknowledged is lost, and no transaction is there by half.
//!
//! A child process writes and says so through a pipe after each success. It dies with its page cache intact, so this
//! shows nothing about power cuts: that a sync was asked for before the answer is the matter of `faults.rs`.

use std::collections::{HashMap, HashSet};
use std::io::{BufRead, BufReader, Write};
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use rand::{Rng, SeedableRng};
use store::{ArtifactId, Change, JobState, Store};

use crate::common::{capture, event, first, job};

const N_KILLS: usize = 30;
/// From before the database is open to some hundred commits later.
const LATEST_KILL_MS: u64 = 250;
const N_WRITERS: u64 = 3;
const FOLDER: &str = "SHEAF_STORE_KILL_FOLDER";
const MORE_RECORDS: u32 = 1_000_000;

#[tokio::test]
async fn nothing_acknowledged_is_lost_when_the_process_is_killed() {
    let folder = tempfile::tempdir().unwrap();
    let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(3);
    let mut acknowledged = Vec::new();
    for _ in 0..N_KILLS {
        let child = spawn_writer(folder.path());
        acknowledged.extend(kill_after(child, Duration::from_millis(rng.random_range(0..LATEST_KILL_MS))));
        let store = Store::open(folder.path()).await.unwrap();
        store.recover(1).await.unwrap();
        check_acknowledged(&store, &acknowledged).await;
        check_whole(&store).await;
        store.close().await;
    }
    assert!(acknowledged.len() > 10 * N_KILLS, "there was little to lose: {}", acknowledged.len());
    println!("{} acknowledgements, {N_KILLS} kills, none lost", acknowledged.len());
}

fn spawn_writer(folder: &Path) -> Child {
    Command::new(std::env::current_exe().unwrap())
        .args(["kill::write_until_killed", "--exact", "--ignored", "--nocapture"])
        .env(FOLDER, folder)
        .stdout(Stdio::piped())
        .spawn()
        .unwrap()
}

/// Returns the words of each acknowledgement that arrived in full.
fn kill_after(mut child: Child, delay: Duration) -> Vec<Vec<String>> {
    let pipe = BufReader::new(child.stdout.take().unwrap());
    let reader = std::thread::spawn(move || pipe.lines().map_while(Result::ok).collect::<Vec<_>>());
    std::thread::sleep(delay);
    child.kill().unwrap();
    assert_eq!(child.wait().unwrap().signal(), Some(9), "the child must not have exited on its own");
    let lines = reader.join().unwrap();
    let words = |line: &str| line.split_whitespace().map(str::to_owned).collect::<Vec<_>>();
    lines.iter().filter_map(|line| line.strip_prefix("ack ")?.strip_suffix(" .").map(words)).collect()
}

async fn check_acknowledged(store: &Store, acknowledged: &[Vec<String>]) {
    for words in acknowledged {
        let id = ArtifactId::parse(&words[1]).unwrap();
        store.artifacts.read(&id).await.unwrap();
        if words[0] == "commit" {
            assert_eq!(store.catalogue.capture(&words[2]).await.unwrap().archive, id);
        }
    }
}

/// Each commit made a capture, a job of the capture's name, and two events about it.
async fn check_whole(store: &Store) {
    let catalogue = &store.catalogue;
    let captures = catalogue.captures(&first(MORE_RECORDS)).await.unwrap().records;
    let jobs = catalogue.jobs(None, &first(MORE_RECORDS)).await.unwrap().records;
    let events = catalogue.events_after(0, MORE_RECORDS).await.unwrap().records;
    assert!(events.iter().map(|event| event.seq).eq(1..=events.len() as i64), "the sequence has gaps");
    let mut n_events: HashMap<&str, usize> = HashMap::new();
    for event in events.iter().filter(|event| event.kind == "job.queued") {
        *n_events.entry(&event.subject).or_default() += 1;
    }
    let of_captures: HashSet<_> = captures.iter().map(|capture| capture.name.as_str()).collect();
    let of_jobs: HashSet<_> = jobs.iter().map(|job| job.id.as_str()).collect();
    assert_eq!(of_captures, of_jobs);
    assert_eq!(of_jobs, n_events.keys().copied().collect());
    assert!(n_events.values().all(|&n| n == 2));
    assert!(jobs.iter().all(|job| job.state == JobState::Interrupted));
}

/// The child. Alone it does nothing.
#[test]
#[ignore = "run by nothing_acknowledged_is_lost_when_the_process_is_killed"]
fn write_until_killed() {
    let Some(folder) = std::env::var_os(FOLDER) else { return };
    let runtime = tokio::runtime::Runtime::new().unwrap();
    runtime.block_on(async {
        let store = std::sync::Arc::new(Store::open(Path::new(&folder)).await.unwrap());
        let writers: Vec<_> = (0..N_WRITERS).map(|seed| tokio::spawn(write_on(store.clone(), seed))).collect();
        for writer in writers {
            writer.await.unwrap();
        }
    });
}

async fn write_on(store: std::sync::Arc<Store>, seed: u64) {
    let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(seed + u64::from(std::process::id()) * N_WRITERS);
    loop {
        let mut bytes = vec![0; rng.random_range(1..200_000)];
        rng.fill(&mut bytes[..]);
        let archive = store.artifacts.put(&bytes).await.unwrap();
        acknowledge(&format!("artifact {}", archive.as_str()));
        let (job, mut capture) = (job(), capture());
        (capture.name, capture.archive) = (job.id.clone(), archive.clone());
        let entry = event(&job.id);
        let changes = vec![
            Change::AppendEvent(entry.clone()),
            Change::InsertJob(job.clone()),
            Change::StartJob { id: job.id.clone(), at_ms: 1 },
            Change::InsertCapture(capture.clone()),
            Change::AppendEvent(entry),
        ];
        store.catalogue.commit(changes).await.unwrap();
        acknowledge(&format!("commit {} {}", archive.as_str(), capture.id));
    }
}

/// One line in one write; a full stop shows that it is whole.
fn acknowledge(what: &str) {
    let mut out = std::io::stdout().lock();
    out.write_all(format!("\nack {what} .\n").as_bytes()).and_then(|()| out.flush()).unwrap();
}
