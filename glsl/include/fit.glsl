// A reflectance times the cosine as lobes of light directions by view angle (src/distribution/fit.rs is the f64 twin, src/pass/fits.rs
// packs it). Include after materials.glsl; the includer defines FIT_BINDING.
#ifndef FIT_GLSL
#define FIT_GLSL
#include "reflected.glsl"

layout(set = 2, binding = FIT_BINDING, std430) readonly buffer Fits {
    float fits[]; // a 0; of each fit its number of lobes, then its nodes: diffuse, error; tilt, log2 of the concentration, amplitude of each lobe
};

const float FIT_NODES = 64.0;
const float FIT_LAST_ANGLE = 89.0 * PI / 180.0;

// A material's fit as seen from one direction.
struct Fit {
    uint count;    // of lobes; 0 without a fit
    uint at, next; // the nodes on both sides
    float weight;  // of the second
    vec3 factor;   // of the material's maps
};

Fit fit_load(Material m, float cos_o) {
    uint kind = m.record.kind.x;
    bool table = kind == REFLECTANCE_TABLE || kind == REFLECTANCE_TURNED;
    Fit f;
    f.count = uint(int(fits[m.record.kind.w]));
    float x = min(acos_positive(clamp(cos_o, 0.0, 1.0)) * ((FIT_NODES - 1.0) / FIT_LAST_ANGLE), FIT_NODES - 1.0);
    float node = min(floor(x), FIT_NODES - 2.0);
    uint size = 4u + 5u * f.count;
    f.weight = x - node;
    f.at = f.count > 0u ? m.record.kind.w + 1u + uint(int(node)) * size : 0u;
    f.next = f.count > 0u ? f.at + size : 0u;
    f.factor = table ? m.record.f0.rgb : vec3(1.0);
    return f;
}

float fit_value(Fit f, uint i) {
    return mix(fits[f.at + i], fits[f.next + i], f.weight);
}

// Factor on irradiance in 1/sr.
vec3 fit_diffuse(Fit f) {
    return vec3(fit_value(f, 0u), fit_value(f, 1u), fit_value(f, 2u)) * f.factor * INV_PI;
}

// Integral of |f - a| over that of f.
float fit_error(Fit f) {
    return fit_value(f, 3u);
}

// Lobe i, below `count`.
ReflectedLobe fit_lobe(Fit f, uint i) {
    uint first = 4u + 5u * i;
    ReflectedLobe lobe;
    vec2 turn = cos_sin(fit_value(f, first));
    lobe.direction = vec3(-turn.y, 0.0, turn.x);
    lobe.kappa = exp2(fit_value(f, first + 1u));
    lobe.weight = vec3(fit_value(f, first + 2u), fit_value(f, first + 3u), fit_value(f, first + 4u)) * f.factor;
    return lobe;
}

#endif
