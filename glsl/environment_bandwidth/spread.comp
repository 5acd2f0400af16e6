#version 460
// The largest of the details that cover each block of a level from the second on: its own and those of the two blocks before
// it, both ways. src/frequency/wavelet.rs is the f64 twin.
layout(local_size_x = 8, local_size_y = 8) in;
layout(set = 2, binding = 0) uniform sampler2D details;
layout(set = 2, binding = 1, rgba16f) uniform writeonly image2D covering;
layout(push_constant) uniform Push {
    ivec2 count;  // of this level's blocks on the torus, powers of two
    ivec2 place;  // of this level in both images
    int rows;     // blocks down that are wanted: those of the map
};

void main() {
    ivec2 p = ivec2(gl_GlobalInvocationID.xy);
    if (p.x >= count.x || p.y >= rows) {
        return;
    }
    vec2 largest = vec2(0.0);
    for (int j = 0; j < 3; ++j) {
        for (int i = 0; i < 3; ++i) {
            largest = max(largest, texelFetch(details, place + ((p - ivec2(i, j)) & (count - 1)), 0).xy);
        }
    }
    imageStore(covering, place + p, vec4(largest, 0.0, 0.0));
}
