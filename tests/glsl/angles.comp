#version 460
// The last word tells: 0 inverses of one number (x), 1 of two (y, x), 2 cosine and sine.
#include "entry.glsl"
#include "angles.glsl"

vec4 probe(uint i) {
    uvec4 e = entries[i];
    float x = uintBitsToFloat(e.x), y = uintBitsToFloat(e.y);
    if (e.w == 0u) {
        return vec4(asin_small(x), acos_positive(x), acos_full(x), acos_full(-x));
    }
    if (e.w == 2u) {
        return vec4(cos_sin(x), 0.0, 0.0);
    }
    return vec4(atan_quadrant(abs(y), abs(x)), atan_full(y, x), atan_line(y, x), 0.0);
}
