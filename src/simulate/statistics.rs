//! Mean, deviation and confidence interval of a sample.
//!
//! The interval is two-sided, at 95 percent, by Student's distribution \[1\].
//!
//! - \[1\] Student: The probable error of a mean, Biometrika 6, 1908.

/// Statistics of a sample of values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Number of values.
    pub count: usize,
    /// Mean of the values.
    pub mean: f64,
    /// Standard deviation, with the number of values minus one as denominator; 0 for fewer than two
    /// values.
    pub deviation: f64,
    /// Half the width of the 95 percent confidence interval of the mean; 0 for fewer than two
    /// values.
    pub half_width: f64,
}

/// The 97.5 percent quantiles of Student's distribution for 1 to 30 degrees of freedom.
const QUANTILES: [f64; 30] = [
    12.706_205, 4.302_653, 3.182_446, 2.776_445, 2.570_582, 2.446_912, 2.364_624, 2.306_004, 2.262_157,
    2.228_139, 2.200_985, 2.178_813, 2.160_369, 2.144_787, 2.131_450, 2.119_905, 2.109_816, 2.100_922,
    2.093_024, 2.085_963, 2.079_614, 2.073_873, 2.068_658, 2.063_899, 2.059_539, 2.055_529, 2.051_831,
    2.048_407, 2.045_230, 2.042_272,
];

impl Sample {
    /// Computes the statistics of values. Returns `None` if there are no values.
    pub fn of(values: &[f64]) -> Option<Self> {
        let count = values.len();
        if count == 0 {
            return None;
        }
        let mean = values.iter().sum::<f64>() / count as f64;
        if count == 1 {
            return Some(Self { count, mean, deviation: 0.0, half_width: 0.0 });
        }
        let freedom = count - 1;
        let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
        let deviation = (squares / freedom as f64).sqrt();
        // Above 30 degrees of freedom, the Cornish-Fisher expansion to its third term is accurate.
        let (z, n) = (1.959_964_f64, freedom as f64);
        let quantile = QUANTILES.get(freedom - 1).copied().unwrap_or_else(|| {
            let second = (z.powi(3) + z) / (4.0 * n);
            let third = (5.0 * z.powi(5) + 16.0 * z.powi(3) + 3.0 * z) / (96.0 * n * n);
            z + second + third
        });
        Some(Self { count, mean, deviation, half_width: quantile * deviation / (count as f64).sqrt() })
    }
}

#[cfg(test)]
mod tests {
    use super::Sample;

    fn check(values: &[f64], mean: f64, deviation: f64, half_width: f64) {
        let sample = Sample::of(values).expect("values");
        let close = |left: f64, right: f64| (left - right).abs() < 1e-3;
        assert!(close(sample.mean, mean) && close(sample.deviation, deviation), "{sample:?}");
        assert!(close(sample.half_width, half_width), "{sample:?}");
    }

    #[test]
    fn statistics_match_manual_results() {
        check(&[5.0], 5.0, 0.0, 0.0);
        check(&[1.0, 3.0], 2.0, 1.414, 12.706_205);
        check(&[2.0, 4.0, 4.0, 4.0, 5.0, 5.0, 7.0, 9.0], 5.0, 2.138, 1.788);
        assert_eq!(Sample::of(&[]), None);
        // Published tables often have three decimals: a half-width above 4 then differs in the fourth.
        let six = [478.0, 479.0, 480.0, 580.0, 480.0, 480.0];
        let half_width = Sample::of(&six).expect("values").half_width;
        assert!((half_width - 43.1083).abs() < 1e-4, "{half_width}");
        // 41 values, 40 degrees of freedom: 2.021.
        let values: Vec<f64> = (0..41).map(f64::from).collect();
        check(&values, 20.0, 11.979, 3.781);
    }
}
