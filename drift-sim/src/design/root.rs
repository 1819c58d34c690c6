//! The root of a monotone function in a bracket: Chandrupatla's method, bisection's safety at a secant's speed.
//!
//! Source: T. R. Chandrupatla, Advances in Engineering Software 28 (1997) 145-149.

/// Where `f` changes sign between `a` and `b`, to the last digits; the end where `f` is nearer to zero if it has the
/// same sign at both.
pub(crate) fn bracketed(f: impl Fn(f64) -> f64, a: f64, b: f64) -> f64 {
    bracketed_to(f, a, b, 2.0 * f64::EPSILON)
}

/// The same, to a fraction `tolerance` of the root's size.
pub(crate) fn bracketed_to(f: impl Fn(f64) -> f64, a: f64, b: f64, tolerance: f64) -> f64 {
    let (mut a, mut b) = (a, b);
    let (mut fa, mut fb) = (f(a), f(b));
    if fa == 0.0 || fb == 0.0 || (fa > 0.0) == (fb > 0.0) {
        return if fa.abs() < fb.abs() { a } else { b };
    }
    let mut fraction = 0.5;
    for _ in 0..200 {
        let x = a + fraction * (b - a);
        let fx = f(x);
        // (b, c) is the pair that the new point replaces an end of; a is always the newest.
        let (c, fc);
        if (fx > 0.0) == (fa > 0.0) {
            (c, fc) = (a, fa);
        } else {
            (c, fc) = (b, fb);
            (b, fb) = (a, fa);
        }
        (a, fa) = (x, fx);
        let best = if fa.abs() < fb.abs() { a } else { b };
        let smallest_step = (tolerance * best.abs() + 1e-300) / (b - a).abs();
        if smallest_step > 0.5 || fx == 0.0 || !fx.is_finite() {
            return best;
        }
        fraction = inverse_quadratic((a, fa), (b, fb), (c, fc)).clamp(smallest_step, 1.0 - smallest_step);
    }
    a
}

/// The fraction of the way from a to b by inverse quadratic interpolation, or half where that isn't safe.
fn inverse_quadratic((a, fa): (f64, f64), (b, fb): (f64, f64), (c, fc): (f64, f64)) -> f64 {
    let xi = (a - b) / (c - b);
    let phi = (fa - fb) / (fc - fb);
    if phi * phi < xi && (1.0 - phi) * (1.0 - phi) < 1.0 - xi {
        fa / (fb - fa) * fc / (fb - fc) + (c - a) / (b - a) * fa / (fc - fa) * fb / (fc - fb)
    } else {
        0.5
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_a_root_to_full_precision_in_few_calls() {
        let calls = std::cell::Cell::new(0);
        let root = bracketed(
            |x| {
                calls.set(calls.get() + 1);
                x.exp() - 5.0
            },
            0.0,
            10.0,
        );
        assert!((root - 5f64.ln()).abs() < 1e-14, "{root}");
        assert!(calls.get() < 20, "{} calls", calls.get());
    }
}
