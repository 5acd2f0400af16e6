// How much of each light beside the environment arrives at a sample, as the host's masks say. Include after frame.glsl and lights.glsl;
// the includer defines SHADOWS_BINDING.
#ifndef SHADOWS_GLSL
#define SHADOWS_GLSL

// A layer for each of the first frame.lights.z lights in the host's order, of any size; bound to something where there are none.
layout(set = 2, binding = SHADOWS_BINDING) uniform sampler2DArray shadows;

// By how much a mask may differ across a cell that is shaded as one.
const float SHADOW_STEP = 1.0 / 16.0;

float shadow_at(ivec2 p, int layer) {
    ivec2 extent = ivec2(frame.extent.xy);
    p = clamp(p, ivec2(0), extent - 1);
    return texelFetch(shadows, ivec3(p * textureSize(shadows, 0).xy / extent, layer), 0).r;
}

// Power of a light for shading sample p.
vec3 shadowed(LightRecord light, ivec2 p) {
    int layer = int(light.edge_u.w);
    return light.power.rgb * (layer < int(frame.lights.z) ? shadow_at(p, layer) : 1.0);
}

// The coarsest level, up to `coarsest`, of a cell of sample p across which no mask differs much.
uint shadow_level(ivec2 p, uint coarsest) {
    float change = 0.0;
    for (int layer = 0; layer < int(frame.lights.z); ++layer) {
        float here = shadow_at(p, layer);
        vec4 beside = vec4(shadow_at(p + ivec2(1, 0), layer), shadow_at(p - ivec2(1, 0), layer),
            shadow_at(p + ivec2(0, 1), layer), shadow_at(p - ivec2(0, 1), layer));
        vec4 differences = abs(beside - here);
        change = max(change, max(max(differences.x, differences.y), max(differences.z, differences.w)));
    }
    return min(uint(clamp(log2(SHADOW_STEP / max(change, 1e-6)), 0.0, 16.0)), coarsest);
}

#endif
