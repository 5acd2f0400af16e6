// The suns of an environment as src/pass/prefilter.rs packs them (src/distribution/suns.rs says what they are).
#ifndef SUNS_GLSL
#define SUNS_GLSL

struct SunRecord {
    vec4 place;      // map coordinates
    vec4 irradiance; // at normal incidence
    ivec4 texels;    // first column, columns after it, first and last row
};

const uint MAX_SUNS = 8u;

struct SunList {
    vec4 scale;   // 1 / the largest concentration of a lobe; factors of 2 from there to the least; 1 / those from the map to there
    vec4 rule;    // largest channel of texels that are no sun's; that of a sun's texel in what is left of the map
    ivec4 count;  // x
    SunRecord all[MAX_SUNS];
};

#endif
