//! A moving sum of |r - y| over 16 x 250 ticks and a CUSUM of it, tick by tick: the nearest that nexus-stats has to the monitor of a
//! pair. Usage: rivals-nexus COUNT. The samples are those of examples/src/bin/inner_loops.rs; prints how many updates said that
//! there is a shift.

use nexus_stats_core::detection::CusumF64;
use nexus_stats_detection::detection::MosumF64;

const ROUND: usize = 4000;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let count: usize = std::env::args().nth(1).ok_or("usage: rivals-nexus COUNT")?.parse()?;
    let mut seed = 1_u32;
    let mut column = || -> Vec<f64> {
        let mut next = || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(seed >> 8) / f64::from(1 << 24) - 0.5
        };
        (0..ROUND).map(|_| next()).collect()
    };
    let (r, y) = std::hint::black_box((column(), column()));
    let mut sum = MosumF64::builder(1.0 / 3.0)
        .window_size(ROUND)
        .threshold(1e9)
        .build()
        .map_err(|e| format!("{e:?}"))?;
    let mut cusum =
        CusumF64::builder(1.0 / 3.0).slack(0.5).threshold(1e9).build().map_err(|e| format!("{e:?}"))?;
    let mut shifts = 0_u64;
    for _ in 0..count.div_ceil(ROUND) {
        for (r, y) in r.iter().zip(&y) {
            let error = (r - y).abs();
            let moved = [sum.update(error), cusum.update(error)];
            shifts += moved
                .iter()
                .filter(|said| !matches!(said, Ok(None | Some(nexus_stats_core::Direction::Neutral))))
                .count() as u64;
        }
    }
    println!("{shifts}");
    Ok(())
}
