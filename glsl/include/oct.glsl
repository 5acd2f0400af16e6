// A unit vector in two numbers: the octahedron's faces unfolded onto a square.
#ifndef OCT_GLSL
#define OCT_GLSL

vec2 oct_fold(vec2 at) {
    return (1.0 - abs(at.yx)) * mix(vec2(-1.0), vec2(1.0), greaterThanEqual(at, vec2(0.0)));
}

vec2 oct_encode(vec3 v) {
    vec2 at = v.xy / (abs(v.x) + abs(v.y) + abs(v.z));
    return v.z < 0.0 ? oct_fold(at) : at;
}

vec3 oct_decode(vec2 at) {
    float z = 1.0 - abs(at.x) - abs(at.y);
    return normalize(vec3(z < 0.0 ? oct_fold(at) : at, z));
}

#endif
