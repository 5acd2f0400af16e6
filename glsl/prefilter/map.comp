#version 460
// Level 0 of the chain: the environment without its suns, with rows beyond the poles (src/distribution/prefilter.rs).
#include "latlong.glsl"
#include "suns.glsl"

layout(local_size_x = 64) in;
// Whether the environment has the level's size.
layout(constant_id = 0) const bool SAME_SIZE = true;
layout(set = 2, binding = 0) uniform sampler2D environment;
layout(set = 2, binding = 1, std430) readonly buffer Suns {
    SunList suns;
};
layout(set = 2, binding = 2, std430) writeonly buffer Chain {
    vec4 chain[];
};
layout(push_constant) uniform Push {
    int width;
    int refine; // points a texel along each axis
} push;

vec3 light(ivec2 p) {
    vec3 texel = texelFetch(environment, p, 0).rgb;
    float largest = max(max(texel.r, texel.g), texel.b);
    if (largest > suns.rule.x) {
        int columns = textureSize(environment, 0).x;
        bool sun = false;
        for (int i = 0; i < suns.count.x; ++i) {
            ivec4 at = suns.all[i].texels;
            int x = p.x - at.x;
            x += x < 0 ? columns : 0;
            sun = sun || x <= at.y && p.y >= at.z && p.y <= at.w;
        }
        texel *= sun ? suns.rule.y / largest : 1.0;
    }
    return texel;
}

// Bilinear, wrapping in u and clamped in v, as the environment is looked up.
vec3 bilinear(vec2 uv) {
    ivec2 size = textureSize(environment, 0);
    vec2 at = uv * vec2(size) - 0.5;
    ivec2 a = ivec2(floor(at)), b = a + 1;
    vec2 f = at - floor(at);
    a = ivec2(a.x < 0 ? a.x + size.x : a.x, max(a.y, 0));
    b = ivec2(b.x >= size.x ? b.x - size.x : b.x, min(b.y, size.y - 1));
    return mix(mix(light(a), light(ivec2(b.x, a.y)), f.x), mix(light(ivec2(a.x, b.y)), light(b), f.x), f.y);
}

void main() {
    ivec2 p = ivec2(gl_GlobalInvocationID.xy);
    int beyond = push.width >> 4, rows = push.width >> 1;
    if (p.x >= push.width) {
        return;
    }
    int index = p.y * push.width + p.x;
    p.y -= beyond;
    // Rows beyond a pole are the meridian's across.
    bool across = p.y < 0 || p.y >= rows;
    p.y = p.y < 0 ? -1 - p.y : (p.y >= rows ? 2 * rows - 1 - p.y : p.y);
    p.x = across ? (p.x + rows) & (push.width - 1) : p.x;
    vec3 value = vec3(0.0);
    if (SAME_SIZE) {
        value = light(p);
    } else {
        float points = float(push.refine);
        for (int i = 0; i < push.refine * push.refine; ++i) {
            vec2 within = (vec2(i % push.refine, i / push.refine) + 0.5) / points;
            value += bilinear((vec2(p) + within) / vec2(push.width, rows));
        }
        value /= points * points;
    }
    chain[index] = vec4(value, 1.0);
}
