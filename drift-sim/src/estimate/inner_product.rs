//! Inner products of the rows of a likelihood: what a search spends its time on beside the filter.

/// Sums that run side by side: additions of one sum wait for each other, those of several don't.
const LANES: usize = 8;

/// The sum of products, over the shorter of the two.
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    let n = a.len().min(b.len());
    let (a, b) = (a.get(..n).unwrap_or(&[]), b.get(..n).unwrap_or(&[]));
    let (a, b) = (a.chunks_exact(LANES), b.chunks_exact(LANES));
    let rest: f64 = a.remainder().iter().zip(b.remainder()).map(|(a, b)| a * b).sum();
    let mut sums = [0.0; LANES];
    for (a, b) in a.zip(b) {
        for (sum, (a, b)) in sums.iter_mut().zip(a.iter().zip(b)) {
            *sum += a * b;
        }
    }
    sums.iter().sum::<f64>() + rest
}

#[cfg(test)]
mod tests {
    use super::dot;

    #[test]
    fn an_inner_product_is_the_sum_of_products_for_every_length() {
        for n in 0..40 {
            let a: Vec<f64> = (0..n).map(|i| i as f64 - 7.0).collect();
            let b: Vec<f64> = (0..n + 3).map(|i| (i * i) as f64).collect();
            let direct: f64 = a.iter().zip(&b).map(|(a, b)| a * b).sum();
            // Whole numbers: any order of summation gives the same.
            assert_eq!(dot(&a, &b), direct, "{n} rows");
        }
    }
}
