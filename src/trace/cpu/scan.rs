//! Exclusive prefix sums.

/// The sums before each value, and the total.
pub fn exclusive(values: &[u32]) -> (Vec<u32>, u32) {
    let mut sum = 0;
    let before = values
        .iter()
        .map(|v| {
            let at = sum;
            sum += v;
            at
        })
        .collect();
    (before, sum)
}
