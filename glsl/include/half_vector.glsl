// Half- and difference-angle coordinates of a pair of directions (Rusinkiewicz 1998), in the local frame (z = normal).
#ifndef HALF_VECTOR_GLSL
#define HALF_VECTOR_GLSL
#include "angles.glsl"

// sqrt(theta_h / (pi/2)) in [0, 1]: the MERL warp, resolved near the normal where lobes peak.
float half_warp(vec3 h) {
    float t = dot(h.xy, h.xy) / (1.0 + max(h.z, 0.0)); // 1 - cos(theta_h) without cancellation
    return sqrt(min(asin_small(sqrt(0.5 * t)) * (4.0 * INV_PI), 1.0));
}

// phi_d / pi modulo 1, of the light direction about h.
float difference_turn(vec3 wi, vec3 h) {
    float y = wi.y * h.x - wi.x * h.y;
    float x = h.z * (wi.x * h.x + wi.y * h.y) - wi.z * dot(h.xy, h.xy);
    return atan_line(y, x) * INV_PI;
}

#endif
