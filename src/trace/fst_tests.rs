//! Waveforms read back by another crate and compared with the events, signal by signal and cycle by cycle.

use super::super::tests::{seen, spec};
use super::*;
use rtl_model::spec::Partition;
use wellen::simple::{Waveform, read_from_reader};

/// A run's signals in each cycle, from the events alone.
struct Expected {
    causes: Vec<Cause>,
    occupancy: Vec<u32>,
    push: Vec<bool>,
    pop: Vec<bool>,
}

fn wave_of(places: &Places, seen: &[(Cycle, Seen)], window: Window, n_cycles: Cycle) -> Waveform {
    let out = std::io::Cursor::new(Vec::new());
    let mut wave = Wave::new(out, places, "test", 25.0, window, false).unwrap();
    seen.iter().for_each(|(now, seen)| wave.see(*now, seen).unwrap());
    let bytes = wave.finish(n_cycles).unwrap().into_inner();
    read_from_reader(std::io::Cursor::new(bytes)).unwrap()
}

/// Loads a signal and gives its value (as bits) in each of the cycles.
fn values(wave: &mut Waveform, scope: &str, name: &str, cycles: std::ops::Range<u64>) -> Vec<String> {
    let mut path = vec!["board"];
    path.extend(scope.split('.').filter(|part| !part.is_empty()));
    let var = wave.hierarchy().lookup_var(&path, name).unwrap_or_else(|| panic!("{scope} {name}"));
    let signal = wave.hierarchy()[var].signal_ref();
    wave.load_signals(&[signal]);
    let times = wave.time_table().to_vec();
    let signal = wave.get_signal(signal).unwrap();
    cycles
        .map(|cycle| {
            // 25 MHz: 40,000 ps a cycle.
            let at = times.partition_point(|time| *time <= cycle * 40_000) - 1;
            let offset = signal.get_offset(at as u32).unwrap();
            signal.get_value_at(&offset, offset.elements - 1).to_bit_string().unwrap()
        })
        .collect()
}

fn number(bits: &str) -> u64 {
    u64::from_str_radix(bits, 2).unwrap_or(u64::MAX)
}

fn expected(places: &Places, seen: &[(Cycle, Seen)], cycles: std::ops::Range<u64>) -> Vec<Expected> {
    let mut causes = vec![Cause::Idle; places.blocks.len()];
    let mut occupancy = vec![0_u32; places.links.len()];
    let mut seen = seen.iter().peekable();
    let mut all = Vec::new();
    for now in 0..cycles.end {
        let at_start = occupancy.clone();
        let (mut push, mut pop) = (vec![false; at_start.len()], vec![false; at_start.len()]);
        while let Some((_, seen)) = seen.next_if(|(at, _)| *at == now) {
            match *seen {
                Seen::Activity { block, cause } => causes[usize::from(block)] = cause,
                Seen::Push { link, .. } => {
                    push[usize::from(link)] = true;
                    occupancy[usize::from(link)] += 1;
                }
                Seen::Pop { link, .. } => {
                    pop[usize::from(link)] = true;
                    occupancy[usize::from(link)] -= 1;
                }
                _ => {}
            }
        }
        if cycles.contains(&now) {
            all.push(Expected { causes: causes.clone(), occupancy: at_start, push, pop });
        }
    }
    all
}

#[test]
fn wave_read_back_has_causes_occupancies_and_pulses_of_the_events_in_every_cycle() {
    for partition in [Partition::Grid, Partition::ShellsStatic] {
        let (places, seen, n_cycles) = seen(&spec(partition));
        let middle = n_cycles / 2;
        for (window, cycles) in [
            (Window::default(), 0..n_cycles),
            (Window { from: middle, to: Some(middle + 300) }, middle..middle + 300),
            // Wider than the run.
            (Window { from: n_cycles - 50, to: Some(n_cycles + 50) }, n_cycles - 50..n_cycles),
        ] {
            let mut wave = wave_of(&places, &seen, window, n_cycles);
            let expected = expected(&places, &seen, cycles.clone());
            let times = wave.time_table();
            assert!(times.contains(&(cycles.start * 40_000)));
            assert_eq!(times.last(), Some(&(cycles.end * 40_000)));
            if cycles.start > 0 {
                assert_eq!(values(&mut wave, "dram", "cause", 0..1), ["xxxx"]);
            }
            let mut n_changes = 0;
            for (number_of, block) in places.blocks.iter().enumerate() {
                let codes = values(&mut wave, &block.name, "cause", cycles.clone());
                let names = values(&mut wave, &block.name, "cause_name", cycles.clone());
                for ((code, name), now) in codes.iter().zip(&names).zip(&expected) {
                    let cause = now.causes[number_of];
                    assert_eq!(number(code), cause as u64, "{}", block.name);
                    let text: String =
                        (0..NAME_CHARS).map(|i| char::from(number(&name[8 * i..][..8]) as u8)).collect();
                    assert_eq!(text.trim_end(), cause.name(), "{}", block.name);
                }
                n_changes += codes.windows(2).filter(|pair| pair[0] != pair[1]).count();
            }
            assert!(n_changes > 2, "{n_changes} changes of causes");
            for (number_of, link) in places.links.iter().enumerate() {
                let of = |wave: &mut Waveform, name| values(wave, &link.name, name, cycles.clone());
                let [occupancy, push, pop, depth] =
                    ["occupancy", "push", "pop", "depth"].map(|name| of(&mut wave, name));
                for (i, now) in expected.iter().enumerate() {
                    let name = &link.name;
                    assert_eq!(number(&occupancy[i]), u64::from(now.occupancy[number_of]), "{name}");
                    assert_eq!(push[i] == "1", now.push[number_of], "{name}");
                    assert_eq!(pop[i] == "1", now.pop[number_of], "{name}");
                    assert_eq!(number(&depth[i]), u64::from(link.depth), "{name}");
                }
            }
            let commands = values(&mut wave, "", "command", cycles.clone());
            assert_eq!(commands.last().map(|bits| number(bits)), Some(2));
        }
    }
}

#[test]
fn wave_of_a_window_beyond_the_run_is_refused() {
    let (places, seen, n_cycles) = seen(&spec(Partition::Grid));
    let window = Window { from: n_cycles, to: None };
    let mut wave = Wave::new(std::io::Cursor::new(Vec::new()), &places, "test", 25.0, window, false).unwrap();
    seen.iter().for_each(|(now, seen)| wave.see(*now, seen).unwrap());
    let e = wave.finish(n_cycles).map(|_| ()).unwrap_err().to_string();
    assert!(e.contains("--window begins with cycle"), "{e}");
}
