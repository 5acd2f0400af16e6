// The lat-long sphere: u = 0.5 + atan2(x, -z)/2pi, v = acos(y)/pi (src/sampling/latlong.rs is the f64 twin).
#ifndef LATLONG_GLSL
#define LATLONG_GLSL
#include "angles.glsl"

vec2 latlong_uv(vec3 w) {
    return vec2(0.5 + atan_full(w.x, -w.z) * (0.5 * INV_PI), acos_full(w.y) * INV_PI);
}

// Unit direction of uv, and sin(theta) in w.
vec4 latlong_direction(vec2 uv) {
    vec2 phi = cos_sin((fract(uv.x) - 0.5) * (2.0 * PI));
    vec2 theta = cos_sin(uv.y * PI);
    return vec4(theta.y * phi.y, theta.x, -theta.y * phi.x, theta.y);
}

#endif
