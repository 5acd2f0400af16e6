// What light a bilinear look-up in a level of the pre-convolved environment holds: each of four texels that under a lobe about itself
// (glsl/prefilter/convolve.comp). Look-ups as they are, to hold an estimate that is built on them against.
#ifndef TEXEL_KERNEL_GLSL
#define TEXEL_KERNEL_GLSL
#include "frame.glsl"
#include "latlong.glsl"
#include "vmf.glsl"

// Density per steradian at world w of the light in a look-up towards world `centre`, in the level whose lobes have concentration
// kappa and a variance of so many squared texels.
float texel_kernel(vec3 centre, float kappa, float variance_in_texels, vec3 w) {
    float texel = inversesqrt(kappa * variance_in_texels);
    float columns = round(2.0 * PI / texel);
    vec2 size = vec2(columns, 0.5 * columns);
    vec2 uv = latlong_uv(centre);
    vec2 at = vec2(uv.x - frame.environment.x, uv.y) * size - 0.5;
    vec2 first = floor(at), along = at - first;
    float sum = 0.0;
    for (int i = 0; i < 4; ++i) {
        vec2 corner = vec2(i & 1, i >> 1);
        vec2 place = (first + corner + 0.5) / size;
        vec4 mu = latlong_direction(vec2(place.x + frame.environment.x, place.y));
        // Without the variance that look-ups add.
        float narrow = vmf_before(kappa, texel * texel * (1.0 / 12.0) * (1.0 + mu.w * mu.w));
        vec2 weight = mix(1.0 - along, along, corner);
        sum += weight.x * weight.y * vmf_density(mu.xyz, narrow, w);
    }
    return sum;
}

#endif
