// Cosine-power normals (src/reflectance/blinn_phong.rs is the f64 twin).
#ifndef BLINN_PHONG_GLSL
#define BLINN_PHONG_GLSL
#include "angles.glsl"

// log(1 - x) for x in [0, 1], precise for small x too: log(1 - x) = -2 atanh(x / (2 - x)).
float log_complement(float x) {
    float r = x / (2.0 - x);
    float q = r * r;
    float series = -2.0 * r * fma(q, fma(q, fma(q, 1.0 / 7.0, 1.0 / 5.0), 1.0 / 3.0), 1.0);
    return x > 0.2 ? log(max(1.0 - x, 1e-30)) : series;
}

// The density of normals in 1/sr is the peak times e to the exponent.
float blinn_phong_exponent(float exponent, vec3 h) {
    return 0.5 * exponent * log_complement(dot(h.xy, h.xy));
}

float blinn_phong_peak(float exponent) {
    return (exponent + 2.0) * (0.5 * INV_PI);
}

#endif
