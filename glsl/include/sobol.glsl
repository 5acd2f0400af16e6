// Two-dimensional Sobol points in bit-reversed form with hash-based Owen scrambling, and plain random points.
// Bit for bit src/sampling/sobol.rs.
#ifndef SOBOL_GLSL
#define SOBOL_GLSL

// Finaliser with low bias (Wellons, "Prospecting for hash functions").
uint hash(uint x) {
    x ^= x >> 16;
    x *= 0x7feb352du;
    x ^= x >> 15;
    x *= 0x846ca68bu;
    return x ^ (x >> 16);
}

// Laine-Karras style nested uniform scramble of a reversed integer (constants: Vegdahl), then reversed back.
uint owen_scramble(uint x, uint seed) {
    x ^= x * 0x3d20adeau;
    x += seed;
    x *= (seed >> 16) | 1u;
    x ^= x * 0x05526c56u;
    x ^= x * 0x53a22864u;
    return bitfieldReverse(x);
}

// Second Sobol dimension of index i, bits reversed: Pascal's triangle modulo 2.
uint sobol_pascal(uint v) {
    v ^= v >> 16;
    v ^= (v & 0xff00ff00u) >> 8;
    v ^= (v & 0xf0f0f0f0u) >> 4;
    v ^= (v & 0xccccccccu) >> 2;
    return v ^ ((v & 0xaaaaaaaau) >> 1);
}

// The two scramble seeds of a stream: computed once a pixel.
uvec2 sobol_seeds(uint seed) {
    return uvec2(hash(seed), hash(seed ^ 0x9e3779b9u));
}

uvec2 sobol_point(uint i, uvec2 seeds) {
    return uvec2(owen_scramble(i, seeds.x), owen_scramble(sobol_pascal(i), seeds.y));
}

uvec2 random_point(uint i, uint seed) {
    uint a = hash(i * 0x9e3779b9u + seed);
    return uvec2(a, hash(a ^ 0x85ebca6bu));
}

float to_unit(uint u) {
    return float(int(u >> 8)) * (1.0 / 16777216.0); // signed conversions are the cheap ones
}

#endif
