//! The best points of many, none of them near another: neighbours of one peak are not to crowd out the others.

/// At most so many of these, which come the best first.
pub fn apart<T>(best_first: Vec<T>, most: usize, is_near: impl Fn(&T, &T) -> bool) -> Vec<T> {
    let mut kept: Vec<T> = Vec::new();
    for next in best_first {
        if kept.len() == most {
            break;
        }
        if !kept.iter().any(|of| is_near(of, &next)) {
            kept.push(next);
        }
    }
    kept
}
