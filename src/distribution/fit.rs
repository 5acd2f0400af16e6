//! A reflectance times the cosine as a few lobes by view angle, whose light can be looked up instead of sampled.
//!
//! Seen at angle t from the normal, with the viewer in the half plane y = 0, x >= 0, the fit is
//! `a(w) = sum of c_k vMF(w; mu_k, kappa_k) + c_0 max(0, w.z) / pi` over the *whole* sphere, mu_k at `tilt` from the normal in the plane
//! of incidence. Between nodes of t everything is interpolated linearly, the concentration by its logarithm: the fit is defined as the
//! interpolated mixture, and nothing of it is an approximation of something else.

use crate::distribution::reflected::ReflectedLobe;
use crate::distribution::vmf::normalisation;
use glam::DVec3;
use std::f64::consts::PI;

/// Nodes over the view angle.
pub const NODES: usize = 64;
/// View angle of the last node in radians; the first is at 0. Views beyond it are those at it.
pub const LAST_ANGLE: f64 = 89.0 * PI / 180.0;
/// The most lobes of a fit.
pub const MOST_LOBES: usize = 24;

/// A lobe of light directions.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FitLobe {
    /// Angle in radians from the normal in the plane of incidence, positive away from the viewer.
    pub tilt: f64,
    /// Logarithm to the base 2 of its concentration.
    pub log2_kappa: f64,
    /// Its reflectance: what it reflects of uniform light of radiance 1.
    pub amplitude: DVec3,
}

/// The fit at one view angle.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FitNode {
    /// As many at every node, each the same one throughout; without amplitude where it is not needed.
    pub lobes: Vec<FitLobe>,
    /// Reflectance of the cosine part.
    pub diffuse: DVec3,
    /// Integral of |f - a| over that of f, f the reflectance times the cosine, mean over channels.
    pub error: f64,
}

/// A fit over all view angles.
#[derive(Clone, Debug, PartialEq)]
pub struct LobeFit {
    nodes: Vec<FitNode>,
}

impl FitLobe {
    /// Unit, in the local frame.
    pub fn direction(&self) -> DVec3 {
        DVec3::new(-self.tilt.sin(), 0.0, self.tilt.cos())
    }
}

impl FitNode {
    /// As `glsl/base.comp` looks them up; the cosine part is a factor of irradiance, in 1/sr.
    pub fn reflected(&self) -> (Vec<ReflectedLobe>, DVec3) {
        let lobe = |l: &FitLobe| ReflectedLobe { direction: l.direction(), kappa: l.log2_kappa.exp2(), weight: l.amplitude };
        (self.lobes.iter().map(lobe).collect(), self.diffuse / PI)
    }

    /// a(w) in 1/sr, cosine included, for any unit `w` of the local frame.
    pub fn evaluate(&self, w: DVec3) -> DVec3 {
        let lobe = |l: &FitLobe| {
            let kappa = l.log2_kappa.exp2();
            l.amplitude * (normalisation(kappa) * (-0.5 * kappa * (w - l.direction()).length_squared()).exp())
        };
        self.lobes.iter().map(lobe).sum::<DVec3>() + self.diffuse * (w.z.max(0.0) / PI)
    }
}

impl LobeFit {
    /// Of [`NODES`] nodes. None unless all have as many lobes, at most [`MOST_LOBES`], and finite numbers.
    pub fn new(nodes: Vec<FitNode>) -> Option<Self> {
        let count = nodes.first()?.lobes.len();
        let finite = |l: &FitLobe| l.tilt.is_finite() && l.log2_kappa.is_finite() && l.amplitude.is_finite();
        let valid = |n: &FitNode| {
            n.lobes.len() == count && n.lobes.iter().all(finite) && n.diffuse.is_finite() && n.error.is_finite() && n.error >= 0.0
        };
        (nodes.len() == NODES && count <= MOST_LOBES && nodes.iter().all(valid)).then_some(Self { nodes })
    }

    /// Of [`NODES`] valid nodes.
    pub(super) fn of(nodes: Vec<FitNode>) -> Self {
        Self { nodes }
    }

    /// Nodes by ascending view angle.
    pub fn nodes(&self) -> &[FitNode] {
        &self.nodes
    }

    /// Lobes of every node.
    pub fn count(&self) -> usize {
        self.nodes[0].lobes.len()
    }

    /// View angle of node `i` in radians.
    pub fn angle(i: usize) -> f64 {
        LAST_ANGLE * i as f64 / (NODES - 1) as f64
    }

    /// The fit seen under cosine `cos_o` to the normal.
    pub fn at(&self, cos_o: f64) -> FitNode {
        let x = (cos_o.clamp(0.0, 1.0).acos() / LAST_ANGLE).min(1.0) * (NODES - 1) as f64;
        let first = (x as usize).min(NODES - 2);
        let (a, b, t) = (&self.nodes[first], &self.nodes[first + 1], x - first as f64);
        let mix = |a: f64, b: f64| a + (b - a) * t;
        let lobe = |(a, b): (&FitLobe, &FitLobe)| FitLobe {
            tilt: mix(a.tilt, b.tilt),
            log2_kappa: mix(a.log2_kappa, b.log2_kappa),
            amplitude: a.amplitude.lerp(b.amplitude, t),
        };
        FitNode {
            lobes: a.lobes.iter().zip(&b.lobes).map(lobe).collect(),
            diffuse: a.diffuse.lerp(b.diffuse, t),
            error: mix(a.error, b.error),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn node(tilt: f64) -> FitNode {
        let lobe = FitLobe { tilt, log2_kappa: 4.0 + tilt, amplitude: DVec3::new(0.2, 0.1, 0.3) };
        FitNode { lobes: vec![lobe, FitLobe { log2_kappa: 1.0, ..lobe }], diffuse: DVec3::splat(0.1), error: tilt }
    }

    #[test]
    fn nodes_are_met_and_mixed_between() {
        let fit = LobeFit::new((0..NODES).map(|i| node(LobeFit::angle(i))).collect()).unwrap();
        for (i, known) in fit.nodes().iter().enumerate() {
            let found = fit.at(LobeFit::angle(i).cos());
            assert!((found.error - known.error).abs() < 1e-7 && (found.lobes[0].tilt - known.lobes[0].tilt).abs() < 1e-7);
        }
        // All is linear in the angle here.
        let between = fit.at(0.7f64.cos());
        assert!((between.lobes[0].tilt - 0.7).abs() < 1e-9 && (between.lobes[0].log2_kappa - 4.7).abs() < 1e-9);
        assert_eq!(fit.at(-0.1), fit.at(0.0));
        assert_eq!(fit.at(0.0).error, LAST_ANGLE);
        assert!(LobeFit::new(vec![node(0.1); 3]).is_none());
        let mut uneven: Vec<_> = (0..NODES).map(|_| node(0.1)).collect();
        uneven[5].lobes.pop();
        assert!(LobeFit::new(uneven).is_none());
    }

    #[test]
    fn the_integral_over_the_sphere_is_the_sum_of_amplitudes() {
        let node = node(0.5);
        let (rings, spokes) = (400, 400);
        let mut sum = DVec3::ZERO;
        for i in 0..rings {
            let z = 1.0 - 2.0 * (f64::from(i) + 0.5) / f64::from(rings);
            for k in 0..spokes {
                let (s, c) = (2.0 * PI * (f64::from(k) + 0.5) / f64::from(spokes)).sin_cos();
                let r = (1.0 - z * z).sqrt();
                sum += node.evaluate(DVec3::new(r * c, r * s, z)) * (4.0 * PI / f64::from(rings * spokes));
            }
        }
        let (lobes, diffuse) = node.reflected();
        let expected = lobes.iter().map(|l| l.weight).sum::<DVec3>() + diffuse * PI;
        assert!((sum - expected).abs().max_element() < 1e-4, "{sum} {expected}");
    }
}
