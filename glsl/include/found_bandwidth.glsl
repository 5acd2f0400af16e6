// How fast the lobes that the filter found vary (src/reflectance/bandwidth.rs, `found`, is the f64 twin). Include after lobes.glsl.
#ifndef FOUND_BANDWIDTH_GLSL
#define FOUND_BANDWIDTH_GLSL
#include "reflected.glsl"

const float FOUND_QUANTILE = 2.447746830680816; // sqrt(-2 ln 0.05)
const float FOUND_COSINE = 2.0;                 // concentration that stands for a cosine over the horizon

// Cycles/radian of a lobe of light directions: its power spectrum is normal, with deviation sqrt(kappa / 2) / 2 pi.
float lobe_cycles(float kappa) {
    return FOUND_QUANTILE * 0.5 * INV_PI * sqrt(0.5 * kappa);
}

// About local wi, seen from wo: the mean over the lobes and what is diffuse, by what each reflects from there; that of the narrowest
// where none reflects anything. Elliptic lobes vary as fast as across their axis.
float found_bandwidth(Material m, Lobes l, vec3 wi, vec3 wo) {
    float diffuse = mean_of(reflected_diffuse(m, wo)) * wi.z;
    float sum = diffuse * lobe_cycles(FOUND_COSINE), weights = diffuse, narrowest = 0.0;
    for (uint i = 0u; i < l.count; ++i) {
        ReflectedLobe lobe = reflected_found(m, l, i, wo);
        float cycles = lobe_cycles(lobe.kappa) * (ELLIPTIC != 0u ? length(lobe_across[i]) : 1.0);
        float weight = mean_of(lobe.weight) * vmf_density(lobe.direction, lobe.kappa, wi);
        sum += weight * cycles;
        weights += weight;
        narrowest = max(narrowest, cycles);
    }
    return weights > 0.0 ? sum / weights : narrowest;
}

#endif
