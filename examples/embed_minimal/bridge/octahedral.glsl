// Unit vectors as points of a square: the octahedron |x| + |y| + |z| = 1 unfolded (Cigolle et al. 2014, "A Survey of
// Efficient Representations for Independent Unit Vectors"), 16 bits a coordinate.
#ifndef OCTAHEDRAL_GLSL
#define OCTAHEDRAL_GLSL

vec2 octahedral_fold(vec2 p) {
    return (1.0 - abs(p.yx)) * mix(vec2(-1.0), vec2(1.0), greaterThanEqual(p, vec2(0.0)));
}

uint octahedral_pack(vec3 n) {
    n /= abs(n.x) + abs(n.y) + abs(n.z);
    return packSnorm2x16(n.z >= 0.0 ? n.xy : octahedral_fold(n.xy));
}

vec3 octahedral_unpack(uint word) {
    vec2 p = unpackSnorm2x16(word);
    float z = 1.0 - abs(p.x) - abs(p.y);
    return normalize(vec3(z >= 0.0 ? p : octahedral_fold(p), z));
}

#endif
