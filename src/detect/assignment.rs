//! Assignment of rows to columns at least cost, where a row may also go without.
//!
//! Own rather than a crate's: costs are f64, pairs can be forbidden, and a row that no column suits
//! takes its own price for going without. The matrices are small (tracks × plots of one scan).

/// The column of each row, None for a row that goes without, such that the sum of costs is least.
/// `cost`: row-major, `miss.len()` rows of `columns`; an infinite or NaN cost forbids the pair.
/// `miss`: finite price of going without, one for each row. Panics when the lengths do not fit.
///
/// Shortest augmenting paths with potentials (Kuhn; Jonker and Volgenant, *Computing* 38 (1987)
/// 325), O(rows² (rows + columns)). Equal sums are broken by order, so that the result repeats.
///
/// # Example
/// Taking the smallest cost first would give row 0 column 0 and leave row 1 with 10 or its price of 5. The smallest
/// sum is 2 + 1.5.
///
/// ```
/// use catseye::detect::assignment::assign;
///
/// let cost = [1.0, 2.0, 1.5, 10.0];
/// assert_eq!(assign(&cost, 2, &[5.0, 5.0]), [Some(1), Some(0)]);
/// // A pair that is forbidden, and a row for which going without costs less.
/// assert_eq!(assign(&[f64::INFINITY, 2.0, 1.5, 10.0], 2, &[5.0, 1.0]), [Some(1), None]);
/// ```
pub fn assign(cost: &[f64], columns: usize, miss: &[f64]) -> Vec<Option<usize>> {
    let rows = miss.len();
    assert_eq!(cost.len(), rows * columns, "a cost for each pair");
    assert!(miss.iter().all(|m| m.is_finite()), "the price of going without is finite");
    // Column columns + i stands for row i going without.
    let at = |i: usize, j: usize| match j.checked_sub(columns) {
        None => cost[i * columns + j],
        Some(own) if own == i => miss[i],
        Some(_) => f64::INFINITY,
    };
    let width = columns + rows;
    let (mut row_price, mut column_price) = (vec![0.0; rows], vec![0.0; width]);
    let mut holder: Vec<Option<usize>> = vec![None; width];
    let mut came_from: Vec<Option<usize>> = vec![None; width];
    for start in 0..rows {
        let mut distance = vec![f64::INFINITY; width];
        let mut reached = vec![false; width];
        let (mut row, mut last) = (start, None);
        let free = loop {
            let (mut step, mut next) = (f64::INFINITY, None);
            for j in 0..width {
                if reached[j] {
                    continue;
                }
                let reduced = at(row, j) - row_price[row] - column_price[j];
                if reduced < distance[j] {
                    distance[j] = reduced;
                    came_from[j] = last;
                }
                if distance[j] < step {
                    (step, next) = (distance[j], Some(j));
                }
            }
            // Some column is always in reach: the row's own.
            let Some(j) = next else { unreachable!("every row may go without") };
            row_price[start] += step;
            for k in 0..width {
                if !reached[k] {
                    distance[k] -= step;
                } else {
                    column_price[k] -= step;
                    if let Some(i) = holder[k] {
                        row_price[i] += step;
                    }
                }
            }
            reached[j] = true;
            last = Some(j);
            match holder[j] {
                Some(i) => row = i,
                None => break j,
            }
        };
        let mut j = free;
        while let Some(before) = came_from[j] {
            holder[j] = holder[before];
            j = before;
        }
        holder[j] = Some(start);
    }
    let mut out = vec![None; rows];
    for (j, i) in holder.iter().take(columns).enumerate() {
        if let Some(i) = i {
            out[*i] = Some(j);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn total(cost: &[f64], columns: usize, miss: &[f64], choice: &[Option<usize>]) -> f64 {
        choice.iter().enumerate().map(|(i, j)| j.map_or(miss[i], |j| cost[i * columns + j])).sum()
    }

    /// Least sum over every way to choose.
    fn least(cost: &[f64], columns: usize, miss: &[f64], row: usize, taken: u32) -> f64 {
        if row == miss.len() {
            return 0.0;
        }
        (0..columns)
            .filter(|j| taken & (1 << j) == 0)
            .map(|j| cost[row * columns + j] + least(cost, columns, miss, row + 1, taken | (1 << j)))
            .chain([miss[row] + least(cost, columns, miss, row + 1, taken)])
            .fold(f64::INFINITY, f64::min)
    }

    #[test]
    fn by_hand() {
        // Greedy would take (0, 0) and leave row 1 with 9.
        assert_eq!(assign(&[1.0, 2.0, 2.0, 9.0], 2, &[100.0; 2]), [Some(1), Some(0)]);
        let never = f64::INFINITY;
        assert_eq!(assign(&[never, 3.0, never, 2.0], 2, &[5.0; 2]), [None, Some(1)]);
        assert_eq!(assign(&[f64::NAN], 1, &[5.0]), [None]);
        assert_eq!(assign(&[], 0, &[1.0, 1.0]), [None, None]);
        assert_eq!(assign(&[], 3, &[]), []);
    }

    proptest! {
        #[test]
        fn least_of_all(
            rows in 0usize..6,
            columns in 0usize..6,
            seed in proptest::collection::vec(-10.0..10.0f64, 42),
            forbidden in proptest::collection::vec(prop::bool::weighted(0.3), 36),
        ) {
            let cost: Vec<f64> = (0..rows * columns)
                .map(|k| if forbidden[k] { f64::INFINITY } else { seed[k] })
                .collect();
            let miss = &seed[36..36 + rows];
            let choice = assign(&cost, columns, miss);
            let mut used: Vec<usize> = choice.iter().flatten().copied().collect();
            used.sort_unstable();
            used.dedup();
            prop_assert_eq!(used.len(), choice.iter().flatten().count());
            let best = least(&cost, columns, miss, 0, 0);
            prop_assert!((total(&cost, columns, miss, &choice) - best).abs() < 1e-9);
        }
    }
}
