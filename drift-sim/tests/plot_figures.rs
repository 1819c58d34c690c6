//! Charts of the kinds that the reports and the paper use: small files, everything on the sheet, nothing that
//! input can break. With `DRIFT_PLOTS=FOLDER` they are left there to be looked at.

use drift_sim::plot::{Colour, Figure, Layer, LegendPosition, Marker, Panel};

/// A loop's three signals, a million samples each, one of them with a single spike.
fn stacked() -> Figure {
    let count = 1_000_000;
    let time = |i: usize| i as f64 * 1e-4;
    let noise = |i: usize, scale: f64| scale * (((i * 7919) % 1000) as f64 / 500.0 - 1.0);
    let r: Vec<_> = (0..count).map(|i| (time(i), if i % 250_000 < 125_000 { 0.25 } else { 0.0 })).collect();
    let y: Vec<_> = r.iter().enumerate().map(|(i, (t, r))| (*t, r + noise(i, 0.01))).collect();
    let mut u: Vec<_> =
        (0..count).map(|i| (time(i), 1.2e-5 * (time(i) / 9.0).sin() + noise(i, 2e-6))).collect();
    u[700_000].1 = 6e-5;
    let e = y.iter().zip(&r).map(|((t, y), (_, r))| (*t, r - y)).collect();
    let span = || Layer::Span { from: 60.0, to: 75.0, name: "hidden fault".into(), colour: Colour::Orange };
    let unnamed = || Layer::Span { from: 60.0, to: 75.0, name: String::new(), colour: Colour::Orange };
    let panel = |y_label: &str, layers| Panel {
        y_label: y_label.into(),
        x_label: "t (s)".into(),
        layers,
        ..Panel::default()
    };
    let onset = Layer::VerticalLine { x: 60.0, name: "onset".into(), colour: Colour::Black, dashed: true };
    Figure::stacked(
        "A loop hides a fault: <y> & \"u\"",
        vec![
            panel(
                "r, y (m)",
                vec![span(), Layer::line("y", Colour::Blue, y), Layer::line("r", Colour::Black, r)],
            ),
            panel("e (m)", vec![unnamed(), Layer::line("e = r \u{2212} y", Colour::Green, e)]),
            panel("u (V)", vec![unnamed(), Layer::line("u", Colour::Vermilion, u), onset]),
        ],
    )
}

/// Windows of a healthy loop, the fitted relation with its bands, and windows after a fault.
fn scatter() -> Figure {
    let healthy: Vec<(f64, f64)> = (0..300)
        .map(|i| {
            (f64::from(i) / 30.0, 2.0 + 0.8 * f64::from(i) / 30.0 + 0.3 * f64::from(i * 37 % 100 - 50) / 50.0)
        })
        .collect();
    let faulty: Vec<_> =
        (0..60).map(|i| (f64::from(i) / 8.0 + 1.0, 3.4 + 0.9 * f64::from(i) / 8.0)).collect();
    let line = |off: f64| -> Vec<(f64, f64)> {
        (0..=10).map(|x| (f64::from(x), 2.0 + 0.8 * f64::from(x) + off)).collect()
    };
    let band = |half: f64, name: &str, colour| Layer::Band {
        lower: line(-half),
        upper: line(half),
        name: name.into(),
        colour,
    };
    Figure::single(Panel {
        title: "Energy against error".into(),
        x_label: "J_e (m\u{b2} s)".into(),
        y_label: "E_u (V\u{b2} s)".into(),
        layers: vec![
            band(0.6, "99.7 % band", Colour::Sky),
            band(0.2, "95 % band of the mean", Colour::Blue),
            Layer::points("healthy windows", Colour::Blue, Marker::Dot, healthy),
            Layer::points("after the fault", Colour::Vermilion, Marker::Cross, faulty),
            Layer::line("baseline b0 + b1 J_e", Colour::Black, line(0.0)),
        ],
        ..Panel::default()
    })
}

/// A ranking as bars on a log axis beside run lengths as lines.
fn logarithmic() -> Figure {
    let names = ["IAE", "ISE", "ITAE", "ITSE", "E_u", "TV"];
    let bars = |offset: f64, factor: f64| -> Vec<(f64, f64)> {
        (0..6).map(|i| (f64::from(i) + offset, factor * 10f64.powi(i - 2))).collect()
    };
    let bar = |name: &str, colour, points| Layer::Bars { points, width: 0.36, name: name.into(), colour };
    let ranking = Panel {
        title: "Ranking".into(),
        y_label: "\u{394}\u{3bc}/\u{394}\u{3c3}".into(),
        x_label: "index".into(),
        layers: vec![
            bar("ours", Colour::Blue, bars(-0.2, 1.3)),
            bar("published", Colour::Orange, bars(0.2, 1.0)),
        ],
        y_log: true,
        x_names: names.iter().enumerate().map(|(i, name)| (i as f64, (*name).into())).collect(),
        ..Panel::default()
    };
    let arl = |slope: f64| {
        (0..=40).map(|i| (f64::from(i) / 8.0, 370.0 * (-slope * f64::from(i) / 8.0).exp() + 1.0)).collect()
    };
    let lengths = Panel {
        title: "Run length".into(),
        x_label: "shift (sigmas)".into(),
        y_label: "ARL (decisions)".into(),
        layers: vec![
            Layer::line("CUSUM", Colour::nth(0), arl(2.5)),
            Layer::dashed("Shewhart", Colour::nth(1), arl(1.2)),
            Layer::HorizontalLine { y: 370.4, name: "ARL0".into(), colour: Colour::Grey, dashed: true },
        ],
        y_log: true,
        ..Panel::default()
    };
    let mut figure = Figure::grid("Two panels beside each other", 2, vec![ranking, lengths]);
    figure.panel_height_px = 300;
    figure
}

fn keep(name: &str, figure: &Figure) {
    if let Some(folder) = std::env::var_os("DRIFT_PLOTS") {
        figure.write_svg(&std::path::Path::new(&folder).join(name)).unwrap();
    }
}

#[test]
fn three_million_samples_are_a_small_file_that_shows_the_spike() {
    let figure = stacked();
    keep("stacked.svg", &figure);
    let svg = figure.to_svg().unwrap();
    assert!(svg.len() < 200_000, "{} bytes", svg.len());
    // Without the spike the highest point of the last panel lies elsewhere.
    let mut calm = figure.clone();
    let Some(Layer::Line { points, .. }) = calm.panels[2].layers.get_mut(1) else { panic!("u") };
    points[700_000].1 = 0.0;
    let top = |svg: &str| svg.matches("6e\u{2212}5").count();
    assert_eq!((top(&svg), top(&calm.to_svg().unwrap())), (1, 0));
    assert!(svg.contains("&lt;y&gt; &amp; &quot;u&quot;") && !svg.contains("<y>"));
}

/// Whoever can't see a chart hears what it shows.
#[test]
fn every_svg_has_a_title_and_a_description() {
    for figure in [stacked(), scatter(), logarithmic()] {
        let svg = figure.to_svg().unwrap();
        let (head, _) = svg.split_once("</desc>").unwrap();
        assert!(head.starts_with("<svg ") && head.contains(" role=\"img\" "), "{head}");
        let (title, description) =
            head.split_once("<title>").unwrap().1.split_once("</title>\n<desc>").unwrap();
        assert!(!title.is_empty() && !description.is_empty() && !head.contains("<text"), "{head}");
    }
    let svg = stacked().to_svg().unwrap();
    assert!(svg.contains("&lt;y&gt;"), "names are escaped");
}

#[test]
fn bands_crosses_bars_and_log_axes_are_drawn() {
    let scatter = scatter();
    keep("scatter.svg", &scatter);
    let svg = scatter.to_svg().unwrap();
    assert_eq!(svg.matches("<polygon").count(), 2);
    assert!(svg.matches("<circle").count() > 290);
    assert!(svg.len() < 200_000);
    let logarithmic = logarithmic();
    keep("logarithmic.svg", &logarithmic);
    let svg = logarithmic.to_svg().unwrap();
    for text in ["ITSE", "0.01", "1000", "ARL (decisions)"] {
        assert!(svg.contains(text), "{text}");
    }
    assert!(svg.contains("stroke-dasharray"));
}

#[test]
fn nothing_makes_it_panic() {
    let (nan, inf) = (f64::NAN, f64::INFINITY);
    let hostile: [Vec<(f64, f64)>; 8] = [
        vec![],
        vec![(0.0, 1.0)],
        vec![(nan, nan), (inf, 0.0), (0.0, -inf)],
        vec![(0.0, 3.0), (1.0, 3.0)],
        vec![(0.0, 0.0), (1.0, nan), (2.0, 1.0), (3.0, 2.0)],
        vec![(f64::MIN, f64::MAX), (f64::MAX, f64::MIN)],
        vec![(-1.0, -1.0), (-2.0, 0.0)],
        vec![(5e-324, 5e-324), (1e-310, 1e-320)],
    ];
    for points in &hostile {
        for (log, range) in [(false, None), (true, None), (false, Some((0.5, 0.6))), (true, Some((inf, nan)))]
        {
            let (name, colour) = (String::from("a\u{1b}\nb"), Colour::Black);
            let (x, y) = points.first().copied().unwrap_or((nan, inf));
            let panel = Panel {
                layers: vec![
                    Layer::line("l", colour, points.clone()),
                    Layer::points("", colour, Marker::Cross, points.clone()),
                    Layer::Band {
                        lower: points.clone(),
                        upper: vec![(0.0, 1.0)],
                        name: name.clone(),
                        colour,
                    },
                    Layer::Bars { points: points.clone(), width: x, name: name.clone(), colour },
                    Layer::HorizontalLine { y, name: name.clone(), colour, dashed: true },
                    Layer::VerticalLine { x, name: name.clone(), colour, dashed: false },
                    Layer::Span { from: x, to: y, name, colour },
                ],
                x_log: log,
                y_log: log,
                x_range: range,
                y_range: range,
                legend: if log { LegendPosition::Hidden } else { LegendPosition::Above },
                ..Panel::default()
            };
            let mut figure = Figure::stacked("t", vec![panel, Panel::default()]);
            for (columns, width_px) in [(0, 0), (1, 500), (3, 10)] {
                (figure.columns, figure.width_px) = (columns, width_px);
                let svg = figure.to_svg().unwrap();
                assert!(
                    svg.contains("</svg>") && !svg.contains("NaN") && !svg.contains('\u{1b}'),
                    "{points:?}"
                );
            }
        }
    }
}
