// Von Mises-Fisher lobes (src/reflectance/vmf.rs is the f64 twin).
#ifndef VMF_GLSL
#define VMF_GLSL
#include "angles.glsl"

// kappa / (2 pi (1 - e^(-2 kappa))): the density of a lobe at its centre, in 1/sr.
float vmf_normalisation(float kappa) {
    float x = 2.0 * kappa;
    float complement = kappa < 0.02 ? x * (1.0 - x * (0.5 - x * (1.0 / 6.0))) : 1.0 - exp(-x);
    return kappa > 0.0 ? kappa * 0.5 * INV_PI / complement : 0.25 * INV_PI;
}

// coth kappa - 1/kappa: the length of a lobe's mean vector.
float vmf_mean_cosine(float kappa) {
    float square = kappa * kappa;
    float series = kappa * (1.0 / 3.0 - square * (1.0 / 45.0 - square * (2.0 / 945.0 - square * (1.0 / 4725.0))));
    float e = exp(-2.0 * kappa);
    return kappa < 0.5 ? series : (1.0 + e) / (1.0 - e) - 1.0 / kappa;
}

#endif
