//! Masking of V-shaped cavities (Torrance and Sparrow 1967; Cook and Torrance 1982, "A Reflectance Model for Computer
//! Graphics", G). It needs the half vector only, whatever the distribution of normals is. Twin of `glsl/include/cavity.glsl`.

use crate::reflectance::half_row::HalfRow;
use glam::DVec3;

/// G / (4 cos cos) with `G = min(1, 2 (n.h)(n.o) / (o.h), 2 (n.h)(n.i) / (o.h))` for directions above the horizon and their
/// unit half vector; finite for each pair.
pub(crate) fn masking(wi: DVec3, wo: DVec3, h: DVec3) -> f64 {
    let open = 1.0 / (4.0 * wi.z * wo.z);
    let masked = h.z / (2.0 * wo.dot(h) * wi.z.max(wo.z));
    open.min(masked)
}

/// Writes `factor` times [`masking`] for each half vector of a row.
pub(super) fn mask(row: &HalfRow<'_>, factor: f64, out: &mut [f64]) {
    let o = row.wo.z;
    for ((value, cosine), &light) in out.iter_mut().zip(row.cosines).zip(row.lights) {
        let open = 1.0 / (4.0 * light * o);
        let masked = row.polar[1] / (2.0 * cosine * if light > o { light } else { o });
        *value = factor * if open < masked { open } else { masked };
    }
}
