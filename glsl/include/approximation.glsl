// The lobes whose light is looked up in the place of a material's reflection: of its fit, or those that the filter found, or its own.
// Include after lobes.glsl; the includer defines FIT_BINDING.
#ifndef APPROXIMATION_GLSL
#define APPROXIMATION_GLSL
#include "fit.glsl"

// Whether there are materials with fits, and without.
layout(constant_id = 12) const uint FITTED = 0u;
layout(constant_id = 13) const uint REFLECTED = 1u;

struct Approximation {
    uint count;
    bool found; // by the filter
    vec3 diffuse; // factor on irradiance in 1/sr
    Fit fit;
};

Approximation approximation_load(Material m, Lobes l, vec3 wo) {
    Approximation a;
    a.count = 0u;
    a.found = LOBED != 0u && l.count > 0u;
    a.diffuse = vec3(0.0);
    if (REFLECTED != 0u) {
        a.count = a.found ? l.count : reflected_count(m);
        a.diffuse = reflected_diffuse(m, wo);
    }
    if (FITTED != 0u) {
        a.fit = fit_load(m, wo.z);
        bool fitted = a.fit.count > 0u;
        a.count = fitted ? a.fit.count : a.count;
        a.diffuse = fitted ? a.fit.diffuse : a.diffuse;
    }
    return a;
}

// Lobe i, below `count`.
ReflectedLobe approximation_lobe(Material m, Lobes l, Approximation a, uint i, vec3 wo) {
    ReflectedLobe lobe = ReflectedLobe(vec3(0.0, 0.0, 1.0), 1.0, vec3(0.0));
    if (REFLECTED != 0u) {
        if (UNFILTERED != 0u) {
            lobe = reflected_lobe(m, i, wo);
        }
        if (LOBED != 0u) {
            ReflectedLobe found = reflected_found(m, l, min(i, LAYERS - 1u), wo);
            lobe.direction = a.found ? found.direction : lobe.direction;
            lobe.kappa = a.found ? found.kappa : lobe.kappa;
            lobe.weight = a.found ? found.weight : lobe.weight;
        }
    }
    if (FITTED != 0u) {
        ReflectedLobe fitted = fit_lobe(a.fit, i);
        bool there = a.fit.count > 0u;
        lobe.direction = there ? fitted.direction : lobe.direction;
        lobe.kappa = there ? fitted.kappa : lobe.kappa;
        lobe.weight = there ? fitted.weight : lobe.weight;
    }
    return lobe;
}

// By how much light is not what the lobes say, as a share: unknown without a fit.
float approximation_error(Approximation a) {
    float error = 1.0;
    if (FITTED != 0u) {
        error = a.fit.count > 0u ? a.fit.error : error;
    }
    return error;
}

#endif
