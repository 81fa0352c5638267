use super::*;

#[test]
fn t_95_of_whole_degrees_is_that_of_the_tables() {
    let table = [(1.0, 12.706), (4.0, 2.776), (10.9, 2.228), (11.0, 2.201), (20.0, 2.086), (60.0, 2.0003)];
    for (freedom, expected) in table {
        assert!((t_95(freedom) - expected).abs() < 1.5e-3, "{freedom}: {}", t_95(freedom));
    }
    assert!((t_95(1e9) - 1.959_964).abs() < 1e-6);
}

fn measured(rays: f64, work: f64, cycles: f64) -> Measured {
    Measured { size: Size { rays, work }, cycles }
}

#[test]
fn regression_estimate_by_hand_is_that_of_a_line_with_hc3_errors() {
    // Of equal rays it is a straight line: mean work 2, mean cycles 20, slope (10 + 0 + 10) / 2 = 10, residuals 0 but
    // for the pair in the middle.
    let sample = [
        measured(1.0, 1.0, 10.0),
        measured(1.0, 2.0, 17.0),
        measured(1.0, 2.0, 23.0),
        measured(1.0, 3.0, 30.0),
    ];
    let (sum, error) = regression_estimate(&sample, Size { rays: 8.0, work: 16.0 }, 8);
    assert!((sum - 160.0).abs() < 1e-9, "{sum}");
    // Weight 8 / 4 each, leverage 1 / 4 in the middle, residuals 3: 1/2 * 2 * (2 * 3 * 4 / 3)^2.
    assert!((error - 64.0_f64.sqrt()).abs() < 1e-9, "{error}");
    let (sum, error) = regression_estimate(&sample, Size::default(), 4);
    assert_eq!((sum, error), (80.0, 0.0), "all were run");
}

#[test]
fn regression_estimate_of_commands_without_a_line_goes_by_their_rays() {
    let sample = [measured(2.0, 4.0, 10.0), measured(4.0, 8.0, 30.0), measured(4.0, 8.0, 20.0)];
    let (sum, error) = regression_estimate(&sample, Size { rays: 100.0, work: 200.0 }, 30);
    assert!((sum - 600.0).abs() < 1e-9 && error > 0.0, "{sum} +- {error}");
}

/// Commands of known work and noise: estimates are right on average and 95 of 100 intervals hold the truth.
#[test]
fn regression_estimate_of_a_made_population_covers_it_in_95_of_100_samples() {
    let population: Vec<Measured> = (0..60)
        .map(|i| {
            let work = 100.0 + (mix(i) % 100) as f64;
            let noise = (mix(i + 1000) % 2001) as f64 / 1000.0 - 1.0;
            measured(64.0, work, 500.0 + 20.0 * work * (1.0 + 0.1 * noise))
        })
        .collect();
    let truth: f64 = population.iter().map(|m| m.cycles).sum();
    let total = population.iter().map(|m| m.size).fold(Size::default(), Size::plus);
    let members: Vec<usize> = (0..60).collect();
    let (mut covered, mut mean) = (0, 0.0);
    for seed in 0..1000 {
        let chosen = choose(&members, 0.1, seed);
        assert_eq!(chosen.len(), 6);
        assert!(chosen.is_sorted());
        let sample: Vec<Measured> = chosen.iter().map(|i| population[*i]).collect();
        let (sum, error) = regression_estimate(&sample, total, 60);
        covered += u32::from((sum - truth).abs() <= half_width(&[error * error], &[4]));
        mean += sum / 1000.0;
    }
    assert!((930..=985).contains(&covered), "{covered} of 1000");
    assert!((mean / truth - 1.0).abs() < 0.004, "{mean} of {truth}");
}

#[test]
fn ends_of_parts_are_the_last_items_of_each_quarter() {
    let items: Vec<u32> = (0..40).collect();
    assert_eq!(ends_of_parts(&items, 4, 2), [8, 9, 18, 19, 28, 29, 38, 39]);
    assert_eq!(ends_of_parts(&items[..3], 4, 2), [0, 1, 2]);
}
