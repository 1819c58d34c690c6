use drift_sim::control_loop::Loop;
use drift_sim::diagnose::{fit::*, model::Model, signals::Signals, whiten::Whitener};
use drift_sim::recording::*;
use std::path::Path;
use std::time::Instant;
fn main() {
    for d in std::env::args().skip(1) {
        let d = Path::new(&d);
        let l = Loop::read(&d.join("loop.toml")).unwrap();
        let rec = Recording::read(&d.join("train.csv"), &ReadOptions::default()).unwrap();
        let s = Signals::new(&rec, &l).unwrap();
        let m = Model::refit(&l, &s);
        let t = Instant::now();
        let f0 = Fit::start(&m, &s, &Whitener::none()).unwrap();
        let one = t.elapsed();
        let f = f0.clone().search(&s, Effort::FULL);
        let t1 = t.elapsed();
        let g = f.clone().settle(&s, Effort::FULL);
        println!(
            "{} {} N={} one={:?} search={:?} settle={:?} sd0={:.3e} sd={:.3e} white={:.3e} order={} x={:?}",
            d.display(),
            l.plant.kind(),
            s.len(),
            one,
            t1,
            t.elapsed(),
            f0.variance.sqrt(),
            f.variance.sqrt(),
            g.variance.sqrt(),
            g.whitener.order(),
            g.model.x
        );
    }
}
