use proptest::prelude::*;

use super::*;
use crate::explore::STORE_FILE;

proptest! {
    #[test]
    fn parts_of_all_shards_are_the_plan_each_point_once(n in 1_u32..20, len in 0_u64..200) {
        let plan: Vec<u64> = (0..len).map(|i| i * 3).collect();
        let mut parts: Vec<u64> = (1..=n).flat_map(|index| Shard { index, n }.part(&plan)).collect();
        parts.sort_unstable();
        prop_assert_eq!(parts, plan);
    }
}

#[test]
fn shard_text_outside_its_form_is_refused_with_the_form() {
    assert_eq!("3/8".parse(), Ok(Shard { index: 3, n: 8 }));
    for text in ["0/8", "9/8", "3", "a/8", "3/", "-1/8", "1/100001"] {
        let error = text.parse::<Shard>().unwrap_err();
        assert!(error.contains(text) && error.contains("such as 3/8"), "{error}");
    }
}

/// A finished shard with the points that its plan gives it, and one evaluation.
fn shard(dir: &Path, name: &str, shard: &str, plan: &[u64]) -> PathBuf {
    let folder = dir.join(name);
    std::fs::create_dir(&folder).unwrap();
    let mut store = Store::open(&folder.join(STORE_FILE)).unwrap();
    for (key, value) in [
        (key::SPACE, "s"),
        (key::PLAN, "p"),
        (key::VERSION, &version()),
        (key::SHARD, shard),
        (key::COMPLETE, "yes"),
    ] {
        store.set_meta(key, value).unwrap();
    }
    let part = shard.parse::<Shard>().unwrap().part(plan);
    let point = |ordinal: &u64| {
        let point = StoredPoint { ordinal: *ordinal, status: "simulated".to_owned(), error: None };
        (point, String::new(), String::new())
    };
    store.put_points(&part.iter().map(point).collect::<Vec<_>>()).unwrap();
    store.put_evaluation(name, &Err(name.to_owned())).unwrap();
    folder
}

fn set(folder: &Path, key: &str, value: &str) {
    Store::open(&folder.join(STORE_FILE)).unwrap().set_meta(key, value).unwrap();
}

fn merged(dir: &Path, folders: &[PathBuf], plan: &[u64]) -> Result<Store, String> {
    let whole = Whole { space: "s", plan: "p", ordinals: plan };
    let parts = parts(folders, whole).map_err(|e| e.to_string())?;
    let store = Store::open(&dir.join("merged.sqlite")).unwrap();
    parts.iter().for_each(|part| store.take_evaluations(part).unwrap());
    Ok(store)
}

#[test]
fn merge_of_all_shards_has_all_evaluations() {
    let dir = tempfile::tempdir().unwrap();
    let plan: Vec<u64> = (0..7).collect();
    let folders: Vec<PathBuf> = ["2/3", "1/3", "3/3"]
        .iter()
        .enumerate()
        .map(|(i, s)| shard(dir.path(), &i.to_string(), s, &plan))
        .collect();
    let store = merged(dir.path(), &folders, &plan).unwrap();
    assert_eq!(store.n_evaluations().unwrap(), 3);
}

#[test]
fn merge_of_lost_repeated_unfinished_or_foreign_shards_is_refused_by_name() {
    let plan: Vec<u64> = (0..7).collect();
    let fault = |change: &dyn Fn(&Path, &mut Vec<PathBuf>)| {
        let dir = tempfile::tempdir().unwrap();
        let mut folders: Vec<PathBuf> = ["1/3", "2/3", "3/3"]
            .iter()
            .enumerate()
            .map(|(i, s)| shard(dir.path(), &format!("f{i}"), s, &plan))
            .collect();
        change(dir.path(), &mut folders);
        merged(dir.path(), &folders, &plan).unwrap_err()
    };
    let lost = fault(&|_, folders| drop(folders.remove(1)));
    assert_eq!(lost, "1 shard is missing: 2/3");
    let repeated = fault(&|dir, folders| folders.push(shard(dir, "again", "2/3", &plan)));
    assert!(repeated.contains("again: shard 2/3 is in") && repeated.contains("f1"), "{repeated}");
    let named_twice = fault(&|_, folders| folders.push(folders[0].clone()));
    assert!(
        named_twice.contains("another sweep is writing") || named_twice.contains("is in"),
        "{named_twice}"
    );
    let unfinished = fault(&|_, folders| {
        let connection = rusqlite::Connection::open(folders[2].join(STORE_FILE)).unwrap();
        connection
            .execute_batch("DELETE FROM meta WHERE key = 'complete'; DELETE FROM points WHERE ordinal = 5")
            .unwrap();
    });
    assert!(unfinished.contains("shard 3/3 is not finished: 1 of 2 points"), "{unfinished}");
    let fewer = fault(&|_, folders| {
        let connection = rusqlite::Connection::open(folders[2].join(STORE_FILE)).unwrap();
        connection.execute_batch("DELETE FROM points WHERE ordinal = 5").unwrap();
    });
    assert!(fewer.contains("shard 3/3 has other points than the plan gives it: 1, expected 2"), "{fewer}");
    let foreign = fault(&|_, folders| set(&folders[0], key::SPACE, "t"));
    assert!(foreign.contains("shard 1/3 is of another space, search or seed"), "{foreign}");
    let older = fault(&|_, folders| set(&folders[0], key::VERSION, "radeng 0.0.1"));
    assert!(older.contains("is of radeng 0.0.1, expected"), "{older}");
    let two_ways = fault(&|_, folders| set(&folders[1], key::SHARD, "2/4"));
    assert!(two_ways.contains("two ways to cut"), "{two_ways}");
    let nothing = fault(&|dir, folders| folders.push(dir.to_owned()));
    assert!(nothing.contains("no sweep.sqlite"), "{nothing}");
    let none = fault(&|_, folders| folders.clear());
    assert!(none.contains("at least one shard"), "{none}");
}
