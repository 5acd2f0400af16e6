// What a texel keeps of the lobe under it, for filters with one lobe; its mips are averages (src/moments.rs is the f64 twin).
//   vmf1:                  characteristic vector r of the lobe as x, y, 1 - z; the mean spread of the lobes below
//   naive, fixed, toksvig: mean direction                  as x, y, 1 - z; the mean concentration
// The weight of an undivided texel is 1 and not stored. The complement of z keeps what 32 bits can tell of a sharp lobe.
#ifndef MOMENTS_GLSL
#define MOMENTS_GLSL
#include "vmf.glsl"

const uint FILTER_NAIVE = 0u;
const uint FILTER_FIXED = 1u;
const uint FILTER_TOKSVIG = 2u;
const uint FILTER_VMF1 = 3u;

// What a lobe's concentration becomes.
const uint LOBES_STAY = 0u;     // nothing: the material's own lobes stay
const uint LOBES_ALPHA = 1u;    // sqrt(2 / concentration)
const uint LOBES_EXPONENT = 2u; // alpha of a cosine power, whose mean cosine is exact: sqrt(2 spread)

// Less spread than this beyond what is known comes of rounding.
const float MOMENTS_ROUNDING = 2.0 * VMF_LEAST_SPREAD;

// 1 - |r|, at least `known`.
float moments_spread(vec3 r, float known) {
    float square = r.z * (2.0 - r.z) - dot(r.xy, r.xy); // 1 - |r|^2
    float spread = square / (1.0 + sqrt(max(1.0 - square, 0.0)));
    return spread > known + MOMENTS_ROUNDING ? spread : known;
}

// Alpha of the lobe that a filter finds in moments.
float moments_alpha(uint filtering, vec4 moments, uint lobes) {
    float spread, kappa;
    if (filtering == FILTER_VMF1) {
        spread = moments_spread(moments.xyz, moments.w);
        kappa = vmf_concentration(spread);
    } else {
        kappa = moments.w;
        if (filtering == FILTER_TOKSVIG) {
            float off = moments_spread(moments.xyz, 0.0);
            kappa *= (1.0 - off) / (1.0 - off + kappa * off);
        }
        spread = vmf_spread(kappa);
    }
    return sqrt(lobes == LOBES_EXPONENT ? 2.0 * spread : 2.0 / max(kappa, 1e-12));
}

#endif
