#version 460
// Functions of one number (x) and of two (y, x): which one is told by the last word.
#include "entry.glsl"
#include "angles.glsl"

vec4 probe(uint i) {
    uvec4 e = entries[i];
    float x = uintBitsToFloat(e.x), y = uintBitsToFloat(e.y);
    if (e.w == 0u) {
        return vec4(asin_small(x), acos_positive(x), acos_full(x), acos_full(-x));
    }
    return vec4(atan_quadrant(abs(y), abs(x)), atan_full(y, x), atan_line(y, x), 0.0);
}
