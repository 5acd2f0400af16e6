//! The lobes of a texel: what its base reflectance becomes under the distribution of its normals (Xu et al. 2017, section 3.1,
//! "Handling normal maps"; Han et al. 2007, "Frequency domain normal map filtering", section 4).

use crate::distribution::literal;
use crate::distribution::vmf::{self, LEAST_SPREAD, Lobe};
use crate::reflectance::Model;
use glam::{DMat3, DVec3};

/// How a base lobe and the distribution of normals make one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Rule {
    /// By mean vectors, which convolution multiplies: exact for these.
    #[default]
    Exact,
    /// As printed: equations 13 and 14, which are for small angles, and 8 and 9 between lengths and concentrations.
    Literal,
    /// The same, with lengths from the paper's table (section 4, [`literal::SpreadTable`]) in the place of the root of equation 9.
    Tabulated,
}

impl Rule {
    /// Its name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Exact => "exact",
            Self::Literal => "literal",
            Self::Tabulated => "tabulated",
        }
    }

    /// Whether it is the paper's, whichever way lengths are found.
    pub fn is_literal(self) -> bool {
        self != Self::Exact
    }
}

/// The lobes of half vectors of a reflectance about its normal, of weights that sum to 1, with `roughness` in the place of the
/// model's own alpha, exponent or concentration. GGX counts as the lobe of the same height, of concentration 2 / alpha^2, as
/// roughness maps do. One with GGX's mean vector ([`ggx_mean_cosine`]), which its long tails shorten, is further from it below an
/// alpha of 0.36 (by a relative difference in L2 of 0.71 for 0.30 at 0.1) and nearer above (0.17 for 0.51 at 0.6). `None` for
/// tables, whose lobes would have to be fitted.
pub fn base(model: &Model, roughness: Option<f64>, rule: Rule) -> Option<Vec<Lobe>> {
    let about_normal = |kappa| vec![Lobe { mu: DVec3::Z, kappa, weight: 1.0 }];
    match model {
        Model::Ggx(ggx) => Some(about_normal(2.0 / roughness.unwrap_or(ggx.alpha).powi(2))),
        Model::BlinnPhong(blinn_phong) => {
            let exponent = roughness.unwrap_or(blinn_phong.exponent);
            Some(about_normal(match rule {
                // The mean cosine of cos^e is (e + 1) / (e + 2).
                Rule::Exact => vmf::concentration(1.0 / (exponent + 2.0)),
                Rule::Literal | Rule::Tabulated => exponent + 1.0,
            }))
        }
        Model::Vmf(vmf) => {
            let total: f64 = vmf.lobes().iter().map(|l| l.weight).sum();
            let lobe = |l: &Lobe| Lobe { kappa: roughness.unwrap_or(l.kappa), weight: l.weight / total, ..*l };
            Some(vmf.lobes().iter().map(lobe).collect())
        }
        Model::Table(_) | Model::Turned(_) => None,
    }
}

/// `base` under normals whose mean, of length at most 1, is `normal`.
///
/// The frame of each normal is the surface's own turned by the least rotation, or for the mean normal, by Gram and Schmidt from
/// the tangent, as a mapped normal's is. Averaged over normals about their mean, this shortens the part of a lobe's mean vector
/// along the mean normal to `l = |normal|`, and the part across it to `(1 + l) / 2`.
pub fn lobes(base: &[Lobe], normal: DVec3, rule: Rule) -> Vec<Lobe> {
    let length = normal.length().min(1.0);
    let frame = about(normal);
    let lobe = |lobe: &Lobe| match rule {
        Rule::Exact => {
            let across = 0.5 * (1.0 + length);
            let kept = lobe.mu * DVec3::new(across, across, length);
            let share = kept.length();
            // 1 - share r, from the two spreads, of which neither cancels.
            let spread = (1.0 - share) + share * vmf::spread(lobe.kappa);
            Lobe { mu: (frame * kept).try_normalize().unwrap_or(DVec3::Z), kappa: vmf::concentration(spread), ..*lobe }
        }
        Rule::Literal | Rule::Tabulated => {
            let spread = 1.0 - length;
            let normals = if spread < LEAST_SPREAD { f64::INFINITY } else { literal::concentration(spread) };
            let kappa = literal::effective(normals, (lobe.kappa - 1.0).max(0.0));
            Lobe { mu: frame * lobe.mu, kappa, ..*lobe }
        }
    };
    base.iter().map(lobe).collect()
}

/// The frame about a normal of any length: x along the surface's tangent, as far as it is perpendicular to the normal.
pub(crate) fn about(normal: DVec3) -> DMat3 {
    let z = normal.try_normalize().unwrap_or(DVec3::Z);
    let x = (DVec3::X - z * z.x).try_normalize().unwrap_or(DVec3::NEG_Z);
    DMat3::from_cols(x, z.cross(x), z)
}

/// The mean cosine of GGX's normals over solid angle, `1 / (1 + a^2 artanh(c) / c)` with `c = sqrt(1 - a^2)`: the integral of D
/// cos, which is 1, over that of D.
pub fn ggx_mean_cosine(alpha: f64) -> f64 {
    let square = alpha * alpha;
    let c = (1.0 - square).max(0.0).sqrt();
    let ratio = if c < 1e-4 { 1.0 } else { c.atanh() / c };
    1.0 / (1.0 + square * ratio)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reflectance::{BlinnPhong, Ggx, Vmf, ggx};
    use std::f64::consts::TAU;
    use std::sync::Arc;

    /// The mean over `normals` drawn about z of what `of` says.
    fn mean_over(normals: Lobe, of: impl Fn(DVec3) -> DVec3) -> DVec3 {
        let side = 300;
        let unit = |i: i32| (f64::from(i) + 0.5) / f64::from(side);
        (0..side * side).map(|i| of(normals.sample([unit(i % side), unit(i / side)]))).sum::<DVec3>() / f64::from(side * side)
    }

    /// `v` turned by the least rotation that takes z to `n`.
    fn turned(n: DVec3, v: DVec3) -> DVec3 {
        glam::DQuat::from_rotation_arc(DVec3::Z, n) * v
    }

    #[test]
    fn mean_vectors_are_those_of_the_convolution() {
        for kappa_n in [2.0, 10.0, 200.0] {
            let normals = Lobe { mu: DVec3::Z, kappa: kappa_n, weight: 1.0 };
            for mu in [DVec3::Z, DVec3::new(0.7, 0.0, 0.714_142_84), DVec3::new(0.3, -0.5, 0.2).normalize()] {
                let lobe = Lobe { mu, kappa: 20.0, weight: 1.0 };
                let expected = mean_over(normals, |n| turned(n, lobe.mean()));
                let found = lobes(&[lobe], normals.mean(), Rule::Exact)[0].mean();
                assert!((found - expected).length() < 5e-4, "{kappa_n} {mu}: {found} for {expected}");
            }
            // Blinn-Phong: the product of (e + 1) / (e + 2) and the normals' own, which the printed rule misses.
            let model = Model::BlinnPhong(BlinnPhong { exponent: 20.0, specular: DVec3::ONE, albedo: DVec3::ZERO });
            let product = vmf::mean_cosine(kappa_n) * 21.0 / 22.0;
            let by = |rule| lobes(&base(&model, None, rule).unwrap(), normals.mean(), rule)[0].mean().z;
            assert!((by(Rule::Exact) - product).abs() < 1e-9);
            let off = by(Rule::Literal) - product;
            println!("kappa {kappa_n}: product {product:.4}, printed {off:+.4}");
            // Angles are small where normals are concentrated.
            assert_eq!(off.abs() < 0.003, kappa_n > 100.0, "{off}");
        }
    }

    #[test]
    fn one_normal_turns_lobes_and_keeps_them() {
        let all =
            [Lobe { mu: DVec3::new(0.6, 0.0, 0.8), kappa: 128.0, weight: 0.3 }, Lobe { mu: DVec3::Z, kappa: 4.0, weight: 0.9 }];
        let model = Model::Vmf(Arc::new(Vmf::new(&all).unwrap()));
        let tilted = DVec3::new(0.2, -0.3, 0.9).normalize();
        let base_lobes = base(&model, None, Rule::Exact).unwrap();
        assert!((base_lobes.iter().map(|l| l.weight).sum::<f64>() - 1.0).abs() < 1e-15);
        for rule in [Rule::Exact, Rule::Literal] {
            for (found, lobe) in lobes(&base_lobes, tilted, rule).iter().zip(&base_lobes) {
                assert!((found.kappa / lobe.kappa - 1.0).abs() < 1e-7 && found.weight == lobe.weight && found.mu.is_normalized());
                assert!((found.mu.dot(tilted) - lobe.mu.z).abs() < 1e-12);
            }
        }
        // The tangent stays as near to x as it can, and handedness is kept.
        assert!((lobes(&base_lobes, DVec3::Z, Rule::Exact)[0].mu - all[0].mu).length() < 1e-12);
        assert!((about(tilted).determinant() - 1.0).abs() < 1e-12 && about(tilted).x_axis.y.abs() < 0.1);
        // A map's roughness takes the place of all concentrations; no normals at all have no direction.
        assert!(base(&model, Some(7.0), Rule::Exact).unwrap().iter().all(|l| l.kappa == 7.0));
        let none = lobes(&[Lobe { mu: DVec3::Z, kappa: 9.0, weight: 1.0 }], DVec3::ZERO, Rule::Exact)[0];
        assert!(none.kappa < 1e-9 && none.mu == DVec3::Z);
    }

    #[test]
    fn a_sharp_ggx_is_nearest_to_the_lobe_of_its_height() {
        for alpha in [0.03, 0.1, 0.3, 0.35, 0.4, 0.6, 1.0] {
            // Over z^2, so that sharp lobes are resolved: d omega = 2 pi dz.
            let steps = 400_000;
            let at = |i: i32| {
                let t = (f64::from(i) + 0.5) / f64::from(steps);
                let z = 1.0 - t * t * t;
                (DVec3::new((1.0 - z * z).sqrt(), 0.0, z), TAU * 3.0 * t * t / f64::from(steps))
            };
            let integral = |f: &dyn Fn(DVec3) -> f64| (0..steps).map(at).map(|(h, d)| f(h) * d).sum::<f64>();
            let ggx = |h| ggx::distribution(alpha, h);
            let (area, normals) = (integral(&|h| ggx(h) * h.z), integral(&ggx));
            assert!((area - 1.0).abs() < 1e-6 && (area / normals / ggx_mean_cosine(alpha) - 1.0).abs() < 1e-6, "{alpha}");
            let error = |kappa| {
                let lobe = Lobe { mu: DVec3::Z, kappa, weight: 1.0 };
                let [off, all] = [integral(&|h| (lobe.density(h) - ggx(h) / normals).powi(2)), integral(&|h| ggx(h).powi(2))];
                (off / all).sqrt() * normals
            };
            let model = Model::Ggx(Ggx { alpha, f0: DVec3::ONE, albedo: DVec3::ZERO });
            let height = error(base(&model, None, Rule::Exact).unwrap()[0].kappa);
            let mean = error(vmf::concentration(1.0 - ggx_mean_cosine(alpha)));
            println!("alpha {alpha}: relative L2 {height:.3} by height, {mean:.3} by mean vector");
            assert_eq!(height < mean, alpha < 0.36, "{alpha}");
        }
    }
}
