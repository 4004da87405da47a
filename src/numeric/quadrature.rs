//! Gauss' rule on the unit interval.

/// Nodes and weights of Gauss' rule with 12 points on [-1, 1], positive half: exact to degree 23.
const GAUSS: [(f64, f64); 6] = [
    (0.125_233_408_511_468_9, 0.249_147_045_813_402_8),
    (0.367_831_498_998_180_2, 0.233_492_536_538_354_8),
    (0.587_317_954_286_617_5, 0.203_167_426_723_065_9),
    (0.769_902_674_194_304_7, 0.160_078_328_543_346_2),
    (0.904_117_256_370_474_9, 0.106_939_325_995_318_4),
    (0.981_560_634_246_719_2, 0.047_175_336_386_511_8),
];

/// The 12 nodes on [0, 1] with their weights, which sum to 1: exact to degree 23.
pub fn unit_nodes() -> impl Iterator<Item = (f64, f64)> {
    let pair = |(x, w): &(f64, f64)| [(0.5 - 0.5 * x, 0.5 * w), (0.5 + 0.5 * x, 0.5 * w)];
    GAUSS.iter().flat_map(pair)
}

#[cfg(test)]
mod tests {
    use super::unit_nodes;

    #[test]
    fn powers_are_integrated_exactly() {
        for degree in 0..=23 {
            let sum: f64 = unit_nodes().map(|(x, w)| w * x.powi(degree)).sum();
            let exact = 1.0 / f64::from(degree + 1);
            assert!((sum - exact).abs() < 1e-15, "degree {degree}");
        }
    }
}
