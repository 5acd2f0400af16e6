//! Masking of V-shaped cavities (Torrance and Sparrow 1967; Cook and Torrance 1982, "A Reflectance Model for Computer
//! Graphics", G). It needs the half vector only, whatever the distribution of normals is. Twin of `glsl/include/cavity.glsl`.

use glam::DVec3;

/// G / (4 cos cos) with `G = min(1, 2 (n.h)(n.o) / (o.h), 2 (n.h)(n.i) / (o.h))` for directions above the horizon and their
/// unit half vector; finite for each pair.
pub(super) fn masking(wi: DVec3, wo: DVec3, h: DVec3) -> f64 {
    let open = 1.0 / (4.0 * wi.z * wo.z);
    let masked = h.z / (2.0 * wo.dot(h) * wi.z.max(wo.z));
    open.min(masked)
}
