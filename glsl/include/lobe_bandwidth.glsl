// Where a material's lobe bandwidth lies in the atlas of all: 256 texels a row (16 view angles, even in theta, of 16 texels each),
// 16 rows a material. src/reflectance/bandwidth.rs is the f64 twin and fills it.
#ifndef LOBE_BANDWIDTH_GLSL
#define LOBE_BANDWIDTH_GLSL
#include "angles.glsl"

// The texel of light direction wi seen from wo, both unit with z the normal, above the horizon. A tile has the viewer at azimuth
// 0; the disc that fills it is the hemisphere, equal in area.
ivec2 lobe_bandwidth_texel(int material, vec3 wi, vec3 wo) {
    float sine = dot(wo.xy, wo.xy);
    vec2 viewer = sine > 0.0 ? wo.xy * inversesqrt(sine) : vec2(1.0, 0.0);
    vec2 disc = vec2(dot(viewer, wi.xy), viewer.x * wi.y - viewer.y * wi.x) * inversesqrt(1.0 + max(wi.z, 0.0));
    ivec2 place = clamp(ivec2(8.0 + 8.0 * disc), 0, 15);
    int angle = clamp(int(acos_positive(clamp(wo.z, 0.0, 1.0)) * (16.0 / HALF_PI)), 0, 15);
    return ivec2(16 * angle + place.x, 16 * material + place.y);
}

#endif
