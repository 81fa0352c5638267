use super::*;

#[test]
fn t_95_of_whole_degrees_is_that_of_the_tables() {
    for (freedom, expected) in
        [(1.0, 12.706), (4.0, 2.776), (10.9, 2.228), (11.0, 2.201), (20.0, 2.086), (60.0, 2.0003)]
    {
        assert!((t_95(freedom) - expected).abs() < 1.5e-3, "{freedom}: {}", t_95(freedom));
    }
    assert!((t_95(1e9) - 1.959_964).abs() < 1e-6);
}

#[test]
fn ratio_estimate_by_hand_is_ratio_times_total_with_the_textbook_variance() {
    let measured = [(1.0, 10.0), (2.0, 26.0), (3.0, 24.0)].map(|(work, cycles)| Measured { work, cycles });
    // R = 60 / 6 = 10, residuals 0, 6, -6; N = 6, X = 15: lever 2.5 / 2.
    let (sum, error) = ratio_estimate(&measured, 15.0, 6);
    assert_eq!(sum, 150.0);
    let variance: f64 = 36.0 * 0.5 / 3.0 * 1.25 * 1.25 * 72.0 / 2.0;
    assert!((error - variance.sqrt()).abs() < 1e-9);
    let (sum, error) = ratio_estimate(&measured, 15.0, 3);
    assert_eq!((sum, error), (60.0, 0.0), "all were run");
}

/// Commands of known work and noise: estimates are right on average and 95 of 100 intervals hold the truth.
#[test]
fn ratio_estimate_of_a_made_population_covers_it_in_95_of_100_samples() {
    let population: Vec<Measured> = (0..60)
        .map(|i| {
            let work = 100.0 + (mix(i) % 100) as f64;
            let noise = (mix(i + 1000) % 2001) as f64 / 1000.0 - 1.0;
            Measured { work, cycles: 20.0 * work * (1.0 + 0.1 * noise) }
        })
        .collect();
    let truth: f64 = population.iter().map(|m| m.cycles).sum();
    let total: f64 = population.iter().map(|m| m.work).sum();
    let members: Vec<usize> = (0..60).collect();
    let (mut covered, mut mean) = (0, 0.0);
    for seed in 0..1000 {
        let chosen = choose(&members, 0.1, seed);
        assert_eq!(chosen.len(), 6);
        assert!(chosen.is_sorted());
        let measured: Vec<Measured> = chosen.iter().map(|i| population[*i]).collect();
        let (sum, error) = ratio_estimate(&measured, total, 60);
        covered += u32::from((sum - truth).abs() <= half_width(&[error * error], &[5]));
        mean += sum / 1000.0;
    }
    assert!((930..=975).contains(&covered), "{covered} of 1000");
    assert!((mean / truth - 1.0).abs() < 0.003, "{mean} of {truth}");
}
