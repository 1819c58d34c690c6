//! A memory of earlier windows learnt in place: what so few windows promise, and what the memory is for.

use crate::core_memory_commissioning::{KINDS, WINDOW, Windows, loops, one_tick, unlearned};
use drift_core::{
    Channel, ChannelKind, Commissioning, Config, Cusum, Detectors, Everything, Full, MemoryCommissioning,
    Monitor, Order,
};
use rayon::prelude::*;

/// Decisions per false alarm of one device behind CUSUM(0.5, 5).
fn every(channel: Channel, healthy: &mut Windows, decisions: u32) -> f64 {
    let mut monitor = one_tick(channel);
    let mut alarms = 0u32;
    for _ in 0..decisions {
        let (x, value) = healthy.next(0.0);
        let report = monitor.tick(x, x, value).unwrap();
        if report.channels[0].alarms.cusum.is_some() {
            alarms += 1;
            monitor.acknowledge();
        }
    }
    f64::from(decisions) / f64::from(alarms.max(1))
}

/// A device that learns from so many windows: order, promise, decisions per false alarm with memory and with the line alone.
fn device(windows: u32, seed: u64, own: [f32; 2], decisions: u32) -> [f64; 4] {
    let cusum = Cusum::new(0.5, 5.0);
    let mut healthy = Windows::new(1000 * u64::from(windows) + seed, own);
    let mut memory = MemoryCommissioning::<Order<3>>::of_channel(0);
    let mut line = Commissioning::<1>::new();
    for hop in 0..windows {
        let (x, value) = healthy.next(0.0);
        memory.learn_window(hop, x, value, f32::NAN);
        line.learn_window(std::iter::once((x, value)));
    }
    let detectors = Detectors { cusum: Some(cusum), ..Detectors::NONE };
    let mut channel = line.channels([ChannelKind::Effort], detectors).unwrap()[0];
    let alone = every(channel, &mut healthy, decisions);
    memory.finish(&mut channel).unwrap();
    let with = every(channel, &mut healthy, decisions);
    [f64::from(channel.memory.order), f64::from(memory.honest_arl0(&cusum)), with, alone]
}

/// What nine of ten devices keep, with memory and with the line alone, must be what they were promised.
fn promise_table(windows: &[u32], devices: u64, decisions: u32) {
    println!(
        "| own coefficients | windows | order, mean | promised | kept by nine of ten | median | line alone: kept |"
    );
    println!("|---|---|---|---|---|---|---|");
    for own in [[0.5, 0.2], [0.3, 0.0], [-0.4, 0.1]] {
        for &windows in windows {
            let all: Vec<[f64; 4]> =
                (0..devices).into_par_iter().map(|seed| device(windows, seed, own, decisions)).collect();
            let sorted = |of: usize| {
                let mut all: Vec<f64> = all.iter().map(|a| a[of]).collect();
                all.sort_by(f64::total_cmp);
                all
            };
            let order = sorted(0).iter().sum::<f64>() / devices as f64;
            let (promised, with, alone) = (all[0][1], sorted(2), sorted(3));
            let (kept, line) = (with[devices as usize / 10], alone[devices as usize / 10]);
            let median = with[devices as usize / 2];
            println!(
                "| {}, {} | {windows} | {order:.2} | {promised:.0} | {kept:.0} | {median:.0} | {line:.0} |",
                own[0], own[1]
            );
            // An order of 2 is needed, which begins at 150 windows.
            assert!(
                windows < 150 || kept > 0.85 * promised,
                "{windows} windows: {kept} where {promised} is promised"
            );
        }
    }
}

/// Of devices that learnt a memory in place, nine of ten keep the run length that is promised for so many windows.
#[test]
fn the_promise_holds_with_a_memory_learnt_in_place() {
    promise_table(&[200, 500], 100, 30_000);
}

#[test]
#[ignore = "a minute: 3000 devices"]
fn the_promise_of_a_memory_learnt_in_place() {
    promise_table(&[110, 155, 200, 300, 500, 1000], 200, 100_000);
}

/// On simulated loops with a random load: windows between false alarms, the mean over devices. The slowest has a lag of two windows and
/// is not white behind three of them: its mean is hardly what is promised to nine of ten.
#[test]
fn loops_keep_the_promise() {
    let cusum = Cusum::new(0.5, 5.0);
    println!(
        "| loop | windows learnt | order, mean | false alarm every: memory | line alone | promised to nine of ten |"
    );
    println!("|---|---|---|---|---|---|");
    for place in 0..3 {
        for windows in [210, 400] {
            let each = |seed: u64| {
                let (_, mut of) = loops(4000 + seed).into_iter().nth(place).unwrap();
                let mut monitor = Monitor::<f32, Full, Everything<1>, 3>::new(unlearned()).unwrap();
                let mut line = Commissioning::<3>::new();
                let mut memory = MemoryCommissioning::<Order<3>>::of_channel(1);
                while line.windows() < windows {
                    let [r, y, u] = of.tick(0.0).map(|v| v as f32);
                    if let Some(report) = monitor.tick(r, y, u) {
                        line.learn(report);
                        memory.learn(report);
                    }
                }
                let detectors = Detectors { cusum: Some(cusum), ..Detectors::NONE };
                let mut channel = line.channels(KINDS, detectors).unwrap()[1];
                let mut alone = one_tick(channel);
                memory.finish(&mut channel).unwrap();
                let mut with = one_tick(channel);
                let (mut alarms, mut judged) = ([0u32; 2], 0);
                while judged < 1000 {
                    let [r, y, u] = of.tick(0.0).map(|v| v as f32);
                    let Some(report) = monitor.tick(r, y, u) else { continue };
                    let (x, value) = (report.channels[1].x, report.channels[1].value);
                    judged += 1;
                    for (monitor, alarms) in [&mut with, &mut alone].into_iter().zip(&mut alarms) {
                        if monitor.tick(x, x, value).unwrap().channels[0].alarms.cusum.is_some() {
                            *alarms += 1;
                            monitor.acknowledge();
                        }
                    }
                }
                (alarms, f64::from(channel.memory.order), memory.honest_arl0(&cusum))
            };
            let all: Vec<_> = (0..24u64).into_par_iter().map(each).collect();
            let every = |of: usize| 24_000.0 / f64::from(all.iter().map(|a| a.0[of]).sum::<u32>().max(1));
            let order = all.iter().map(|a| a.1).sum::<f64>() / 24.0;
            let promised = all[0].2;
            println!(
                "| {} | {windows} | {order:.2} | {:.0} | {:.0} | {promised:.0} |",
                loops(0)[place].0,
                every(0),
                every(1)
            );
            assert!(every(0) > 0.9 * f64::from(promised), "{}: {} windows", loops(0)[place].0, every(0));
        }
    }
}

/// The memory is for what it finds sooner: a lasting load behind a memory learnt in place and behind the line alone.
#[test]
fn a_monitor_with_the_learnt_memory_finds_a_load_sooner() {
    let delay = |seed: u64, remembers: bool| {
        let (_, mut of) = loops(300 + seed).into_iter().next().unwrap();
        let mut monitor = Monitor::<f32, Full, Everything<1>, 3>::new(unlearned()).unwrap();
        let mut line = Commissioning::<3>::new();
        let mut memory = MemoryCommissioning::<Order<3>>::of_channel(1);
        while line.windows() < 300 {
            let [r, y, u] = of.tick(0.0).map(|v| v as f32);
            if let Some(report) = monitor.tick(r, y, u) {
                line.learn(report);
                memory.learn(report);
            }
        }
        let detectors = Detectors { cusum: Some(Cusum::new(0.5, 5.0)), ..Detectors::NONE };
        let mut channels = line.channels(KINDS, detectors).unwrap();
        if remembers {
            memory.finish(&mut channels[1]).unwrap();
            assert!(channels[1].memory.order > 0);
        }
        let load = 0.7 * f64::from(line.baselines().unwrap()[1].sigma);
        let mut monitor =
            Monitor::<f32, Full, Everything<1>, 3>::new(Config::new(0.1, WINDOW, 1, channels)).unwrap();
        let mut decisions = 0;
        loop {
            let [r, y, u] = of.tick(if decisions < 5 { 0.0 } else { load }).map(|v| v as f32);
            let Some(report) = monitor.tick(r, y, u) else { continue };
            decisions += 1;
            let alarm = report.channels[1].alarms.cusum.is_some();
            if decisions > 5 && alarm || decisions > 205 {
                return decisions - 5;
            } else if alarm {
                monitor.acknowledge();
            }
        }
    };
    let mean = |remembers| (0..24).into_par_iter().map(|s| delay(s, remembers)).sum::<i32>() as f64 / 24.0;
    let (without, with) = (mean(false), mean(true));
    println!("a load of 0.7 sigma: {without:.1} windows without, {with:.1} with memory");
    assert!(with < 0.5 * without, "{without} -> {with}");
}
