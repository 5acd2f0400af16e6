// Cosine-power normals under V-cavity masking over a diffuse base (src/reflectance/blinn_phong.rs is the f64 twin).
#ifndef BLINN_PHONG_GLSL
#define BLINN_PHONG_GLSL
#include "angles.glsl"
#include "cavity.glsl"

// log(1 - x) for x in [0, 1], precise for small x too: log(1 - x) = -2 atanh(x / (2 - x)).
float log_complement(float x) {
    if (x > 0.2) {
        return log(max(1.0 - x, 1e-30));
    }
    float r = x / (2.0 - x);
    float q = r * r;
    return -2.0 * r * fma(q, fma(q, fma(q, 1.0 / 7.0, 1.0 / 5.0), 1.0 / 3.0), 1.0);
}

vec3 blinn_phong_evaluate(vec3 specular, vec3 albedo, float exponent, vec3 wi, vec3 wo, vec3 h) {
    float power = exp(0.5 * exponent * log_complement(dot(h.xy, h.xy)));
    float d = (exponent + 2.0) * (0.5 * INV_PI) * power;
    return specular * (d * cavity_masking(wi, wo, h)) + albedo * INV_PI;
}

#endif
