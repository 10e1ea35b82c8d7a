//! Integrals of smooth functions by Gauss-Legendre rules, halved until they agree.

/// Nodes and weights of the ten-point rule on [-1, 1], one half; the other mirrors it.
const GAUSS: [(f64, f64); 5] = [
    (0.148_874_338_981_631_22, 0.295_524_224_714_752_87),
    (0.433_395_394_129_247_2, 0.269_266_719_309_996_35),
    (0.679_409_568_299_024_4, 0.219_086_362_515_982_04),
    (0.865_063_366_688_984_5, 0.149_451_349_150_580_6),
    (0.973_906_528_517_171_7, 0.066_671_344_308_688_14),
];

/// Times that an interval is halved at most.
const HALVINGS: u32 = 9;
/// Relative difference that is rounding.
const ROUNDING: f64 = 1e-14;

/// Integral of `f`, which is not negative, from `a` to `b`: an interval is halved until the rule over it agrees with the
/// rule over its halves to `tolerance`, or to rounding.
pub fn integral(f: &dyn Fn(f64) -> f64, a: f64, b: f64, tolerance: f64) -> f64 {
    let once = rule(f, a, b);
    halved(f, a, b, once, tolerance, HALVINGS)
}

fn rule(f: &dyn Fn(f64) -> f64, a: f64, b: f64) -> f64 {
    let (m, r) = ((a + b) / 2.0, (b - a) / 2.0);
    GAUSS.iter().map(|(x, w)| w * (f(m - r * x) + f(m + r * x))).sum::<f64>() * r
}

fn halved(f: &dyn Fn(f64) -> f64, a: f64, b: f64, once: f64, tolerance: f64, depth: u32) -> f64 {
    let m = (a + b) / 2.0;
    let (left, right) = (rule(f, a, m), rule(f, m, b));
    let difference = (left + right - once).abs();
    if depth == 0 || difference <= tolerance.max(ROUNDING * (left + right)) {
        return left + right;
    }
    halved(f, a, m, left, tolerance, depth - 1) + halved(f, m, b, right, tolerance, depth - 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_integrals_come_out() {
        assert!((integral(&|x| x.exp(), 0.0, 1.0, 1e-15) - (1f64.exp() - 1.0)).abs() < 1e-14);
        // A root as those at the ends of scan lines.
        assert!((integral(&|x| x.powi(2) * x.sqrt(), 0.0, 1.0, 1e-15) - 2.0 / 7.0).abs() < 1e-14);
    }
}
