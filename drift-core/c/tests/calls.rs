//! The C interface as C calls it: what is refused, and that what is refused leaves the caller's memory alone. Runs under
//! Miri as well.
#![allow(clippy::undocumented_unsafe_blocks)]

use std::mem::MaybeUninit;
use std::ptr::null_mut;

use drift_c::codes::*;
use drift_c::commissioning::*;
use drift_c::config::*;
use drift_c::kinds::*;
use drift_c::memory_commissioning::*;
use drift_c::monitor::*;
use drift_c::report::drift_report_t;

/// A monitor has padding: copied as plain words it would be read.
type Memory = [MaybeUninit<drift_monitor_t>; DRIFT_FULL_WORDS];
const ZERO: Memory = [MaybeUninit::new(drift_monitor_t { word: 0 }); DRIFT_FULL_WORDS];

fn at(memory: &mut Memory) -> *mut drift_monitor_t {
    memory.as_mut_ptr().cast()
}

/// Windows of 4 blocks of 5 ticks, one CUSUM.
fn config() -> drift_config_t {
    // All bytes zero is a valid value of every field.
    let mut config: drift_config_t = unsafe { MaybeUninit::zeroed().assume_init() };
    (config.sample_time_s, config.block_ticks, config.window_blocks, config.hop_blocks) = (0.001, 5, 4, 4);
    (config.min_valid, config.y_unit, config.u_unit) = (0.5, 1.0, 1.0);
    (config.confirm_hops, config.log_odds, config.smallest_shift) = (5, 4.6, 1.0);
    for (channel, kind) in config.channels.iter_mut().zip([DRIFT_ENERGY_ERROR, DRIFT_EFFORT, DRIFT_ACTIVITY])
    {
        channel.kind = kind;
        channel.baseline.sigma = 1.0;
        (channel.baseline.x_min, channel.baseline.x_max) = (f32::MIN, f32::MAX);
        channel.has_cusum = 1;
        (channel.cusum.k, channel.cusum.h) = (0.5, 5.0);
    }
    config
}

fn report() -> drift_report_t {
    unsafe { MaybeUninit::zeroed().assume_init() }
}

#[test]
fn limits_of_counts_are_counts() {
    let mut memory = ZERO;
    let start = |edit: fn(&mut drift_config_t), memory: &mut Memory| {
        let mut config = config();
        config.has_saturation = 1;
        (config.u_min, config.u_max) = (-100.0, 100.0);
        edit(&mut config);
        unsafe { drift_pair_i32_init(at(memory), DRIFT_PAIR_I32_WORDS as u32, &config) }
    };
    assert_eq!(start(|_| (), &mut memory), DRIFT_OK);
    assert_eq!(start(|c| c.u_min = f32::NAN, &mut memory), DRIFT_BAD_CONFIG);
    assert_eq!(start(|c| c.u_max = 99.5, &mut memory), DRIFT_BAD_CONFIG);
    assert_eq!(start(|c| c.u_max = 1e20, &mut memory), DRIFT_BAD_CONFIG);
    let steps = |c: &mut drift_config_t| (c.has_blanking, c.blank_reference_step) = (1, f32::NAN);
    assert_eq!(start(steps, &mut memory), DRIFT_BAD_CONFIG);
    let steps = |c: &mut drift_config_t| (c.has_blanking, c.blank_reference_step) = (1, 3.25);
    assert_eq!(start(steps, &mut memory), DRIFT_BAD_CONFIG);
}

#[test]
fn a_save_that_is_refused_writes_nothing() {
    let mut memory = ZERO;
    let mut bytes = [0x5a_u8; DRIFT_STATE_BYTES];
    let size = bytes.len() as u32;
    unsafe {
        assert_eq!(drift_save(at(&mut memory), bytes.as_mut_ptr(), size), DRIFT_NOT_INITIALISED);
        assert_eq!(drift_save(null_mut(), bytes.as_mut_ptr(), size), DRIFT_NULL);
        let config = config();
        assert_eq!(drift_full_init(at(&mut memory), DRIFT_FULL_WORDS as u32, &config), DRIFT_OK);
        let needed = drift_state_bytes(at(&mut memory));
        assert!(needed > 0);
        let too_few = needed as u32 - 1;
        assert_eq!(drift_save(at(&mut memory), bytes.as_mut_ptr(), too_few), DRIFT_BUFFER_TOO_SMALL);
        assert!(bytes.iter().all(|b| *b == 0x5a), "the caller's bytes");
        assert_eq!(drift_save(at(&mut memory), bytes.as_mut_ptr(), size), needed);
        assert_eq!(drift_restore(at(&mut memory), bytes.as_ptr(), needed as u32), DRIFT_OK);
    }
}

#[test]
fn too_few_words_other_numbers_and_what_is_not_linked_are_refused() {
    let (mut memory, mut report, mut config) = (ZERO, report(), config());
    unsafe {
        let words = DRIFT_PAIR_WORDS as u32;
        assert_eq!(drift_pair_init(at(&mut memory), 5, &config), DRIFT_BUFFER_TOO_SMALL);
        assert_eq!(drift_pair_init(at(&mut memory), words, &config), DRIFT_OK);
        assert_eq!(drift_tick_i32(at(&mut memory), 1, 2, 3, &mut report), DRIFT_OTHER_NUMBER);
        assert_eq!(drift_tick_without(at(&mut memory), 7, &mut report), DRIFT_BAD_CONFIG);
        config.hop_blocks = 2;
        assert_eq!(drift_pair_init(at(&mut memory), words, &config), DRIFT_NOT_LINKED);
        let odd = at(&mut memory).byte_add(1);
        assert_eq!(drift_tick(odd, 0.0, 0.0, 0.0, &mut report), DRIFT_MISALIGNED);
    }
}

/// Numbers of a 32-bit xorshift (Marsaglia 2003).
fn numbers(mut seed: u32) -> impl FnMut() -> u32 {
    move || {
        seed ^= seed << 13;
        seed ^= seed >> 17;
        seed ^= seed << 5;
        seed
    }
}

/// The same as even noise from -0.5 to 0.5.
fn noise(seed: u32) -> impl FnMut() -> f32 {
    let mut next = numbers(seed);
    move || (next() >> 8) as f32 / 16_777_216.0 - 0.5
}

/// A monitor learns its baseline, is started with it, and finds a drift; it may be moved meanwhile.
#[test]
fn commissioning_and_a_drift() {
    let (mut memory, mut report, mut config) = (ZERO, report(), config());
    let mut learning = drift_commissioning_t { words: [0; DRIFT_COMMISSIONING_WORDS] };
    let mut noise = noise(1);
    config.channels.iter_mut().for_each(|c| c.baseline.sigma = 0.0);
    let mut window = |memory: &mut Memory, report: &mut drift_report_t, more: f32| {
        for _ in 0..20 {
            let (y, u) = (noise(), 1.0 + more + noise());
            unsafe { drift_tick(at(memory), 0.5 * noise(), y, u, report) };
        }
    };
    unsafe {
        assert_eq!(drift_full_init(at(&mut memory), DRIFT_FULL_WORDS as u32, &config), DRIFT_OK);
        assert_eq!(drift_commissioning_start(&mut learning), DRIFT_OK);
        assert_eq!(drift_commissioning_finish(&learning, 3, &mut config), DRIFT_TOO_FEW_WINDOWS);
        for _ in 0..40 {
            window(&mut memory, &mut report, 0.0);
            assert_eq!(drift_commissioning_learn(&mut learning, &report), DRIFT_OK);
        }
        assert_eq!(drift_commissioning_finish(&learning, 3, &mut config), DRIFT_OK);
        assert!(config.channels.iter().all(|c| c.baseline.sigma > 0.0 && c.baseline.windows == 40.0));
        assert_eq!(drift_full_init(at(&mut memory), DRIFT_FULL_WORDS as u32, &config), DRIFT_OK);
    }
    for _ in 0..10 {
        window(&mut memory, &mut report, 3.0);
    }
    let mut moved = memory;
    window(&mut moved, &mut report, 3.0);
    assert_eq!((report.verdict, report.channels[1].side), (DRIFT_DRIFT, DRIFT_SIDE_HIGH));
}

/// u = 1 + 0.5 point + noise: the point's weight is learnt in place too, so that a point beyond what was usual is no drift and a load
/// is.
#[test]
fn commissioning_learns_the_operating_point() {
    let mut memory = [MaybeUninit::new(drift_monitor_t { word: 0 }); DRIFT_FULL_AT_WORDS];
    let monitor: *mut drift_monitor_t = memory.as_mut_ptr().cast();
    let (mut report, mut config) = (report(), config());
    let mut learning = drift_commissioning_t { words: [0; DRIFT_COMMISSIONING_WORDS] };
    let mut noise = noise(7);
    config.channels.iter_mut().for_each(|c| c.baseline.sigma = 0.0);
    let mut window = |report: &mut drift_report_t, point: f32, load: f32| {
        for _ in 0..20 {
            let (r, y, u) = (0.5 * noise(), noise(), 1.0 + 0.5 * point + load + noise());
            unsafe {
                drift_operating_point(monitor, point);
                drift_tick(monitor, r, y, u, report);
            }
        }
    };
    unsafe {
        assert_eq!(drift_full_at_init(monitor, DRIFT_FULL_AT_WORDS as u32, &config), DRIFT_OK);
        assert_eq!(drift_commissioning_start(&mut learning), DRIFT_OK);
        for _ in 0..40 {
            window(&mut report, 10.0, 0.0);
            assert_eq!(drift_commissioning_learn(&mut learning, &report), DRIFT_OK);
        }
        assert_eq!(drift_commissioning_finish(&learning, 3, &mut config), DRIFT_POINT_STANDS_STILL);
        assert_eq!(config.channels[1].baseline.sigma, 0.0, "nothing is written");
        assert_eq!(drift_commissioning_start(&mut learning), DRIFT_OK);
        for i in 0..60 {
            window(&mut report, (i * 7 % 20) as f32, 0.0);
            assert_eq!(drift_commissioning_learn(&mut learning, &report), DRIFT_OK);
        }
        assert_eq!(drift_commissioning_finish(&learning, 3, &mut config), DRIFT_OK);
        let point = config.channels[1].operating_point;
        assert!(
            (point.weight - 0.5).abs() < 0.01 && (point.min, point.max) == (0.0, 19.0),
            "{}",
            point.weight
        );
        assert_eq!(config.channels[0].operating_point.weight, 0.0);
        assert_eq!(drift_full_at_init(monitor, DRIFT_FULL_AT_WORDS as u32, &config), DRIFT_OK);
    }
    for i in 0..20 {
        window(&mut report, 19.0 - (i % 3) as f32, 0.0);
        assert_eq!(report.channels[1].verdict, DRIFT_HEALTHY, "window {i}");
    }
    for i in 0..11 {
        window(&mut report, (i * 7 % 20) as f32, 1.0);
    }
    assert_eq!((report.channels[1].verdict, report.channels[1].side), (DRIFT_DRIFT, DRIFT_SIDE_HIGH));
}

/// A window's u lies between its y and the u before: the memory is learnt in place, and a monitor runs on it.
#[test]
fn commissioning_learns_a_memory() {
    let (mut memory, mut report, mut config) = (ZERO, report(), config());
    let mut learning = drift_memory_commissioning_t { words: [0; DRIFT_MEMORY_COMMISSIONING_WORDS] };
    let (mut noise, mut u) = (noise(3), 1.0f32);
    config.channels.iter_mut().for_each(|c| c.baseline.sigma = 0.0);
    let mut window = |memory: &mut Memory, report: &mut drift_report_t, load: f32| {
        let level = noise();
        u = 0.5 * u + 0.5 + level + load + 0.05 * noise();
        for _ in 0..20 {
            unsafe { drift_tick(at(memory), level, level, u, report) };
        }
    };
    unsafe {
        assert_eq!(drift_memory_commissioning_start(null_mut(), 1), DRIFT_NULL);
        assert_eq!(drift_memory_commissioning_start(&mut learning, 3), DRIFT_BAD_CONFIG);
        assert_eq!(drift_memory_commissioning_start(&mut learning, 1), DRIFT_OK);
        assert_eq!(drift_full_init(at(&mut memory), DRIFT_FULL_WORDS as u32, &config), DRIFT_OK);
        for _ in 0..102 {
            window(&mut memory, &mut report, 0.0);
            assert_eq!(drift_memory_commissioning_learn(&mut learning, &report), DRIFT_OK);
        }
        assert_eq!(drift_memory_commissioning_finish(&learning, &mut config), DRIFT_TOO_FEW_WINDOWS);
        assert_eq!((config.channels[1].baseline.sigma, config.channels[1].memory.order), (0.0, 0));
        for _ in 0..200 {
            window(&mut memory, &mut report, 0.0);
            assert_eq!(drift_memory_commissioning_learn(&mut learning, &report), DRIFT_OK);
        }
        assert_eq!(drift_memory_commissioning_finish(&learning, &mut config), DRIFT_OK);
        let (baseline, learnt) = (config.channels[1].baseline, config.channels[1].memory);
        assert_eq!((learnt.order, baseline.windows), (1, 299.0));
        assert!((learnt.value[0] - 0.5).abs() < 0.02 && (baseline.b1 - 1.0).abs() < 0.02);
        assert_eq!(
            drift_pair_init(at(&mut memory), DRIFT_PAIR_WORDS as u32, &config),
            DRIFT_OK,
            "the first channel alone"
        );
        assert_eq!(drift_full_init(at(&mut memory), DRIFT_FULL_WORDS as u32, &config), DRIFT_OK);
    }
    for i in 0..50 {
        window(&mut memory, &mut report, 0.0);
        assert_eq!(report.channels[1].verdict, DRIFT_HEALTHY, "window {i}");
    }
    let mut delay = 0;
    while report.channels[1].alarm_cusum == DRIFT_SIDE_NONE {
        window(&mut memory, &mut report, 0.03);
        delay += 1;
    }
    assert!(delay < 10 && report.channels[1].side == DRIFT_SIDE_HIGH, "{delay} windows");
}

#[test]
fn a_loop_that_stands_still_is_not_learnt() {
    let (mut memory, mut report, mut config) = (ZERO, report(), config());
    config.channels.iter_mut().for_each(|c| c.baseline.sigma = 0.0);
    let mut learning = drift_commissioning_t { words: [0; DRIFT_COMMISSIONING_WORDS] };
    unsafe {
        assert_eq!(drift_full_init(at(&mut memory), DRIFT_FULL_WORDS as u32, &config), DRIFT_OK);
        assert_eq!(drift_commissioning_start(&mut learning), DRIFT_OK);
        for i in 0..20 * 40 {
            if drift_tick(at(&mut memory), 1.0, 0.5, 2.0, &mut report) == DRIFT_REPORT && i > 30 {
                drift_commissioning_learn(&mut learning, &report);
            }
        }
        let before = config.channels[0].baseline.sigma;
        assert_eq!(drift_commissioning_finish(&learning, 1, &mut config), DRIFT_NO_SCATTER);
        assert_eq!(config.channels[0].baseline.sigma, before);
    }
}

/// Calls in any order with any numbers, on memory that may be anything: every call gives a code, and none is undefined
/// behaviour (Miri and the sanitizers look).
#[test]
fn random_calls_always_give_a_code() {
    let calls = if cfg!(miri) { 1_500 } else { 300_000 };
    let (mut memory, mut report) = (ZERO, report());
    let mut bytes = [0u8; DRIFT_STATE_BYTES];
    let mut next = numbers(7);
    let mut reports = 0;
    for _ in 0..calls {
        let (which, a, b, c) = (next() % 24, next(), next(), next());
        let monitor = at(&mut memory);
        let code = unsafe {
            match which {
                0 => {
                    let mut config = config();
                    match a % 9 {
                        0 => config.block_ticks = b % 40,
                        1 => config.window_blocks = (b % 20) as u16,
                        2 => config.hop_blocks = (b % 5) as u16,
                        3 => config.channels[(b % 3) as usize].kind = c % 6,
                        4 => config.min_valid = f32::from_bits(b),
                        5 => config.channels[0].baseline.b1 = f32::from_bits(b),
                        6 => (config.has_blanking, config.blank_ticks) = (1, b % 9),
                        _ => {}
                    }
                    let words = DRIFT_FULL_WORDS as u32;
                    match c % 3 {
                        0 => drift_pair_init(monitor, words, &config),
                        1 => drift_full_init(monitor, words, &config),
                        _ => drift_full_i32_init(monitor, words, &config),
                    }
                }
                1 => drift_acknowledge(monitor),
                2 => drift_save(monitor, bytes.as_mut_ptr(), (a as usize % (DRIFT_STATE_BYTES + 1)) as u32),
                3 => drift_save(monitor, bytes.as_mut_ptr(), DRIFT_STATE_BYTES as u32),
                4 => {
                    bytes[a as usize % DRIFT_STATE_BYTES] ^= (b & 0xff) as u8 & (c & 0xff) as u8;
                    drift_restore(monitor, bytes.as_ptr(), DRIFT_STATE_BYTES as u32)
                }
                5 => drift_tick_without(monitor, a % 3, &mut report),
                6 => {
                    drift_tick(monitor, f32::from_bits(a), f32::from_bits(b), f32::from_bits(c), &mut report)
                }
                7 if a % 97 == 0 => {
                    // Somebody else's bytes at the head.
                    memory[(b % 2) as usize] = MaybeUninit::new(drift_monitor_t { word: u64::from(c) });
                    let code = drift_tick(at(&mut memory), 1.0, 0.5, 1.0, &mut report);
                    memory = ZERO;
                    code
                }
                n if n % 2 == 0 => drift_tick(monitor, 1.0, 0.5, (b % 100) as f32, &mut report),
                _ => drift_tick_i32(monitor, 100, (a % 500) as i32, (b % 1000) as i32, &mut report),
            }
        };
        assert!((DRIFT_NO_SCATTER..=DRIFT_STATE_BYTES as i32).contains(&code), "call {which}: {code}");
        reports += u32::from(code == DRIFT_REPORT);
    }
    assert!(reports > calls / 300, "{reports} reports");
}

/// A quarter of u per unit of the point: told, u lies on the line; not told, no tick counts; other kinds refuse it.
#[test]
fn an_operating_point_is_told_apart_from_the_tick() {
    let mut memory: [MaybeUninit<drift_monitor_t>; DRIFT_FULL_AT_WORDS] =
        [MaybeUninit::new(drift_monitor_t { word: 0 }); DRIFT_FULL_AT_WORDS];
    let monitor: *mut drift_monitor_t = memory.as_mut_ptr().cast();
    let mut config = config();
    config.channels[1].operating_point.weight = 0.25;
    (config.channels[1].operating_point.min, config.channels[1].operating_point.max) = (-1.0, 10.0);
    let mut report = report();
    let mut window = |monitor, u: f32| {
        (0..20).map(|_| unsafe { drift_tick(monitor, 1.0, 1.0, u, &mut report) }).for_each(drop);
        report
    };
    unsafe {
        let words = DRIFT_FULL_AT_WORDS as u32;
        assert_eq!(drift_full_init(monitor, words, &config), DRIFT_NOT_LINKED);
        assert_eq!(drift_full_at_init(monitor, words, &config), DRIFT_OK);
        assert_eq!(window(monitor, 2.0).valid, 0);
        assert_eq!(drift_operating_point(monitor, 8.0), DRIFT_OK);
        let report = window(monitor, 2.0);
        assert_eq!((report.valid, report.operating_point, report.channels[1].residual), (1, 8.0, 0.0));
        assert_eq!(drift_operating_point_i32(monitor, 8), DRIFT_OTHER_NUMBER);
        config.channels[1].operating_point.weight = 0.0;
        assert_eq!(drift_full_init(monitor, words, &config), DRIFT_OK);
        assert_eq!(drift_operating_point(monitor, 8.0), DRIFT_NOT_LINKED);
        assert_eq!(drift_operating_point(std::ptr::null_mut(), 8.0), DRIFT_NULL);
        assert_eq!(drift_full_at_i32_init(monitor, words, &config), DRIFT_OK);
        assert_eq!(drift_operating_point_i32(monitor, 8), DRIFT_OK);
    }
}
