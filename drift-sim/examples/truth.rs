use drift_sim::control_loop::Loop; use drift_sim::recording::*; use drift_sim::physics::*; use drift_sim::diagnose::{signals::*, model::Model, fit::*, whiten::Whitener};
use std::path::Path;
fn main(){ let a:Vec<String>=std::env::args().collect(); let d=Path::new(&a[1]);
 let l=Loop::read(&d.join("loop.toml")).unwrap(); let rec=Recording::read(&d.join("train.csv"),&ReadOptions::default()).unwrap();
 let s=Signals::new(&rec,&l).unwrap(); let m=Model::refit(&l,&s);
 let g=Fit::start(&m,&s,&Whitener::none()).unwrap().search(&s,Effort::FULL).settle(&s,Effort::FULL);
 let ps:Vec<(String,f64)>=a[4..].iter().map(|p|{let (n,v)=p.split_once('=').unwrap();(n.to_string(),v.parse().unwrap())}).collect();
 let pr:Vec<(&str,f64)>=ps.iter().map(|(n,v)|(n.as_str(),*v)).collect();
 let t=Term::new(&a[2],&pr).unwrap().from_s(a[3].parse().unwrap());
 let mm=m.with_term(&t,t.onset_s>0.0,s.duration_s());
 let f0=Fit::start(&mm,&s,&Whitener::none()).unwrap(); println!("at truth, stated nominal: sd {:.3e}", f0.variance.sqrt());
 let f1=f0.clone().search(&s,Effort::FULL); println!("search sd {:.3e} {:?}", f1.variance.sqrt(), f1.model.x);
 let f2=f1.settle(&s,Effort::FULL); println!("settled sd {:.3e} dLL {:.1} order {} {:?}", f2.variance.sqrt(), f2.log_likelihood-g.log_likelihood, f2.whitener.order(), f2.model.x);
}
