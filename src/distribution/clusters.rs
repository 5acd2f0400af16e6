//! Clusters of lobes: where in the stereographic plane the lobes of a map lie, found once for the whole map, and the moments that a
//! texel keeps of the lobes that fall into each. These are linear; they are decoded, after all averages, as elliptic lobes.
//!
//! A lobe is assigned to one cluster. It counts with the mass `q = weight / area` that it has over solid angle where it fills the
//! projected area, `area` being its mean cosine, and has the variance `scale^2 / kappa` each way in the plane.

use crate::distribution::elliptic;
use crate::distribution::stereographic;
use crate::distribution::vmf::Lobe;
use glam::{DVec2, DVec3};

/// Numbers of a cluster in a texel: mass; mass times place in the plane from the cluster's centre, x and y; mass times mean products
/// xx, xy, yy of these, with the lobes' own variance; mass times the place of the normal below, x and y, where lobes are not about it;
/// mass times the factor on the specular colour, where that is kept.
pub const MOMENTS: usize = 11;

/// The most clusters of a map: 96 bytes a texel in numbers of 16 bits.
pub const MOST_CLUSTERS: usize = 8;

/// The same with normals.
pub const MOST_WITH_NORMALS: usize = 6;

/// The same with colours.
pub const MOST_WITH_COLOURS: usize = 4;

/// Lobes of less concentration count as this.
const LEAST_CONCENTRATION: f64 = 0.25;

/// Added to the distance of clusters of the other roughness.
const OUTSIDE: f64 = 1e6;

/// A region of the plane, for lobes of some roughness. All numbers are such that 32 bits hold them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cluster {
    /// In the plane.
    pub centre: DVec2,
    /// A lobe at d from the centre is at the distance `constant + d^T inverse d`: xx, xy, yy.
    pub inverse: [f64; 3],
    /// May be negative.
    pub constant: f64,
    /// The least variance that a lobe decoded from it has in the plane.
    pub floor: f64,
    /// The mean of 1 / kappa of its lobes.
    pub own: f64,
    /// It takes lobes of at least this variance 1 / kappa, if that is 0 or more; else of less than its opposite.
    pub bound: f64,
}

/// Those of a map.
#[derive(Clone, Debug, PartialEq)]
pub struct Clusters {
    all: Vec<Cluster>,
    layout: Layout,
}

/// What is kept beside moments.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Layout {
    /// Normals, as lobes are not about them.
    pub normals: bool,
    /// Specular colours, as they go together with lobes.
    pub colours: bool,
}

/// A lobe that is decoded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Decoded {
    /// Of the share of the texel's mass that it has.
    pub lobe: elliptic::Lobe,
    /// The mean of the normals below, unit.
    pub normal: DVec3,
    /// The concentration of the lobes below: what is wider than that is the spread of their normals.
    pub own: f64,
    /// The factor on its specular colour, where that is kept.
    pub colour: Option<DVec3>,
}

/// A lobe in the plane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Placed {
    pub at: DVec2,
    /// 1 / kappa.
    pub own: f64,
    /// In the plane, each way.
    pub variance: f64,
}

impl Placed {
    pub fn of(lobe: &Lobe) -> Self {
        let at = stereographic::of(lobe.mu);
        let own = 1.0 / lobe.kappa.max(LEAST_CONCENTRATION);
        Self { at, own, variance: own * stereographic::scale(at).powi(2) }
    }
}

impl Cluster {
    /// As far as 32 bits hold it.
    pub(crate) fn rounded(self) -> Self {
        let round = |v: f64| f64::from(v as f32);
        Self {
            centre: DVec2::new(round(self.centre.x), round(self.centre.y)),
            inverse: self.inverse.map(round),
            constant: round(self.constant),
            floor: round(self.floor),
            own: round(self.own),
            bound: round(self.bound),
        }
    }

    pub(crate) fn distance(&self, lobe: &Placed) -> f64 {
        let d = lobe.at - self.centre;
        let [xx, xy, yy] = self.inverse;
        let inside = if self.bound < 0.0 { lobe.own < -self.bound } else { lobe.own >= self.bound };
        self.constant + xx * d.x * d.x + 2.0 * xy * d.x * d.y + yy * d.y * d.y + if inside { 0.0 } else { OUTSIDE }
    }

    /// What a lobe of mass `q` adds.
    pub(crate) fn moments(&self, lobe: &Placed, q: f64) -> [f64; MOMENTS] {
        let d = lobe.at - self.centre;
        let v = lobe.variance;
        [q, q * d.x, q * d.y, q * (d.x * d.x + v), q * d.x * d.y, q * (d.y * d.y + v), 0.0, 0.0, 0.0, 0.0, 0.0]
    }

    /// The lobe of these moments, of weight 1.
    pub(crate) fn decode(&self, [q, x, y, xx, xy, yy, ..]: [f64; MOMENTS]) -> elliptic::Lobe {
        let off = DVec2::new(x, y) / q;
        let [xx, xy, yy] = [xx / q - off.x * off.x, xy / q - off.x * off.y, yy / q - off.y * off.y];
        let (mean, half) = (0.5 * (xx + yy), 0.5 * (xx - yy));
        let apart = half.hypot(xy);
        let [wide, narrow] = [mean + apart, mean - apart].map(|v| v.max(self.floor));
        let turned = 0.5 * xy.atan2(half);
        let at = self.centre + off;
        let kappa = stereographic::scale(at).powi(2) / (wide * narrow).sqrt();
        let round = Lobe { mu: stereographic::direction(at), kappa, weight: 1.0 };
        elliptic::Lobe { round, axis: stereographic::tangent(at, DVec2::from_angle(turned)), ratio: (wide / narrow).sqrt() }
    }
}

impl Clusters {
    /// At least one, of which no more than [`Layout::most`] count.
    pub(crate) fn new(mut all: Vec<Cluster>, layout: Layout) -> Self {
        all.truncate(layout.most());
        if all.is_empty() {
            all.push(Cluster { centre: DVec2::ZERO, inverse: [1.0, 0.0, 1.0], constant: 0.0, floor: 1e-9, own: 0.0, bound: 0.0 });
        }
        Self { all: all.into_iter().map(Cluster::rounded).collect(), layout }
    }

    /// What is kept beside moments.
    pub fn layout(&self) -> Layout {
        self.layout
    }

    /// They.
    pub fn all(&self) -> &[Cluster] {
        &self.all
    }

    /// Bytes of a texel, as it is stored.
    pub fn bytes(&self) -> usize {
        self.layout.layers(self.all.len()) * 8
    }

    /// That of a lobe.
    pub(crate) fn nearest(&self, lobe: &Placed) -> usize {
        let distances = self.all.iter().map(|cluster| cluster.distance(lobe));
        distances.enumerate().fold((0, f64::INFINITY), |best, (i, d)| if d < best.1 { (i, d) } else { best }).0
    }

    /// What a lobe over a normal, with a factor on its colour, adds to a texel, and to which cluster.
    pub(crate) fn encode(&self, lobe: &Lobe, normal: Option<DVec3>, colour: DVec3, q: f64) -> (usize, [f64; MOMENTS]) {
        let placed = Placed::of(lobe);
        let i = self.nearest(&placed);
        let mut moments = self.all.get(i).map_or([0.0; MOMENTS], |cluster| cluster.moments(&placed, q));
        if let Some(normal) = normal.filter(|_| self.layout.normals) {
            let at = q * stereographic::of(normal);
            (moments[6], moments[7]) = (at.x, at.y);
        }
        if self.layout.colours {
            moments[8..].copy_from_slice(&(q * colour).to_array());
        }
        (i, moments)
    }

    /// The lobes of a texel, of weights that sum to 1; and its mass.
    pub(crate) fn decode(&self, texel: &[f64]) -> (Vec<Decoded>, f64) {
        let all = || texel.as_chunks::<MOMENTS>().0.iter();
        let mass: f64 = all().map(|m| m[0]).sum();
        let lobe = |(cluster, moments): (&Cluster, &[f64; MOMENTS])| {
            let lobe = cluster.decode(*moments);
            let round = Lobe { weight: moments[0] / mass, ..lobe.round };
            let below = stereographic::direction(DVec2::new(moments[6], moments[7]) / moments[0]);
            let normal = if self.layout.normals { below } else { round.mu };
            let colour = self.layout.colours.then(|| DVec3::from_slice(&moments[8..]) / moments[0]);
            let (lobe, own) = (elliptic::Lobe { round, ..lobe }, 1.0 / cluster.own.max(1e-30));
            (round.weight > LEAST_SHARE).then_some(Decoded { lobe, normal, own, colour })
        };
        (self.all.iter().zip(all()).filter_map(lobe).collect(), mass)
    }
}

/// Less of a texel's mass is none: that is what 16 bits round to.
const LEAST_SHARE: f64 = 1e-6;

impl Layout {
    /// The most clusters.
    pub(crate) fn most(self) -> usize {
        match self {
            Self { colours: true, .. } => MOST_WITH_COLOURS,
            Self { normals: true, .. } => MOST_WITH_NORMALS,
            _ => MOST_CLUSTERS,
        }
    }

    /// Layers of four numbers: mass, x, y, xx of each cluster; then xy, yy of two clusters in a layer, or of each with its normal; then
    /// the colour of each.
    pub(crate) fn layers(self, clusters: usize) -> usize {
        clusters + if self.normals { clusters } else { clusters.div_ceil(2) } + if self.colours { clusters } else { 0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lobe_is_decoded_as_itself() {
        let clusters = Clusters::new(Vec::new(), Layout::default());
        for (mu, kappa) in [(DVec3::Z, 3e4), (DVec3::new(0.7, -0.5, 0.4), 12.0), (DVec3::new(-0.9, 0.1, -0.2), 300.0)] {
            let lobe = Lobe { mu: mu.normalize(), kappa, weight: 1.0 };
            let (i, moments) = clusters.encode(&lobe, None, DVec3::ONE, 1.3);
            let (lobes, mass) = clusters.decode(&moments);
            assert!(i == 0 && lobes.len() == 1 && (mass - 1.3).abs() < 1e-12);
            let Decoded { lobe: found, normal, colour, .. } = lobes[0];
            assert!(normal == found.round.mu && colour.is_none());
            assert!((found.round.mu - lobe.mu).length() < 1e-12 && (found.round.kappa / kappa - 1.0).abs() < 1e-6, "{found:?}");
            assert!((found.ratio - 1.0).abs() < 1e-6 && (found.round.weight - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn lobes_go_to_the_clusters_of_their_roughness() {
        let at = |x: f64, bound| Cluster {
            centre: DVec2::new(x, 0.0),
            inverse: [1.0, 0.0, 1.0],
            constant: 0.0,
            floor: 0.0,
            own: 0.0,
            bound,
        };
        let clusters =
            Clusters::new(vec![at(-0.5, 0.01), at(0.5, 0.01), at(0.0, -0.01)], Layout { normals: true, colours: true });
        let lobe = |x: f64, kappa| Lobe { mu: DVec3::new(x, 0.0, 1.0).normalize(), kappa, weight: 1.0 };
        let of = |x, kappa| clusters.encode(&lobe(x, kappa), None, DVec3::ONE, 1.0).0;
        assert_eq!([of(-0.1, 50.0), of(0.1, 50.0), of(0.9, 200.0)], [0, 1, 2]);
        assert_eq!(clusters.bytes(), (3 + 3 + 3) * 8);
        let below = DVec3::new(0.3, -0.2, 0.9).normalize();
        let mut texel = [0.0; 3 * MOMENTS];
        let gold = DVec3::new(0.9, 0.6, 0.2);
        texel[..MOMENTS].copy_from_slice(&clusters.encode(&lobe(-0.1, 50.0), Some(below), gold, 2.0).1);
        let found = &clusters.decode(&texel).0[0];
        assert!((found.normal - below).length() < 1e-12 && (found.colour.unwrap() - gold).length() < 1e-12, "{found:?}");
    }

    #[test]
    fn two_lobes_make_an_ellipse() {
        let clusters = Clusters::new(Vec::new(), Layout::default());
        let mut texel = [0.0; MOMENTS];
        for x in [-0.1, 0.1] {
            let lobe = Lobe { mu: DVec3::new(0.6 * x, 0.8 * x, 1.0).normalize(), kappa: 1e4, weight: 0.5 };
            texel.iter_mut().zip(clusters.encode(&lobe, None, DVec3::ONE, 0.5).1).for_each(|(sum, m)| *sum += m);
        }
        let (lobes, _) = clusters.decode(&texel);
        assert!(lobes[0].lobe.axis.dot(DVec3::new(0.6, 0.8, 0.0)).abs() > 0.999_999, "{lobes:?}");
        assert!((lobes[0].lobe.ratio.powi(2) / 101.0 - 1.0).abs() < 0.02, "{lobes:?}");
    }
}
