#version 460
// The level as a shading-rate attachment (VK_KHR_fragment_shading_rate): for each texel the finest level of the samples with a surface
// below it, as the base-2 logarithms of the pixels that hardware may shade at once, height in bits 0 and 1, width in bits 2 and 3.
#include "frame.glsl"
#include "gbuffer.glsl"

// An invocation looks at a part of four texels, which are a word.
layout(local_size_x = 8, local_size_y = 8) in;

layout(set = 2, binding = 1) uniform usampler2D level; // of each sample, in levels over a sample
layout(set = 2, binding = 2, std430) writeonly buffer Rates {
    uint rates[]; // row after row, each of whole words
};

layout(push_constant) uniform Push {
    ivec2 texel;  // in samples
    int words;    // a row
    int finer;    // levels of a sample below a pixel
    int coarsest; // level of a pixel
} push;

shared int least[4];

void main() {
    int lane = int(gl_LocalInvocationIndex);
    if (lane < 4) {
        least[lane] = push.coarsest;
    }
    barrier();
    ivec2 word = ivec2(gl_WorkGroupID.xy), extent = ivec2(frame.extent.xy);
    for (int k = 0; k < 4; ++k) {
        ivec2 first = ivec2(word.x * 4 + k, word.y) * push.texel;
        int found = push.coarsest;
        for (int y = int(gl_LocalInvocationID.y); y < push.texel.y; y += 8) {
            for (int x = int(gl_LocalInvocationID.x); x < push.texel.x; x += 8) {
                ivec2 p = first + ivec2(x, y);
                bool inside = all(lessThan(p, extent));
                p = inside ? p : ivec2(0);
                int own = max(int(texelFetch(level, p, 0).x) - push.finer, 0);
                found = inside && gbuffer_covered(p) ? min(found, own) : found;
            }
        }
        atomicMin(least[k], found);
    }
    barrier();
    if (lane == 0) {
        uint packed = 0u;
        for (int k = 0; k < 4; ++k) {
            uint rate = uint(least[k]);
            packed |= (rate << 2 | rate) << (8 * k);
        }
        rates[word.y * push.words + word.x] = packed;
    }
}
