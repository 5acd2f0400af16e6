// What a material's maps make of its reflectance at a sample, in 16 bytes.
#ifndef FACTORS_GLSL
#define FACTORS_GLSL

struct Factors {
    vec3 albedo;
    vec3 specular;
    float roughness; // alpha, exponent or concentration in the place of the material's own; NO_ROUGHNESS for its own
};

const float NO_ROUGHNESS = -1.0;
const Factors NO_FACTORS = Factors(vec3(1.0), vec3(1.0), NO_ROUGHNESS);

uvec4 factors_pack(Factors f) {
    return uvec4(packHalf2x16(f.albedo.rg), packHalf2x16(vec2(f.albedo.b, f.specular.r)), packHalf2x16(f.specular.gb),
        floatBitsToUint(f.roughness));
}

Factors factors_unpack(uvec4 u) {
    vec2 rg = unpackHalf2x16(u.x), br = unpackHalf2x16(u.y), gb = unpackHalf2x16(u.z);
    return Factors(vec3(rg, br.x), vec3(br.y, gb), uintBitsToFloat(u.w));
}

#endif
