use proptest::prelude::*;

use super::super::synthetic;
use super::*;
use crate::explore::value::Value;
use crate::sampling::{hash, unit_pair};

fn points(values: &[&[f64]]) -> Vec<Vec<f64>> {
    values.iter().map(|p| p.to_vec()).collect()
}

#[test]
fn front_in_two_objectives_by_hand() {
    let p = points(&[&[1.0, 5.0], &[2.0, 3.0], &[3.0, 4.0], &[4.0, 1.0], &[2.0, 3.0], &[f64::NAN, 0.0]]);
    // (3, 4) is worse than (2, 3); equal ones both stay; a NaN takes no part.
    assert_eq!(front(&p), [0, 1, 3, 4]);
    assert_eq!(ranks(&p), [Some(0), Some(0), Some(1), Some(0), Some(0), None]);
    assert_eq!(front(&[]), Vec::<usize>::new());
    assert_eq!(front(&points(&[&[2.0], &[1.0], &[1.0]])), [1, 2]);
}

#[test]
fn hypervolume_by_hand_in_one_two_and_three_objectives() {
    assert_eq!(hypervolume(&points(&[&[2.0], &[3.0]]), &[5.0]), 3.0);
    // Boxes 3 x 1, 2 x 2 and 1 x 3 that share corners: 1 + 2 + 3 = 6 unit squares; (4, 4) is no better than the reference.
    let stairs = points(&[&[1.0, 3.0], &[2.0, 2.0], &[3.0, 1.0], &[4.0, 4.0], &[2.0, 2.0]]);
    assert_eq!(hypervolume(&stairs, &[4.0, 4.0]), 6.0);
    // Three bars 1 x 1 x 2 within a cube of edge 2, which share the corner cube: 3 * 2 - 2.
    let bars = points(&[&[1.0, 1.0, 0.0], &[1.0, 0.0, 1.0], &[0.0, 1.0, 1.0]]);
    assert_eq!(hypervolume(&bars, &[2.0; 3]), 4.0);
    // A dominated point adds nothing; of four objectives a box is a product.
    let four = points(&[&[0.0, 1.0, 2.0, 3.0], &[1.0, 1.0, 2.0, 3.0]]);
    assert_eq!(hypervolume(&four, &[4.0; 4]), 4.0 * 3.0 * 2.0);
    assert_eq!(hypervolume(&[], &[1.0, 1.0]), 0.0);
}

#[test]
fn hypervolume_in_two_to_five_objectives_is_that_of_monte_carlo() {
    const N: u64 = 40_000;
    for dimensions in 2..=5_u64 {
        let coordinate = |stream, i: u64, k| unit_pair(hash(stream, i, k))[0];
        let p: Vec<Vec<f64>> =
            (0..12).map(|i| (0..dimensions).map(|k| coordinate(dimensions, i, k)).collect()).collect();
        let exact = hypervolume(&p, &vec![1.0; dimensions as usize]);
        let hits = (0..N).filter(|i| {
            let x: Vec<f64> = (0..dimensions).map(|k| coordinate(99, *i, k)).collect();
            p.iter().any(|p| p.iter().zip(&x).all(|(a, b)| a <= b))
        });
        let estimate = hits.count() as f64 / N as f64;
        // Four standard deviations.
        let error = 4.0 * (exact * (1.0 - exact) / N as f64).sqrt();
        assert!((exact - estimate).abs() < error, "{dimensions}: {exact} against {estimate} +- {error}");
    }
}

proptest! {
    #[test]
    fn ranks_are_those_of_peeling_front_by_front(values in prop::collection::vec((0..6_u8, 0..6_u8, 0..6_u8), 1..40)) {
        let p: Vec<Vec<f64>> = values.iter().map(|(a, b, c)| vec![f64::from(*a), f64::from(*b), f64::from(*c)]).collect();
        let mut expected = vec![None; p.len()];
        for rank in 0.. {
            let left: Vec<usize> = (0..p.len()).filter(|i| expected[*i].is_none()).collect();
            if left.is_empty() { break; }
            let best: Vec<usize> =
                left.iter().copied().filter(|i| !left.iter().any(|j| dominates(&p[*j], &p[*i]))).collect();
            best.into_iter().for_each(|i| expected[i] = Some(rank));
        }
        prop_assert_eq!(&ranks(&p), &expected);
        let zero: Vec<usize> = (0..p.len()).filter(|i| expected[*i] == Some(0)).collect();
        prop_assert_eq!(front(&p), zero);
    }

    #[test]
    fn hypervolume_grows_by_a_point_and_is_that_of_its_front(values in prop::collection::vec((0..9_u8, 0..9_u8, 0..9_u8), 1..16)) {
        let p: Vec<Vec<f64>> = values.iter().map(|(a, b, c)| vec![f64::from(*a), f64::from(*b), f64::from(*c)]).collect();
        // Counted, unit cube by unit cube.
        let cells = (0..9).flat_map(|a| (0..9).flat_map(move |b| (0..9).map(move |c| [a, b, c].map(f64::from))));
        let counted = cells.filter(|x| p.iter().any(|p| p.iter().zip(x).all(|(p, x)| p <= x))).count();
        prop_assert_eq!(hypervolume(&p, &[9.0; 3]), counted as f64);
        let members: Vec<Vec<f64>> = front(&p).into_iter().map(|i| p[i].clone()).collect();
        prop_assert_eq!(hypervolume(&members, &[9.0; 3]), counted as f64);
    }
}

#[test]
fn front_of_a_sweep_respects_goals_and_leaves_out_rows_that_are_not_measured_or_lack_an_objective() {
    let mut results = synthetic::bare(&[("a", 8)], &["seconds", "rays_per_second"]);
    let values =
        [(3.0, 1.0), (2.0, 5.0), (4.0, 9.0), (1.0, 0.5), (0.1, 99.0), (0.1, 99.0), (0.1, 99.0), (0.1, 99.0)];
    for (i, (s, r)) in values.into_iter().enumerate() {
        results.rows.push(synthetic::bare_row(i as u64, vec![Value::Integer(i as i64)], &[s, r]));
    }
    results.rows[4].status = Status::Pruned;
    results.rows[5].status = Status::Shortened;
    results.rows[6].status = Status::Failed("no".to_owned());
    results.rows[7].metrics[0] = None;
    results.metrics.iter_mut().for_each(|m| m.is_objective = true);
    let front = Front::of(&results);
    // Best first objective first; (3, 1) loses to (2, 5).
    assert_eq!(front.members, [3, 1, 2]);
    assert_eq!(front.rank, [Some(1), Some(0), Some(0), Some(0), None, None, None, None]);
    assert_eq!(front.n_compared, 4);
    assert!(front.contains(1) && !front.contains(0) && !front.contains(4));
    assert_eq!(front.best(&results, 1), Some((2, 9.0)));
    // In ranges: (0, 1), (1/3, 4/8.5), (1, 0) against 1.1.
    let y = 4.0 / 8.5;
    let by_hand = 1.1 * 0.1 + (1.1 - 1.0 / 3.0) * (1.0 - y) + 0.1 * y;
    assert!((front.hypervolume.unwrap() - by_hand / (1.1 * 1.1)).abs() < 1e-12);
}

#[test]
fn normalised_ranges_are_zero_to_one_and_a_constant_objective_is_zero() {
    let p = points(&[&[1.0, 7.0], &[3.0, 7.0], &[2.0, 7.0]]);
    assert_eq!(Ranges::of(&p).normalise(&p), points(&[&[0.0, 0.0], &[1.0, 0.0], &[0.5, 0.0]]));
    let all = Ranges::of(&p).hypervolume(&points(&[&[1.0, 7.0]]));
    assert!((all - 1.0).abs() < 1e-12, "the best point dominates the whole box: {all}");
}
