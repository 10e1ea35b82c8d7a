//! Colour spaces of FLIP, for light from D65 (Andersson 2020, section 4.1 and 4.2).

use glam::{DMat3, DVec3};

/// Chromaticities of the sRGB primaries (IEC 61966-2-1).
const PRIMARIES: [[f64; 2]; 3] = [[0.64, 0.33], [0.30, 0.60], [0.15, 0.06]];
/// Chromaticity of D65 with five digits, as published implementations of FLIP have it; sRGB itself has four.
const WHITE: [f64; 2] = [0.31271, 0.32902];

/// Linear sRGB to and from YCxCz, and to CIELab with Hunt's adjustment.
pub struct ColorSpaces {
    to_xyz: DMat3,
    from_xyz: DMat3,
    white: DVec3,
}

impl ColorSpaces {
    /// For sRGB primaries and a D65 white.
    pub fn new() -> Self {
        let primaries = DMat3::from_cols_array_2d(&PRIMARIES.map(|p| xyz_of(p).to_array()));
        let white = xyz_of(WHITE);
        let to_xyz = primaries * DMat3::from_diagonal(primaries.inverse() * white);
        Self { to_xyz, from_xyz: to_xyz.inverse(), white }
    }

    /// YCxCz of linear RGB: opponent colours that are linear in radiance. Y of white is 100, of black -16.
    pub fn ycxcz(&self, rgb: DVec3) -> DVec3 {
        let n = self.to_xyz * rgb / self.white;
        DVec3::new(116.0 * n.y - 16.0, 500.0 * (n.x - n.y), 200.0 * (n.y - n.z))
    }

    /// Linear RGB of YCxCz.
    pub fn rgb(&self, ycxcz: DVec3) -> DVec3 {
        let y = (ycxcz.x + 16.0) / 116.0;
        let n = DVec3::new(y + ycxcz.y / 500.0, y, y - ycxcz.z / 200.0);
        self.from_xyz * (n * self.white)
    }

    /// CIELab of linear RGB in [0, 1], with both chromatic axes times `0.01 L*`: dark colours look less colourful
    /// (Hunt 1952).
    pub fn hunt_lab(&self, rgb: DVec3) -> DVec3 {
        let n = self.to_xyz * rgb / self.white;
        let (x, y, z) = (lightness(n.x), lightness(n.y), lightness(n.z));
        let l = 116.0 * y - 16.0;
        DVec3::new(l, 0.01 * l * 500.0 * (x - y), 0.01 * l * 200.0 * (y - z))
    }
}

/// HyAB distance of two colours in a space like CIELab: city block in lightness, Euclidean in the other two
/// (Abasi 2020).
pub fn hyab(a: DVec3, b: DVec3) -> f64 {
    let d = a - b;
    d.x.abs() + (d.y * d.y + d.z * d.z).sqrt()
}

/// Tristimulus values of a chromaticity at `Y = 1`.
fn xyz_of([x, y]: [f64; 2]) -> DVec3 {
    DVec3::new(x / y, 1.0, (1.0 - x - y) / y)
}

/// The function of CIELab: a cube root with a straight start.
fn lightness(t: f64) -> f64 {
    const DELTA: f64 = 6.0 / 29.0;
    if t > DELTA * DELTA * DELTA { libm::cbrt(t) } else { t / (3.0 * DELTA * DELTA) + 4.0 / 29.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn white_and_black_have_their_values() {
        let c = ColorSpaces::new();
        assert!((c.ycxcz(DVec3::ONE) - DVec3::new(100.0, 0.0, 0.0)).length() < 1e-9);
        assert!((c.ycxcz(DVec3::ZERO) - DVec3::new(-16.0, 0.0, 0.0)).length() < 1e-9);
        assert!((c.hunt_lab(DVec3::ONE) - DVec3::new(100.0, 0.0, 0.0)).length() < 1e-9);
        assert!(c.hunt_lab(DVec3::ZERO).length() < 1e-9);
        // Y of the primaries are the luminance weights of sRGB, to the digits of the white.
        assert!((c.to_xyz.row(1) - DVec3::new(0.2126, 0.7152, 0.0722)).length() < 1e-4);
    }

    #[test]
    fn ycxcz_comes_back() {
        let c = ColorSpaces::new();
        for rgb in [DVec3::new(0.1, 0.7, 0.3), DVec3::X, DVec3::new(0.9, 0.0, 1.0)] {
            assert!((c.rgb(c.ycxcz(rgb)) - rgb).length() < 1e-12);
        }
    }

    #[test]
    fn distance_adds_lightness_to_the_chromatic_part() {
        assert_eq!(hyab(DVec3::new(10.0, 3.0, 0.0), DVec3::new(8.0, 0.0, 4.0)), 7.0);
    }
}
