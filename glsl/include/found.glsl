// A lobe that the filter found at a sample, in 16 bytes: direction, the normal of the surface below it, concentration and weight,
// which is above 0, so that its sign says something else (FOUND_COLOURED). Elliptic lobes have the direction in two numbers of 22 bits, and beside these, in 10 bits each, the angle of the
// axis along which they are the widest and how many times as wide as across they are; the normal is in two numbers of 12 bits, beside
// how many times as concentrated as across the lobes are of which it is made.
#ifndef FOUND_GLSL
#define FOUND_GLSL
#include "oct.glsl"
#include "tangent.glsl"

// Concentrations are kept by their logarithm to base 2, from -16 to 32, in steps of 0.05 %.
const float FOUND_LEAST = -16.0;
const float FOUND_RANGE = 48.0;

uvec4 found_pack(vec3 mu, vec3 normal, float kappa, float weight) {
    float log_kappa = clamp((log2(max(kappa, 1e-6)) - FOUND_LEAST) / FOUND_RANGE, 0.0, 1.0);
    uint low = packHalf2x16(vec2(max(weight, 6.2e-5), 0.0)) & 0xffffu;
    return uvec4(floatBitsToUint(oct_encode(mu)), packSnorm2x16(oct_encode(normal)), uint(log_kappa * 65535.0 + 0.5) << 16 | low);
}

const float FOUND_PLACES = 4194303.0; // of a number of 22 bits
const float FOUND_ANGLES = 1024.0;
const float FOUND_RATIOS = 1023.0;
const float FOUND_MOST_RATIO = 10.0; // logarithm to base 2
const float FOUND_MOST_NARROWER = 16.0;

// The same of an elliptic lobe; `ratio` is at least 1, as is `narrower`, the concentration of the lobes below over that across.
uvec4 found_pack_along(vec3 mu, vec3 axis, float ratio, float narrower, vec3 normal, float kappa, float weight) {
    uvec4 u = found_pack(mu, normal, kappa, weight);
    uvec2 place = uvec2(clamp(oct_encode(mu) * 0.5 + 0.5, 0.0, 1.0) * FOUND_PLACES + 0.5);
    vec3 x, y;
    tangent_basis(mu, x, y);
    uint angle = uint((atan_line(dot(axis, y), dot(axis, x)) * INV_PI + 0.5) * FOUND_ANGLES + 0.5) & 1023u;
    uint times = uint(clamp(log2(max(ratio, 1.0)) / FOUND_MOST_RATIO, 0.0, 1.0) * FOUND_RATIOS + 0.5);
    uvec2 below = uvec2(clamp(oct_encode(normal) * 0.5 + 0.5, 0.0, 1.0) * 4095.0 + 0.5);
    uint apart = uint(clamp(log2(max(narrower, 1.0)) / FOUND_MOST_NARROWER, 0.0, 1.0) * 255.0 + 0.5);
    return uvec4(place.x << 10 | angle, place.y << 10 | times, below.x << 20 | below.y << 8 | apart, u.w);
}

vec3 found_normal_along(uvec4 u) {
    return oct_decode(vec2(u.z >> 20, u.z >> 8 & 4095u) * (2.0 / 4095.0) - 1.0);
}

float found_narrower(uvec4 u) {
    return exp2(float(u.z & 255u) * (FOUND_MOST_NARROWER / 255.0));
}

vec3 found_direction_along(uvec4 u) {
    return oct_decode(vec2(u.xy >> 10) * (2.0 / FOUND_PLACES) - 1.0);
}

// Along the axis, in the frame that tangent_basis gives of the direction.
vec2 found_axis(uvec4 u) {
    return cos_sin((float(u.x & 1023u) / FOUND_ANGLES - 0.5) * PI);
}

// The square root of the ratio, by which a lobe is wider along the axis and narrower across than a round one.
float found_stretch(uvec4 u) {
    return exp2(float(u.y & 1023u) * (0.5 * FOUND_MOST_RATIO / FOUND_RATIOS));
}

// The sign of a lobe's weight: colours of the first four lobes over their mean, in 32 bits each (9 of each component, a common exponent), are
// in the last layer.
const uint FOUND_COLOURED = 0x8000u;

uint found_pack_colour(vec3 c) {
    c = clamp(c, 0.0, 65000.0);
    int exponent = clamp(int(floor(log2(max(max(c.r, c.g), max(c.b, 1e-5))))) + 1, -15, 16);
    uvec3 parts = min(uvec3(c * exp2(float(9 - exponent)) + 0.5), uvec3(511u));
    return parts.r | parts.g << 9 | parts.b << 18 | uint(exponent + 15) << 27;
}

vec3 found_colour(uint u) {
    return vec3(u & 511u, u >> 9 & 511u, u >> 18 & 511u) * exp2(float(u >> 27) - 24.0);
}

bool found_none(uvec4 u) {
    return (u.w & 0xffffu) == 0u;
}

vec3 found_direction(uvec4 u) {
    return oct_decode(uintBitsToFloat(u.xy));
}

vec3 found_normal(uvec4 u) {
    return oct_decode(unpackSnorm2x16(u.z));
}

float found_concentration(uvec4 u) {
    return exp2(float(u.w >> 16) * (FOUND_RANGE / 65535.0) + FOUND_LEAST);
}

float found_weight(uvec4 u) {
    return unpackHalf2x16(u.w & 0x7fffu).x;
}

#endif
