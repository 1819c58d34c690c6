//! Stretches that are worth a diagnosis, against simulated loops whose stretches are known because they were made so.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use drift_fleet::stretches::{Finder, Kind, Stretch};
use drift_sim::control_loop::Loop;
use drift_sim::recording::{RowState, Sample};
use drift_sim::reference::Reference;
use drift_sim::simulate::Simulation;

const FLOW: &str = "[loop]\nsample_time_s = 1.0\n[controller]\nkind = \"pi\"\nkp = 0.6\nki = 0.06\nu_min = 0.0\nu_max = 100.0\n\
    [plant]\nkind = \"first-order\"\ngain = 1.1\ntime_constant_s = 12.0\ndelay_s = 2.0\n[sensor]\nnoise = 0.05\n";

fn simulated(physics: &str, seed: u64, r: impl Iterator<Item = f64>) -> Vec<Stretch> {
    let model = Loop::parse(&format!("{FLOW}{physics}"), "flow.toml").unwrap();
    let mut simulation = Simulation::new(&model, seed).unwrap();
    let mut finder = Finder::new();
    for (index, r) in r.enumerate() {
        let step = simulation.step(r, &[]);
        sample(&mut finder, index, [r, step.y, step.u], RowState::Valid);
    }
    finder.finish().0
}

fn sample(finder: &mut Finder, index: usize, [r, y, u]: [f64; 3], state: RowState) {
    finder.sample(&Sample { index: index as u64, t_s: index as f64, r, y, u, state, extra: &[] });
}

fn of(kind: Kind, found: &[Stretch]) -> Vec<Stretch> {
    found.iter().copied().filter(|stretch| stretch.kind == kind).collect()
}

#[test]
fn a_loop_at_rest_has_nothing_worth_a_diagnosis() {
    for seed in 0..20 {
        // Its start from zero is no rest.
        let found = simulated("", seed, std::iter::repeat_n(50.0, 20_000));
        let later: Vec<_> = found.into_iter().filter(|stretch| stretch.to_s > 3000.0).collect();
        assert!(later.is_empty(), "seed {seed}: {later:?}");
    }
}

#[test]
fn an_experiment_in_a_long_rest_is_found_and_nothing_else() {
    for seed in 0..20 {
        let mut levels = Reference::random(50.0, 3.0, 150, seed);
        let r =
            (0..20_000).map(|n| if (10_000..12_000).contains(&n) { levels.next().unwrap() } else { 50.0 });
        let excited = of(Kind::Excitation, &simulated("", seed, r));
        let [one] = excited.as_slice() else { panic!("seed {seed}: {excited:?}") };
        assert!(
            (9_999.0..10_200.0).contains(&one.from_s) && (11_800.0..12_700.0).contains(&one.to_s),
            "{one:?}"
        );
    }
}

#[test]
fn a_reference_that_moves_and_moves_nothing_is_no_excitation() {
    let mut levels = Reference::random(50.0, 3.0, 150, 1);
    let mut noise = Reference::random(0.0, 0.1, 1, 2);
    let mut finder = Finder::new();
    for index in 0..10_000 {
        let y = 50.0 + noise.next().unwrap();
        sample(
            &mut finder,
            index,
            [levels.next().unwrap(), y, 45.0 + 0.1 * noise.next().unwrap()],
            RowState::Valid,
        );
    }
    assert!(of(Kind::Excitation, &finder.finish().0).is_empty());
}

#[test]
fn steps_by_hand_are_found_with_the_stretch_by_hand() {
    let mut finder = Finder::new();
    let mut noise = Reference::random(0.0, 0.05, 1, 3);
    let mut y = 40.0;
    for index in 0..9_000_usize {
        let by_hand = (3_000..6_000).contains(&index);
        let u = if by_hand { 40.0 + 5.0 * ((index / 400) % 2) as f64 } else { 40.0 };
        y += (u - y) / 15.0;
        let state = if by_hand { RowState::Manual } else { RowState::Valid };
        sample(&mut finder, index, [40.0, y + noise.next().unwrap(), u], state);
    }
    let found = finder.finish().0;
    let by_hand = of(Kind::Manual, &found);
    assert_eq!(by_hand.iter().map(|s| (s.from_s, s.to_s)).collect::<Vec<_>>(), [(3000.0, 5999.0)]);
    let [excited] = of(Kind::Excitation, &found)[..] else { panic!("{found:?}") };
    assert!(excited.from_s >= 3_000.0 && excited.to_s < 6_000.0, "{excited:?}");
}

#[test]
fn a_valve_that_is_open_and_does_not_suffice_is_found() {
    // From 10 000 to 13 000 s more is asked for than the greatest u gives.
    let r = (0..20_000).map(|n| if (10_000..13_000).contains(&n) { 120.0 } else { 50.0 });
    let found = of(Kind::Saturation, &simulated("", 5, r));
    let [one] = found.as_slice() else { panic!("{found:?}") };
    assert!(
        (10_000.0..10_400.0).contains(&one.from_s) && (12_900.0..13_100.0).contains(&one.to_s),
        "{one:?}"
    );
}

#[test]
fn a_swing_is_found_and_noise_is_none() {
    let mut noise = Reference::random(0.0, 0.1, 1, 4);
    let mut finder = Finder::new();
    for index in 0..12_000_usize {
        let swing = if (4_000..8_000).contains(&index) { (index as f64 / 15.0).sin() } else { 0.0 };
        sample(
            &mut finder,
            index,
            [50.0, 50.0 + swing + noise.next().unwrap(), 45.0 + swing],
            RowState::Valid,
        );
    }
    let found = of(Kind::Oscillation, &finder.finish().0);
    assert!(!found.is_empty());
    let covered: f64 = found.iter().map(|s| s.to_s - s.from_s).sum();
    assert!(covered > 3_000.0, "most of the swing: {found:?}");
    assert!(found.iter().all(|s| s.from_s > 3_800.0 && s.to_s < 8_200.0), "{found:?}");
}

#[test]
fn a_gain_that_is_lost_at_rest_is_a_change() {
    for seed in 0..10 {
        let physics = "[[physics]]\nkind = \"gain_loss\"\nloss = 0.1\nonset_s = 10000.0\n";
        let found = of(Kind::Change, &simulated(physics, seed, std::iter::repeat_n(50.0, 20_000)));
        let later: Vec<_> = found.into_iter().filter(|stretch| stretch.from_s > 3000.0).collect();
        let [one] = later.as_slice() else { panic!("seed {seed}: {later:?}") };
        assert!(one.from_s < 10_100.0 && one.to_s > 9_900.0, "{one:?}");
    }
}
