#version 460
// The environment's light on grids of nearly square texels (rings.glsl): the finest from level 0 of the chain, others from the
// next finer. A texel is the mean under a tent that reaches its neighbours' centres: boxes would alias.
#include "rings.glsl"

layout(local_size_x = 64) in;
// Whether the source is the chain's level 0.
layout(constant_id = 0) const bool FINEST = true;
layout(set = 2, binding = 0, std430) readonly buffer Source {
    vec4 source[];
};
layout(set = 2, binding = 1, std430) writeonly buffer Target {
    vec4 target[];
};
layout(push_constant) uniform Push {
    int width;
    int from; // first texel in the source
    int to;   // first texel in the target
} push;

// Mean under the tent about texel x, of `count` of a row's `texels` (a power of two) each, from `first` on.
vec3 along(int first, int texels, int x, int count) {
    vec3 sum = vec3(0.0);
    float total = 0.0, scale = 1.0 / float(count);
    for (int i = -(count >> 1); i < count + (count >> 1); ++i) {
        float weight = 1.0 - abs((float(i) + 0.5) * scale - 0.5);
        sum += source[first + ((x * count + i) & (texels - 1))].rgb * weight;
        total += weight;
    }
    return sum / total;
}

void main() {
    ivec2 p = ivec2(gl_GlobalInvocationID.xy);
    int texels = ring_texels(p.y, push.width);
    if (p.x >= texels) {
        return;
    }
    vec3 sum = vec3(0.0);
    if (FINEST) {
        sum = along(push.from + (p.y + (push.width >> 4)) * push.width, push.width, p.x, push.width / texels);
    } else {
        int wide = 2 * push.width, rows = push.width;
        float total = 0.0;
        for (int k = -1; k < 3; ++k) {
            int row = 2 * p.y + k;
            // Beyond a pole it is the meridian across.
            bool across = row < 0 || row >= rows;
            row = row < 0 ? -1 - row : (row >= rows ? 2 * rows - 1 - row : row);
            int children = ring_texels(row, wide);
            int count = children / texels;
            int x = across ? p.x + (texels >> 1) : p.x;
            float weight = (k == 0 || k == 1 ? 0.75 : 0.25) * cos_sin((float(row) + 0.5) * (2.0 * PI) / float(wide)).y;
            sum += along(push.from + row * wide, children, x, count) * weight;
            total += weight;
        }
        sum /= total;
    }
    target[push.to + p.y * push.width + p.x] = vec4(sum, 1.0);
}
