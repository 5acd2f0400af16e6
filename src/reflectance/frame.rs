//! A tangent frame in one number, as the G-buffer keeps it. Twin of `glsl/include/tangent.glsl`.

use glam::DVec3;
use std::f64::consts::PI;

/// Beyond pi: 0 is for no tangent.
const OFFSET: f64 = 4.0;

/// Two unit vectors that form a right-handed frame with unit `n` (Duff et al. 2017, "Building an orthonormal basis, revisited").
pub fn basis(n: DVec3) -> [DVec3; 2] {
    let s = if n.z >= 0.0 { 1.0 } else { -1.0 };
    let a = -1.0 / (s + n.z);
    let b = n.x * n.y * a;
    [DVec3::new(1.0 + s * n.x * n.x * a, s * b, -s * n.x), DVec3::new(b, s + n.y * n.y * a, -n.y)]
}

/// The unit tangent about unit `n` and the handedness (1 or -1) that `code` stands for; `None` for 0.
pub fn decode(n: DVec3, code: f64) -> Option<(DVec3, f64)> {
    let [x, y] = basis(n);
    let (sin, cos) = (code.abs() - OFFSET).clamp(-PI, PI).sin_cos();
    (code != 0.0).then(|| (x * cos + y * sin, code.signum()))
}
