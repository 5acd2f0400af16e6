// What the filter makes of a material's reflectance at a sample, in 16 bytes.
#ifndef FACTORS_GLSL
#define FACTORS_GLSL

struct Factors {
    vec3 albedo;
    vec3 specular;
    float alpha;  // of a roughness map, in the place of the material's own; NO_ALPHA for its own
    float kernel; // what is added to the square of alpha
};

const float NO_ALPHA = -1.0;
const Factors NO_FACTORS = Factors(vec3(1.0), vec3(1.0), NO_ALPHA, 0.0);

uvec4 factors_pack(Factors f) {
    return uvec4(packHalf2x16(f.albedo.rg), packHalf2x16(vec2(f.albedo.b, f.specular.r)), packHalf2x16(f.specular.gb),
        packHalf2x16(vec2(f.alpha, f.kernel)));
}

Factors factors_unpack(uvec4 u) {
    vec2 rg = unpackHalf2x16(u.x), br = unpackHalf2x16(u.y), gb = unpackHalf2x16(u.z), rough = unpackHalf2x16(u.w);
    return Factors(vec3(rg, br.x), vec3(br.y, gb), rough.x, rough.y);
}

#endif
