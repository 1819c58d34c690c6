use drift_sim::control_loop::Loop; use drift_sim::recording::*; use drift_sim::physics::*; use drift_sim::diagnose::{signals::*, model::Model, fit::*, whiten::Whitener, missing_drive::*, spectrum, screen, candidates};
use std::path::Path; use std::time::Instant;
fn main(){ for d in std::env::args().skip(1){ let d=Path::new(&d);
 let l=Loop::read(&d.join("loop.toml")).unwrap(); let rec=Recording::read(&d.join("train.csv"),&ReadOptions::default()).unwrap();
 let s=Signals::new(&rec,&l).unwrap(); let m=Model::refit(&l,&s);
 let t=Instant::now();
 let f=Fit::start(&m,&s,&Whitener::none()).unwrap().search(&s,Effort::FULL); let g=f.clone().settle(&s,Effort::FULL);
 let t1=t.elapsed();
 let lin=g.model.loop_at(&g.model.x).unwrap().0.plant.linear().unwrap().unwrap();
 let md=MissingDrive::of(&lin,&g.residual,s.sample_time_s).unwrap();
 let pk=spectrum::peaks(&md.value,3);
 let t2=t.elapsed();
 let mut sigs=vec![];
 let us=deviation(&s.u); let ys=deviation(&s.y);
 let pos: Vec<f64> = match &l.plant { drift_sim::plant::Plant::Servo(p) if p.output==drift_sim::plant::Output::Speed => { let mut x=0.0; s.y.iter().map(|v|{x+=v*s.sample_time_s; x}).collect() }, _=>s.y.clone() };
 let vel: Vec<f64> = match &l.plant { drift_sim::plant::Plant::Servo(p) if p.output==drift_sim::plant::Output::Speed => s.y.clone(), _=> s.y.windows(2).map(|w|(w[1]-w[0])/s.sample_time_s).collect() };
 let per=spectrum::periods(&pos,&md.value,3);
 let base=Signature{ y_scale:ys,u_scale:us,drive_scale:us*l.plant.drive_gain().abs(),speed_scale:deviation(&vel),sample_time_s:s.sample_time_s,duration_s:s.duration_s(),..Signature::default()};
 sigs.push(base.clone());
 for i in 0..3 { let mut b=base.clone(); if let Some((f,a))=pk.get(i){b.peak_hz=f/s.sample_time_s;b.peak_amplitude=*a;} if let Some((p,_))=per.get(i){b.pitch=*p;} sigs.push(b);} 
 let trials=screen::screen(&Fit::start(&m,&s,&Whitener::none()).unwrap(),&g,&s,&sigs,|k|k.place!=Place::Controller&&k.name!="injected_signal"&&k.name!="sensor_noise"&&k.name!="quantization",1);
 let t3=t.elapsed();
 let c=candidates::fit_all(&trials,&s);
 println!("{} {} nominal sd={:.3e} t: fit {:?} drive {:?} screen {:?} all {:?}", d.display(), l.plant.kind(), g.variance.sqrt(), t1,t2,t3,t.elapsed());
 for c in c.iter().take(4){ let n=s.len(); println!("   {:24} dLL={:10.1} sd={:.3e} order {} n={} x={:?}", c.kind.name, c.fit.log_likelihood-g.log_likelihood, c.fit.variance.sqrt(), c.fit.whitener.order(), n, c.fit.model.free.iter().zip(&c.fit.model.x).filter(|(f,_)|!f.name.starts_with("state")).map(|(f,x)|format!("{}={:.5}",f.name,x)).collect::<Vec<_>>()); }
}}
