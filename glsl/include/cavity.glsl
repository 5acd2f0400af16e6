// Masking of V-shaped cavities (Torrance and Sparrow 1967; src/reflectance/cavity.rs is the f64 twin).
#ifndef CAVITY_GLSL
#define CAVITY_GLSL

// G / (4 n.i n.o) for directions above the horizon and their half vector.
float cavity_masking(vec3 wi, vec3 wo, vec3 h) {
    return min(0.25 / (wi.z * wo.z), 0.5 * h.z / (dot(wo, h) * max(wi.z, wo.z)));
}

#endif
