#version 460
// Operators, pixel angles and levels.
#include "entry.glsl"
#include "bandwidth.glsl"

// Pairs of entries: light, lobe, curvatures; distance, cosine, pixel, operator. The curvatures serve as a ray as well.
vec4 probe(uint i) {
    vec4 a = uintBitsToFloat(entries[i & ~1u]), b = uintBitsToFloat(entries[i | 1u]);
    float image = image_bandwidth(int(entries[i | 1u].w), a.x, a.y, a.zw, b.x, b.y, b.z);
    return vec4(image, pixel_angle(a.zw, vec2(b.z, 0.5 * b.z)), float(bandwidth_level(image, 4.0, -2, 5)), 0.0);
}
