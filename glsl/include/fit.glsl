// A reflectance times the cosine as lobes of light directions by view angle (src/distribution/fit.rs is the f64 twin, src/pass/fits.rs
// packs it). Include after materials.glsl; the includer defines FIT_BINDING.
#ifndef FIT_GLSL
#define FIT_GLSL
#include "reflected.glsl"

layout(set = 2, binding = FIT_BINDING, std430) readonly buffer Fits {
    uvec4 fits[]; // as src/pass/fits.rs says, in fours: the reference driver's loads cost by call more than by component
};

const float FIT_NODES = 64.0;
const float FIT_LAST_ANGLE = 89.0 * PI / 180.0;

// A material's fit as seen from one direction: between two of its nodes.
struct Fit {
    uint count;   // of lobes that have some weight there; 0 without a fit
    uint first;   // of their records
    float weight; // of the second node
    vec3 diffuse; // factor on irradiance in 1/sr
    float error;  // integral of |f - a| over that of f
    vec3 factor;  // of the material's maps
};

Fit fit_load(Material m, float cos_o) {
    uint kind = m.record.kind.x;
    bool table = kind == REFLECTANCE_TABLE || kind == REFLECTANCE_TURNED;
    Fit f;
    float x = min(acos_positive(clamp(cos_o, 0.0, 1.0)) * ((FIT_NODES - 1.0) / FIT_LAST_ANGLE), FIT_NODES - 1.0);
    float node = min(floor(x), FIT_NODES - 2.0);
    uint at = m.record.kind.w > 0u ? m.record.kind.w + 3u * uint(int(node)) : 0u;
    uvec4 head = fits[at];
    f.first = head.x;
    f.count = head.y;
    f.weight = x - node;
    f.factor = table ? m.record.f0.rgb : vec3(1.0);
    f.diffuse = mix(uintBitsToFloat(fits[at + 1u].xyz), uintBitsToFloat(fits[at + 2u].xyz), f.weight) * f.factor * INV_PI;
    f.error = mix(uintBitsToFloat(head.z), uintBitsToFloat(head.w), f.weight);
    return f;
}

// Lobe i, below `count`.
ReflectedLobe fit_lobe(Fit f, uint i) {
    uvec4 shape = fits[f.first + 2u * i], amplitudes = fits[f.first + 2u * i + 1u];
    vec2 between = mix(uintBitsToFloat(shape.xy), uintBitsToFloat(shape.zw), f.weight); // tilt; log2 of the concentration
    vec2 first = unpackSnorm2x16(amplitudes.x), middle = unpackSnorm2x16(amplitudes.y), last = unpackSnorm2x16(amplitudes.z);
    vec3 amplitude = mix(vec3(first, middle.x), vec3(middle.y, last), f.weight);
    ReflectedLobe lobe;
    vec2 turn = cos_sin(between.x);
    lobe.direction = vec3(-turn.y, 0.0, turn.x);
    lobe.kappa = exp2(between.y);
    lobe.weight = amplitude * (uintBitsToFloat(amplitudes.w) * f.factor);
    return lobe;
}

#endif
