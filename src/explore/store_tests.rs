use super::*;

fn counted(cycles: u64) -> Counted {
    let mut counted = Counted { statistics: Default::default(), half_width_cycles: Some(1.5) };
    counted.statistics.cycles = cycles;
    counted
}

fn open(dir: &tempfile::TempDir) -> Store {
    Store::open(&dir.path().join("s.sqlite")).unwrap()
}

#[test]
fn store_gives_back_what_was_put_after_it_is_opened_again() {
    let dir = tempfile::tempdir().unwrap();
    {
        let mut store = open(&dir);
        store.put_evaluation("a", &Ok(counted(7))).unwrap();
        store.put_evaluation("b", &Err("watchdog".to_owned())).unwrap();
        store.put_accuracy("a", &Ok(Accuracy { misclassified: 0.25, image_rmse: None })).unwrap();
        store.set_meta("space", "x").unwrap();
        let point = StoredPoint { ordinal: 3, status: "failed".to_owned(), error: Some("e".to_owned()) };
        store.put_points(&[(point, "{}".to_owned(), "{}".to_owned())]).unwrap();
    }
    let store = open(&dir);
    assert_eq!(store.evaluation("a").unwrap(), Some(Ok(counted(7))));
    assert_eq!(store.evaluation("b").unwrap(), Some(Err("watchdog".to_owned())));
    assert_eq!(store.evaluation("c").unwrap(), None);
    let accuracy = store.accuracy("a").unwrap().unwrap().unwrap();
    assert_eq!(accuracy, Accuracy { misclassified: 0.25, image_rmse: None });
    assert_eq!(store.meta("space").unwrap().as_deref(), Some("x"));
    assert_eq!(store.n_evaluations().unwrap(), 2);
    assert_eq!(store.points().unwrap()[0].ordinal, 3);
    store.forget_points().unwrap();
    assert!(store.points().unwrap().is_empty());
    assert_eq!(store.n_evaluations().unwrap(), 2);
}

#[test]
fn store_that_another_has_open_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let _first = open(&dir);
    let error = Store::open(&dir.path().join("s.sqlite")).unwrap_err().to_string();
    assert!(error.contains("another sweep is writing"), "{error}");
}

#[test]
fn store_can_be_read_while_it_is_written() {
    let dir = tempfile::tempdir().unwrap();
    let writer = open(&dir);
    writer.put_evaluation("a", &Ok(counted(1))).unwrap();
    let reader = Store::read(&dir.path().join("s.sqlite")).unwrap();
    assert_eq!(reader.n_evaluations().unwrap(), 1);
    writer.put_evaluation("b", &Ok(counted(2))).unwrap();
    assert_eq!(reader.n_evaluations().unwrap(), 2);
}

#[test]
fn store_of_another_kind_is_refused_by_name() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("s.sqlite");
    std::fs::write(&file, vec![b'x'; 4096]).unwrap();
    let error = Store::open(&file).unwrap_err().to_string();
    assert!(error.contains("s.sqlite") && error.contains("no SQLite file"), "{error}");
    std::fs::remove_file(&file).unwrap();
    Store::open(&file).unwrap().set_meta("layout", "99").unwrap();
    let error = Store::open(&file).unwrap_err().to_string();
    assert!(error.contains("layout 99, expected 1"), "{error}");
    assert!(Store::read(&dir.path().join("none.sqlite")).is_err());
}

#[test]
fn take_evaluations_keeps_what_is_there_and_adds_the_rest() {
    let (here, there) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let (store, other) = (open(&here), open(&there));
    store.put_evaluation("a", &Ok(counted(1))).unwrap();
    other.put_evaluation("a", &Ok(counted(2))).unwrap();
    other.put_evaluation("b", &Err("no".to_owned())).unwrap();
    store.take_evaluations(&other).unwrap();
    assert_eq!(store.evaluation("a").unwrap(), Some(Ok(counted(1))));
    assert_eq!(store.evaluation("b").unwrap(), Some(Err("no".to_owned())));
}

#[test]
fn evaluation_hash_depends_on_all_but_the_name() {
    let setting = |value: &str| vec![Setting { name: "workload".to_owned(), value: value.to_owned() }];
    let spec = BoardSpec::default();
    let hash = |spec: &BoardSpec, settings: &[Setting], extent| evaluation_hash(spec, settings, extent);
    let base = hash(&spec, &setting("primary"), Extent::Whole);
    let named = BoardSpec { name: "other".to_owned(), ..spec.clone() };
    assert_eq!(hash(&named, &setting("primary"), Extent::Whole), base);
    let mut deeper = spec.clone();
    deeper.icu.depth += 1;
    let mut faster = spec.clone();
    faster.clock_mhz = f64::from_bits(faster.clock_mhz.to_bits() + 1);
    let others = [
        hash(&deeper, &setting("primary"), Extent::Whole),
        hash(&faster, &setting("primary"), Extent::Whole),
        hash(&spec, &setting("all"), Extent::Whole),
        hash(&spec, &setting("primary"), Extent::Rung(1)),
        hash(&spec, &setting("primary"), Extent::Sample { share: 0.1, seed: 1 }),
        hash(&spec, &setting("primary"), Extent::Sample { share: 0.1, seed: 2 }),
        accuracy_hash(&spec, &setting("primary"), false),
    ];
    for (i, other) in others.iter().enumerate() {
        assert_ne!(*other, base);
        assert!(!others[..i].contains(other));
    }
}
