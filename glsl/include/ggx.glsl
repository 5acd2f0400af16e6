// Separable Smith GGX with Schlick's Fresnel over a diffuse base (src/reflectance/ggx.rs is the f64 twin).
#ifndef GGX_GLSL
#define GGX_GLSL
#include "angles.glsl"

// Lambda-free form of 2 cos / (cos + sqrt(a2 + (1 - a2) cos^2)), without the numerator.
float ggx_masking(float c, float a2) {
    return c + sqrt(a2 + (1.0 - a2) * c * c);
}

vec3 ggx_evaluate(vec3 f0, vec3 albedo, float alpha, vec3 wi, vec3 wo, vec3 h) {
    float a2 = alpha * alpha;
    float s2 = dot(h.xy, h.xy);
    float q = a2 * h.z * h.z + s2; // a2 cos^2 + sin^2: no cancellation at the peak
    float d = a2 / (PI * q * q);
    float v = 1.0 / (ggx_masking(wi.z, a2) * ggx_masking(wo.z, a2)); // G / (4 n.i n.o)
    float m = clamp(1.0 - dot(wo, h), 0.0, 1.0);
    float m2 = m * m;
    vec3 f = f0 + (1.0 - f0) * (m2 * m2 * m);
    return f * (d * v) + albedo * (1.0 - f) * INV_PI;
}

#endif
