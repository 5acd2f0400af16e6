// Von Mises-Fisher lobes (src/distribution/vmf.rs is the f64 twin). The spread is the complement to 1 of the length of a lobe's
// mean vector: of sharp lobes it is what 32 bits can tell.
#ifndef VMF_GLSL
#define VMF_GLSL
#include "angles.glsl"

// kappa / (2 pi (1 - e^(-2 kappa))): the density of a lobe at its centre, in 1/sr.
float vmf_normalisation(float kappa) {
    float x = 2.0 * kappa;
    float complement = kappa < 0.02 ? x * (1.0 - x * (0.5 - x * (1.0 / 6.0))) : 1.0 - exp(-x);
    return kappa > 0.0 ? kappa * 0.5 * INV_PI / complement : 0.25 * INV_PI;
}

// The density per steradian at unit h of a lobe about unit mu, of integral 1; from |h - mu|^2, which sharp lobes need.
float vmf_density(vec3 mu, float kappa, vec3 h) {
    vec3 d = h - mu;
    return vmf_normalisation(kappa) * exp(-0.5 * kappa * dot(d, d));
}

const float VMF_SERIES_BELOW = 0.5; // where the closed forms would cancel
const float VMF_LEAST_SPREAD = 1e-7;

float vmf_mean_cosine_series(float kappa) {
    float square = kappa * kappa;
    return kappa * (1.0 / 3.0 - square * (1.0 / 45.0 - square * (2.0 / 945.0 - square * (1.0 / 4725.0))));
}

// coth kappa - 1/kappa: the length of a lobe's mean vector.
float vmf_mean_cosine(float kappa) {
    float e = exp(-2.0 * kappa);
    return kappa < VMF_SERIES_BELOW ? vmf_mean_cosine_series(kappa) : (1.0 + e) / (1.0 - e) - 1.0 / kappa;
}

// 1 - vmf_mean_cosine(kappa).
float vmf_spread(float kappa) {
    float e = exp(-2.0 * kappa);
    return kappa < VMF_SERIES_BELOW ? 1.0 - vmf_mean_cosine_series(kappa) : 1.0 / kappa - 2.0 * e / (1.0 - e);
}

// Xu et al. 2017, equations 8 and 9: the first term of the concentration, and the spread that it inverts (src/distribution/literal.rs).
float vmf_literal_concentration(float spread) {
    float s = clamp(spread, VMF_LEAST_SPREAD, 1.0), r = 1.0 - s;
    return r * (3.0 - r * r) / (s * (2.0 - s));
}

float vmf_literal_spread(float kappa) {
    float e = 1.0 / (1.0 + kappa);
    for (int i = 0; i < 8; ++i) {
        float value = -2.0 + e * (2.0 * kappa + e * ((3.0 - kappa) - e));
        float slope = 2.0 * kappa + e * (2.0 * (3.0 - kappa) - 3.0 * e);
        e -= value / slope;
    }
    return e;
}

// One of Newton's steps towards the concentration of spread s, 1 less r.
float vmf_newton(float kappa, float s, float r) {
    float square = kappa * kappa, e = exp(-2.0 * kappa), rest = 1.0 - e;
    bool series = kappa < VMF_SERIES_BELOW;
    float off = series ? vmf_mean_cosine_series(kappa) - r : s - (1.0 / kappa - 2.0 * e / rest);
    float slope = series ? 1.0 / 3.0 - square * (1.0 / 15.0 - square * (2.0 / 189.0 - square * (1.0 / 675.0 - square * (2.0 / 10395.0))))
                         : 1.0 / square - 4.0 * e / (rest * rest);
    return kappa - off / slope;
}

// The concentration of a lobe of this spread, which is clamped to at least VMF_LEAST_SPREAD and at most 1: Banerjee's estimate
// (within 5 %) and two Newton steps, each of which squares the relative error.
float vmf_concentration(float spread) {
    float s = clamp(spread, VMF_LEAST_SPREAD, 1.0);
    float r = 1.0 - s;
    float kappa = r * (3.0 - r * r) / (s * (2.0 - s));
    return vmf_newton(vmf_newton(kappa, s, r), s, r);
}

// The concentration of what becomes a lobe of kappa by a blur of this variance, in squared radians along each of two axes: mean
// cosines multiply.
float vmf_before(float kappa, float variance) {
    return vmf_concentration((vmf_spread(kappa) - variance) / (1.0 - variance));
}

#endif
