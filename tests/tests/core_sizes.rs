//! RAM of a monitor and of its saved state, bytes. The README's table is this output.

use std::mem::size_of;

use drift_core::{
    Channel, Commissioning, Config, FullBlock, FullMonitor, Iae, Itae, Monitor, PairMonitor, Report,
};

#[test]
fn sizes_are_pinned() {
    // On a 64-bit host; a 32-bit target needs less (pointers and lengths of four bytes).
    let pinned: [(&str, usize, usize); 12] = [
        ("PairMonitor<f32, Iae, 16>", size_of::<PairMonitor<'_, f32, Iae, 16>>(), PINNED[0]),
        ("PairMonitor<f32, Itae, 16>", size_of::<PairMonitor<'_, f32, Itae, 16>>(), PINNED[1]),
        ("PairMonitor<i32, Iae, 16>", size_of::<PairMonitor<'_, i32, Iae, 16>>(), PINNED[2]),
        ("FullMonitor<f32, 8>", size_of::<FullMonitor<'_, f32, 8>>(), PINNED[3]),
        ("FullMonitor<i32, 8>", size_of::<FullMonitor<'_, i32, 8>>(), PINNED[4]),
        ("FullBlock<f32>", size_of::<FullBlock<f32>>(), PINNED[5]),
        ("Channel (flash)", size_of::<Channel>(), PINNED[6]),
        ("Config<f32, 3> (flash)", size_of::<Config<f32, 3>>(), PINNED[7]),
        ("Report<3>", size_of::<Report<3>>(), PINNED[8]),
        ("Commissioning<3>", size_of::<Commissioning<3>>(), PINNED[9]),
        ("saved PairMonitor<f32, Iae, 16>", PairMonitor::<f32, Iae, 16>::STATE_BYTES, PINNED[10]),
        ("saved FullMonitor<f32, 8>", FullMonitor::<f32, 8>::STATE_BYTES, PINNED[11]),
    ];
    for (name, size, _) in pinned {
        println!("{name:34} {size:5}");
    }
    if size_of::<usize>() == 8 {
        for (name, size, pinned) in pinned {
            assert_eq!(size, pinned, "{name}");
        }
    }
}

const PINNED: [usize; 12] = [232, 312, 376, 672, 1072, 52, 88, 324, 252, 96, 238, 672];

/// What a window of a thousand ticks would need if it kept its samples: two indices of 4000 bytes.
#[test]
fn a_window_costs_blocks_not_ticks() {
    assert!(size_of::<Monitor<'_, f32, drift_core::Pair<Iae>, 16, 1>>() < 8000 / 20);
}
