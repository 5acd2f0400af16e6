#version 460
// Compiled only to tell one compiler from another: loops, branches, a struct, an image and shared memory, so that a
// change in code generation or in the optimiser is likely to change its words.
layout(local_size_x = 8, local_size_y = 4) in;
struct Sample { vec4 value; uint weight; };
layout(set = 0, binding = 0, std430) readonly buffer Input { Sample samples[]; };
layout(set = 0, binding = 1, rgba16f) writeonly uniform image2D target;
layout(set = 0, binding = 2) uniform sampler2D source;
layout(push_constant) uniform Push { uvec2 extent; float scale; uint count; };
shared vec4 tile[32];

vec4 gather(uint first) {
    vec4 sum = vec4(0.0);
    for (uint i = 0u; i < count; ++i) {
        if (samples[first + i].weight == 0u) continue;
        sum += samples[first + i].value * float(samples[first + i].weight);
    }
    return sum;
}

void main() {
    uint lane = gl_LocalInvocationIndex;
    uvec2 pixel = gl_GlobalInvocationID.xy;
    tile[lane] = gather(lane * count) + textureLod(source, vec2(pixel) / vec2(extent), 0.0);
    barrier();
    for (uint step = 16u; step > 0u; step >>= 1) {
        if (lane < step) tile[lane] = max(tile[lane], tile[lane + step]);
        barrier();
    }
    if (all(lessThan(pixel, extent))) imageStore(target, ivec2(pixel), sqrt(tile[0]) * scale);
}
