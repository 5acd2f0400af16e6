#version 460
// Values of the cells of one level that take theirs from four parents, with the weights that `classify` found (Bagher 2011,
// section 3.2).
#include "frame.glsl"
#include "levels.glsl"
#include "list.glsl"

layout(local_size_x = LIST_GROUP) in;

layout(constant_id = 0) const int LEVEL = 0;

layout(set = 2, binding = 1, std430) readonly buffer Blocks {
    Block blocks[];
};
layout(set = 2, binding = 2, std430) readonly buffer BlockArguments {
    uvec4 block_arguments[LEVELS];
};
layout(set = 2, binding = 3, std430) readonly buffer Weights {
    uint weights[];
};
layout(set = 2, binding = 4) uniform sampler2D parents;
layout(set = 2, binding = 5, rgba32f) uniform writeonly image2D values;

vec3 parent(ivec2 c) {
    ivec4 level = frame.levels[LEVEL + 1];
    return texelFetch(parents, clamp(c, ivec2(0), level.xy - 1) + ivec2(0, level.w), 0).rgb;
}

// From a to b by `steps` of 255. What has no weight may be undefined and is left out; equal values come out as they are.
vec3 between(vec3 a, vec3 b, uint steps) {
    vec3 from = steps == 255u ? b : a, to = steps == 0u ? a : b;
    return from + (to - from) * (float(int(steps)) / 255.0);
}

void child(ivec2 c, uint word, vec3 a, vec3 b, vec3 d, vec3 e) {
    vec3 value = between(between(a, b, word & 255u), between(d, e, word >> 8 & 255u), word >> 16 & 255u);
    if (word >= FROM_PARENTS) {
        imageStore(values, c + ivec2(0, frame.levels[LEVEL].w), vec4(value, 1.0));
    }
}

void main() {
    uint index = list_index();
    if (index >= block_arguments[LEVEL + 1].w) {
        return;
    }
    uint slot = uint(frame.levels[LEVEL + 1].z) + index;
    uint packed = blocks[slot].cell;
    ivec2 cell = ivec2(packed & 0xffffu, packed >> 16);
    vec3 p0 = parent(cell + ivec2(-1, -1)), p1 = parent(cell + ivec2(0, -1)), p2 = parent(cell + ivec2(1, -1));
    vec3 p3 = parent(cell + ivec2(-1, 0)), p4 = parent(cell), p5 = parent(cell + ivec2(1, 0));
    vec3 p6 = parent(cell + ivec2(-1, 1)), p7 = parent(cell + ivec2(0, 1)), p8 = parent(cell + ivec2(1, 1));
    ivec2 c = cell * 2;
    child(c, weights[4u * slot], p0, p1, p3, p4);
    child(c + ivec2(1, 0), weights[4u * slot + 1u], p1, p2, p4, p5);
    child(c + ivec2(0, 1), weights[4u * slot + 2u], p3, p4, p6, p7);
    child(c + 1, weights[4u * slot + 3u], p4, p5, p7, p8);
}
