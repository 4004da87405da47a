//! Statistics of a study: percentiles, histograms, cumulative shares, rank correlations, as tables.

use crate::analysis::columns::{float, integer, text};
use crate::report::{Column, Table, Values};

/// Percentiles of the table.
const PERCENTILES: [u32; 7] = [1, 5, 25, 50, 75, 95, 99];
/// Bars of a histogram at most.
const MOST_BARS: usize = 40;
/// Points of a cumulative share at most.
const MOST_POINTS: usize = 400;
/// Values that make a distribution.
pub(super) const FEWEST: usize = 8;

/// Finite values of a column of numbers, ascending.
pub(super) fn sorted(column: &Column) -> Vec<f64> {
    let mut list: Vec<f64> = numbers(column)
        .into_iter()
        .filter(|x| x.is_finite())
        .collect();
    list.sort_by(f64::total_cmp);
    list
}

fn numbers(column: &Column) -> Vec<f64> {
    match &column.values {
        Values::Float(list) => list.clone(),
        // Counts: far below 2^53.
        Values::Integer(list) => list.iter().map(|i| *i as f64).collect(),
        Values::Text(_) => Vec::new(),
    }
}

/// Value below which a share of the sorted list lies, with linear interpolation between neighbours.
///
/// ```text
/// x_p = x_k + (h - k) (x_(k+1) - x_k),   h = p (n - 1),   k = floor(h)
/// ```
///
/// `NaN` for an empty list. Hyndman & Fan (1996), type 7.
pub(super) fn quantile(sorted: &[f64], share: f64) -> f64 {
    let Some(last) = sorted.len().checked_sub(1) else {
        return f64::NAN;
    };
    let place = share * last as f64;
    let k = (place as usize).min(last);
    let next = sorted[(k + 1).min(last)];
    sorted[k] + (place - k as f64) * (next - sorted[k])
}

/// One row per quantity: how many values, mean, deviation, extremes, percentiles.
pub(super) fn summary(quantities: &[&Column]) -> Table {
    let lists: Vec<Vec<f64>> = quantities.iter().map(|c| sorted(c)).collect();
    let of = |f: &dyn Fn(&[f64]) -> f64| lists.iter().map(|list| f(list)).collect::<Vec<f64>>();
    let mean = |list: &[f64]| list.iter().sum::<f64>() / list.len() as f64;
    let deviation = |list: &[f64]| {
        let m = mean(list);
        let sum: f64 = list.iter().map(|x| (x - m) * (x - m)).sum();
        (sum / (list.len() as f64 - 1.0)).sqrt()
    };
    let mut columns = vec![
        text(
            "quantity",
            quantities.iter().map(|c| c.name.clone()).collect(),
        ),
        text("unit", quantities.iter().map(|c| c.unit.clone()).collect()),
        integer(
            "count",
            lists.iter().map(|list| list.len() as i64).collect(),
        ),
        float("mean", "", of(&mean)),
        float("deviation", "", of(&deviation)),
        float("least", "", of(&|list| quantile(list, 0.0))),
    ];
    for percent in PERCENTILES {
        let values = of(&|list| quantile(list, f64::from(percent) / 100.0));
        columns.push(float(format!("percentile_{percent}"), "", values));
    }
    columns.push(float("largest", "", of(&|list| quantile(list, 1.0))));
    Table {
        name: "statistics".into(),
        columns,
    }
}

/// Bars of equal width, one row per bar: `quantity, middle, width, count, share`.
pub(super) fn histograms(quantities: &[&Column]) -> Table {
    let (mut names, mut middles, mut widths) = (Vec::new(), Vec::new(), Vec::new());
    let (mut counts, mut shares) = (Vec::new(), Vec::new());
    for column in quantities {
        let list = sorted(column);
        let (Some(low), Some(high)) = (list.first().copied(), list.last().copied()) else {
            continue;
        };
        let are_counts = list.iter().all(|x| x.fract() == 0.0);
        let (low, width, bars) = match (are_counts, high > low) {
            // A bar for every whole number.
            (true, _) if high - low < MOST_BARS as f64 => {
                (low - 0.5, 1.0, (high - low) as usize + 1)
            }
            (_, true) => {
                let bars = bars(&list);
                (low, (high - low) / bars as f64, bars)
            }
            // All values are equal.
            (_, false) => {
                let width = 0.1 * low.abs().max(f64::MIN_POSITIVE);
                (low - 0.5 * width, width, 1)
            }
        };
        let mut own = vec![0_i64; bars];
        for x in &list {
            own[(((x - low) / width) as usize).min(bars - 1)] += 1;
        }
        for (k, count) in own.into_iter().enumerate() {
            names.push(column.name.clone());
            middles.push(low + (k as f64 + 0.5) * width);
            widths.push(width);
            counts.push(count);
            shares.push(count as f64 / list.len() as f64);
        }
    }
    Table {
        name: "histogram".into(),
        columns: vec![
            text("quantity", names),
            float("middle", "", middles),
            float("width", "", widths),
            integer("count", counts),
            float("share", "", shares),
        ],
    }
}

/// Number of bars by the rule of Freedman and Diaconis: width 2 (x_75 - x_25)/n^(1/3).
fn bars(sorted: &[f64]) -> usize {
    let (low, high) = (sorted[0], sorted[sorted.len() - 1]);
    if high <= low {
        return 1;
    }
    let spread = quantile(sorted, 0.75) - quantile(sorted, 0.25);
    let width = 2.0 * spread / (sorted.len() as f64).cbrt();
    let sturges = (sorted.len() as f64).log2().ceil() + 1.0;
    let wanted = if width > 0.0 {
        (high - low) / width
    } else {
        sturges
    };
    (wanted.ceil() as usize).clamp(5, MOST_BARS)
}

/// Share of the runs with at most this value: `quantity, value, share`.
pub(super) fn cumulative(quantities: &[&Column]) -> Table {
    let (mut names, mut values, mut shares) = (Vec::new(), Vec::new(), Vec::new());
    for column in quantities {
        let list = sorted(column);
        let stride = list.len().div_ceil(MOST_POINTS).max(1);
        for (k, x) in list.iter().enumerate() {
            if k % stride == 0 || k + 1 == list.len() {
                names.push(column.name.clone());
                values.push(*x);
                shares.push((k + 1) as f64 / list.len() as f64);
            }
        }
    }
    Table {
        name: "cumulative".into(),
        columns: vec![
            text("quantity", names),
            float("value", "", values),
            float("share", "", shares),
        ],
    }
}

/// Rank correlations of quantities with parameters, the strongest first: `quantity, parameter, rank_correlation, runs`.
pub(super) fn correlations(quantities: &[&Column], parameters: &[&Column]) -> Table {
    let (mut names, mut of, mut values, mut runs) =
        (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for quantity in quantities {
        let mut list: Vec<(&str, f64, usize)> = parameters
            .iter()
            .map(|parameter| {
                let (rho, count) = spearman(&numbers(parameter), &numbers(quantity));
                (parameter.name.as_str(), rho, count)
            })
            .filter(|(_, rho, _)| rho.is_finite())
            .collect();
        list.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()));
        for (parameter, rho, count) in list {
            names.push(quantity.name.clone());
            of.push(parameter.to_owned());
            values.push(rho);
            runs.push(count as i64);
        }
    }
    Table {
        name: "correlations".into(),
        columns: vec![
            text("quantity", names),
            text("parameter", of),
            float("rank_correlation", "", values),
            integer("runs", runs),
        ],
    }
}

/// Spearman's rank correlation of the pairs that are finite, and how many there are: Pearson's of the ranks, equal values sharing
/// the mean of theirs. NaN where one of the two does not vary.
fn spearman(x: &[f64], y: &[f64]) -> (f64, usize) {
    let pairs: Vec<(f64, f64)> = (x.iter().copied().zip(y.iter().copied()))
        .filter(|(a, b)| a.is_finite() && b.is_finite())
        .collect();
    let ranked = |of: fn(&(f64, f64)) -> f64| ranks(&pairs.iter().map(of).collect::<Vec<f64>>());
    let (a, b) = (ranked(|p| p.0), ranked(|p| p.1));
    let mean = (pairs.len() as f64 + 1.0) / 2.0;
    let product = |u: &[f64], v: &[f64]| -> f64 {
        u.iter().zip(v).map(|(p, q)| (p - mean) * (q - mean)).sum()
    };
    let rho = product(&a, &b) / (product(&a, &a) * product(&b, &b)).sqrt();
    (rho, pairs.len())
}

/// Ranks from 1; equal values share the mean of theirs.
fn ranks(values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|a, b| values[*a].total_cmp(&values[*b]));
    let mut ranks = vec![0.0; values.len()];
    let mut first = 0;
    while first < order.len() {
        let same = |k: &usize| values[order[*k]] == values[order[first]];
        let last = (first..order.len())
            .take_while(same)
            .last()
            .unwrap_or(first);
        for k in first..=last {
            ranks[order[k]] = (first + last) as f64 / 2.0 + 1.0;
        }
        first = last + 1;
    }
    ranks
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_as_numpy_has_them() {
        // numpy.quantile([1, 2, 4, 8], [0, .05, .5, .75, 1])
        let list = [1.0, 2.0, 4.0, 8.0];
        let found = [0.0, 0.05, 0.5, 0.75, 1.0].map(|p| quantile(&list, p));
        for (x, wanted) in found.iter().zip([1.0, 1.15, 3.0, 5.0, 8.0]) {
            assert!((x - wanted).abs() < 1e-14, "{found:?}");
        }
        assert!(quantile(&[], 0.5).is_nan());
    }

    #[test]
    fn rank_correlation_as_scipy_has_it() {
        // scipy.stats.spearmanr([1, 2, 3, 4, 5], [5, 6, 7, 8, 7]).statistic
        let (rho, count) = spearman(&[1.0, 2.0, 3.0, 4.0, 5.0], &[5.0, 6.0, 7.0, 8.0, 7.0]);
        assert!((rho - 0.820_782_681_668_123_3).abs() < 1e-14, "{rho}");
        assert_eq!(count, 5);
        assert!(spearman(&[1.0, 2.0], &[3.0, 3.0]).0.is_nan());
        let (rho, count) = spearman(&[1.0, f64::NAN, 3.0], &[9.0, 1.0, 4.0]);
        assert_eq!((rho, count), (-1.0, 2));
    }

    #[test]
    fn bars_hold_every_value() {
        let values: Vec<f64> = (0..1000).map(|k| (f64::from(k) * 0.37).sin()).collect();
        let column = float("q", "", values);
        let table = histograms(&[&column]);
        let Values::Integer(counts) = &table.columns[3].values else {
            panic!()
        };
        assert_eq!(counts.iter().sum::<i64>(), 1000);
        assert!(counts.len() <= MOST_BARS && counts.iter().all(|c| *c > 0));
        for value in [2.0, 2.5] {
            let flat = float("q", "", vec![value; 9]);
            assert_eq!(histograms(&[&flat]).rows(), 1);
        }
        let impacts = float("q", "", vec![3.0, 3.0, 5.0, 3.0]);
        let table = histograms(&[&impacts]);
        let column = |k: usize| match &table.columns[k].values {
            Values::Float(list) => list.clone(),
            Values::Integer(list) => list.iter().map(|k| *k as f64).collect(),
            Values::Text(_) => panic!(),
        };
        assert_eq!(column(1), [3.0, 4.0, 5.0]);
        assert_eq!(column(3), [3.0, 0.0, 1.0]);
    }
}
