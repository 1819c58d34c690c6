//! RAM of a monitor and of its saved state, bytes. The README's table is this output.

use std::mem::size_of;

use drift_core::{
    Channel, Commissioning, Config, Everything, Full, FullMonitor, Iae, Itae, MemoryCommissioning, Order,
    Pair, PairMonitor, Paper, Report, Smallest, State,
};

#[test]
fn sizes_are_pinned() {
    // What lies in RAM; the plan may lie in flash. The same on 32 and 64 bits: nothing in it is a pointer.
    type Sliding<J> = State<f32, Pair<J>, Everything<16>>;
    type All<N> = State<N, Full, Everything<8>, 3>;
    type Learning<const N: usize> = MemoryCommissioning<Order<N>>;
    let pinned: [(&str, usize, usize); 16] = [
        ("State<f32, Pair<Iae>, Smallest>", size_of::<State<f32, Pair<Iae>, Smallest>>(), 112),
        ("State<f32, Pair<Iae>, Paper>", size_of::<State<f32, Pair<Iae>, Paper>>(), 148),
        ("State<i32, Pair<Iae>, Paper>", size_of::<State<i32, Pair<Iae>, Paper>>(), 144),
        ("State<f32, Pair<Iae>, Everything<16>>", size_of::<Sliding<Iae>>(), 348),
        ("State<f32, Pair<Itae>, Everything<16>>", size_of::<Sliding<Itae>>(), 428),
        ("State<f32, Full, Everything<8>, 3>", size_of::<All<f32>>(), 1100),
        ("State<i32, Full, Everything<8>, 3>", size_of::<All<i32>>(), 1056),
        ("Channel (flash)", size_of::<Channel>(), 152),
        ("Config<f32, 3> (flash)", size_of::<Config<f32, 3>>(), 516),
        ("Report<3>", size_of::<Report<3>>(), 264),
        ("Commissioning<3>", size_of::<Commissioning<3>>(), 96),
        ("MemoryCommissioning<Order<1>>", size_of::<Learning<1>>(), 124),
        ("MemoryCommissioning<Order<2>>", size_of::<Learning<2>>(), 176),
        ("MemoryCommissioning<Order<3>>", size_of::<Learning<3>>(), 244),
        ("saved PairMonitor<f32, Iae, 16>", PairMonitor::<f32, Iae, 16>::STATE_BYTES, 283),
        ("saved FullMonitor<f32, 8>", FullMonitor::<f32, 8>::STATE_BYTES, 851),
    ];
    for (name, size, _) in pinned {
        println!("{name:34} {size:5}");
    }
    for (name, size, pinned) in pinned {
        assert_eq!(size, pinned, "{name}");
    }
}

/// What a window of a thousand ticks would need if it kept its samples: two indices of 4000 bytes.
#[test]
fn a_window_costs_blocks_not_ticks() {
    assert!(size_of::<State<f32, Pair<Iae>, Paper>>() < 8000 / 20);
}
