// The stereographic plane of directions, from -z (src/distribution/stereographic.rs is the f64 twin). Directions are stored as x, y,
// 1 - z, as moments.glsl says.
#ifndef STEREOGRAPHIC_GLSL
#define STEREOGRAPHIC_GLSL

const float STEREOGRAPHIC_LEAST_COSINE = -0.6;

vec2 stereographic_of(vec3 mu) {
    return mu.xy * (2.0 / (2.0 - min(mu.z, 1.0 - STEREOGRAPHIC_LEAST_COSINE)));
}

vec3 stereographic_direction(vec2 s) {
    vec2 p = 0.5 * s;
    float square = dot(p, p), inverse = 2.0 / (1.0 + square);
    return vec3(p * inverse, square * inverse);
}

// Lengths in the plane over angles.
float stereographic_scale(vec2 s) {
    return 1.0 + 0.25 * dot(s, s);
}

// The tangent of the sphere, no longer stored in another way, along unit `along` in the plane.
vec3 stereographic_tangent(vec2 s, vec2 along) {
    float across = dot(along, stereographic_direction(s).xy);
    return vec3(along - 0.5 * s * across, -across);
}

#endif
