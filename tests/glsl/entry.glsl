// The frame of every probe: reads entry i, writes result i. A stage includes this first and defines `probe`.
#ifndef ENTRY_GLSL
#define ENTRY_GLSL

layout(local_size_x = 64) in;

layout(set = 2, binding = 3, std430) readonly buffer Input {
    uvec4 entries[];
};
layout(set = 2, binding = 4, std430) writeonly buffer Output {
    vec4 results[];
};
layout(push_constant) uniform Push {
    uint count;
} push;

vec4 probe(uint i);

void main() {
    if (gl_GlobalInvocationID.x < push.count) {
        results[gl_GlobalInvocationID.x] = probe(gl_GlobalInvocationID.x);
    }
}

#endif
