//! Whatever is wrong with what a user brings, the command ends within seconds with exit code 2, or 3 for the device, one plain
//! line that names the file and the place, memory in proportion to the file, and nothing left behind. What each format
//! accepts, and the places inside it, are the subject of the tests of its reader.
#![cfg(all(feature = "offline", target_os = "linux"))]

mod damaged;
mod images;
mod machine;
mod materials;
mod meshes;
mod run;
mod scenes;
mod seeds;
mod textures;

#[path = "../support/damage.rs"]
mod damage;

use run::Row;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Runs all rows, two at a time; every row that fails is told.
fn check(test: &str, rows: &[Row]) -> Vec<i32> {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("unbreakable").join(test);
    let (next, outcomes) = (AtomicUsize::new(0), Mutex::new(vec![Ok(0); rows.len()]));
    std::thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(|| {
                while let Some((i, row)) = Some(next.fetch_add(1, Ordering::Relaxed)).and_then(|i| Some((i, rows.get(i)?))) {
                    let outcome = row.run(&folder.join(i.to_string()));
                    outcomes.lock().unwrap()[i] = outcome.map_err(|e| format!("{}: {e}", row.what));
                }
            });
        }
    });
    let outcomes = outcomes.into_inner().unwrap();
    let wrong: Vec<_> = outcomes.iter().filter_map(|outcome| outcome.as_ref().err()).cloned().collect();
    assert!(wrong.is_empty(), "{} of {} rows:\n{}", wrong.len(), rows.len(), wrong.join("\n"));
    println!("{test}: {} rows", rows.len());
    outcomes.into_iter().flatten().collect()
}

#[test]
fn every_row_ends_as_it_should() {
    let tables = [meshes::rows(), images::rows(), materials::rows(), textures::rows(), scenes::rows(), machine::rows()];
    check("table", &tables.into_iter().flatten().collect::<Vec<_>>());
}

#[test]
fn damaged_files_are_refused_or_still_good() {
    for (name, codes, rows) in damaged::tables() {
        let outcomes = check(&name.replace(['/', ' '], "-"), &rows);
        assert_eq!(outcomes[0], codes, "{name} as it is");
        let refused = outcomes.iter().filter(|code| **code == 2).count();
        println!("{name}: {refused} of {} damaged copies refused", rows.len() - 1);
        assert!(refused * 8 > rows.len(), "{name}: only {refused} of {} refused", rows.len());
    }
}
